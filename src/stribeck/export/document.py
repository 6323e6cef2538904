"""An XML document that is changed here and there and otherwise stays as it was, comments and all."""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from xml.dom.minidom import Document, Element, Text, parse

from stribeck.robot.xml_file import read_xml
from stribeck.typing import Array

_NOT_IN_COMMENTS = re.compile("[^\t\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML may hold, and line ends."""


def read_document(path: Path) -> tuple[Document, Element]:
    """Return the document of a file, and its root element.

    Raises
    ------
    RobotFileError
        If it is not well-formed.
    """
    read_xml(path)  # which refuses what is no file, too deep, or defines entities
    document = parse(str(path))  # nosec B318
    assert document.documentElement is not None
    return document, document.documentElement


def document_text(document: Document, comment: Iterable[str]) -> str:
    """Return the text of a document with a comment at its head, a line each."""
    lines = [_NOT_IN_COMMENTS.sub(" ", line) for line in comment]
    lines = [re.sub("-(?=-)", "- ", line) for line in lines]  # no comment may hold two hyphens in a row
    head = ["<!--", *(f"  {line}" for line in lines), "-->"]
    parts = (node.toxml() for node in document.childNodes)
    return "\n".join(['<?xml version="1.0" encoding="utf-8"?>', *head, *parts]) + "\n"


def children(parent: Element, tag: str) -> list[Element]:
    """Return an element's direct children of a tag."""
    return [node for node in parent.childNodes if isinstance(node, Element) and node.tagName == tag]


def child(parent: Element, tag: str) -> Element:
    """Return the first direct child of a tag; it is made, before the others, where there is none."""
    there = children(parent, tag)
    return there[0] if there else _new_child(parent, tag)


def _new_child(parent: Element, tag: str) -> Element:
    document, first = parent.ownerDocument, parent.firstChild
    assert document is not None
    new = document.createElement(tag)
    parent.insertBefore(new, first)
    if isinstance(first, Text) and not first.data.strip():
        parent.insertBefore(document.createTextNode(first.data), new)
    return new


def remove(element: Element) -> None:
    """Take an element out of its document."""
    assert element.parentNode is not None
    element.parentNode.removeChild(element)


def set_numbers(element: Element, **attributes: float | Array) -> None:
    """Set attributes to numbers, with all their digits."""
    for name, value in attributes.items():
        numbers = [float(value)] if isinstance(value, float) else value.tolist()
        element.setAttribute(name, " ".join(map(repr, numbers)))


def set_text(element: Element, *values: float | str) -> None:
    """Let an element hold a text: words as they are, and numbers with all their digits."""
    document = element.ownerDocument
    assert document is not None
    while element.firstChild is not None:
        element.removeChild(element.firstChild)
    element.appendChild(document.createTextNode(" ".join(map(str, values))))


def text_of(element: Element) -> str:
    """Return the text that an element holds."""
    return "".join(node.data for node in element.childNodes if isinstance(node, Text)).strip()


def moved(path: str, source: Path, target: Path) -> str:
    """Return a path that leads from the folder `target` to where it led from the folder `source`."""
    if Path(path).is_absolute() or source.resolve() == target.resolve():
        return path
    return Path(os.path.relpath((source / path).resolve(), target.resolve())).as_posix()
