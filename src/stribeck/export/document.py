"""An XML document that changes in places and otherwise stays as it was, comments and all."""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from xml.dom.minidom import Document, Element, Text, parse

from stribeck.robot.xml_file import read_xml
from stribeck.typing import Array


def read_document(path: Path) -> tuple[Document, Element]:
    """Read the document of a file, and return its root element, too.

    Raises
    ------
    RobotFileError
        If it is not well-formed.
    """
    read_xml(path)  # refuses a missing file, deep nesting, and entities
    document = parse(str(path))  # nosec B318
    return document, root_of(document)


def root_of(document: Document) -> Element:
    """Return the root element of a document."""
    assert document.documentElement is not None
    return document.documentElement


def document_text(document: Document, comment: Iterable[str]) -> str:
    """Return the text of a document below a comment of some lines."""
    lines = [re.sub("[^\t\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", " ", line) for line in comment]  # not in XML
    lines = [re.sub("-(?=-)", "- ", line) for line in lines]  # no comment may hold two hyphens in a row
    head = ["<!--", *(f"  {line}" for line in lines), "-->"]
    parts = (node.toxml() for node in document.childNodes)
    return "\n".join(['<?xml version="1.0" encoding="utf-8"?>', *head, *parts]) + "\n"


def children(parent: Element, tag: str) -> list[Element]:
    """Return an element's direct children of a tag."""
    return [node for node in parent.childNodes if isinstance(node, Element) and node.tagName == tag]


def child(parent: Element, tag: str) -> Element:
    """Return the first direct child of a tag; if there is none, insert one before the others."""
    if there := children(parent, tag):
        return there[0]
    first = parent.firstChild
    new = parent.insertBefore(_document(parent).createElement(tag), first)
    if isinstance(first, Text) and not first.data.strip():
        parent.insertBefore(_document(parent).createTextNode(first.data), new)
    return new


def add(parent: Element, tag: str, **attributes: str) -> Element:
    """Append a new child."""
    new = parent.appendChild(_document(parent).createElement(tag))
    for name, value in attributes.items():
        new.setAttribute(name, value)
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


def moved(path: str, source: Path, target: Path) -> str:
    """Return a path that leads from the folder `target` to where it led from the folder `source`."""
    if Path(path).is_absolute() or source.resolve() == target.resolve():
        return path
    return Path(os.path.relpath((source / path).resolve(), target.resolve())).as_posix()


def _document(element: Element) -> Document:
    assert element.ownerDocument is not None
    return element.ownerDocument
