"""XML model files: read with line numbers, and checked for size before any native reader opens them."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NoReturn
from xml.etree.ElementTree import Element, TreeBuilder, tostring
from xml.parsers import expat

from stribeck.core.base.files import read_bytes
from stribeck.core.errors import RobotFileError

MOST_ELEMENTS, DEEPEST = 200_000, 200
"""Largest number of elements, and of their depth and attributes [1]; native readers recurse into elements."""
MOST_BODIES, MOST_JOINTS = 1000, 150
"""Largest number of links and of moving joints [1]. Pinocchio's memory is cubic in the joints: 0.4 GB for 150."""
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""Numbers that all readers parse alike."""


@dataclass(frozen=True, eq=False)
class XmlFile:
    """Elements of a file, the line of each, and lists of places by the repair that was made there."""

    path: Path
    root: Element
    lines: Mapping[Element, int]
    repairs: dict[str, list[str]] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The document as a string, independent of the file's encoding."""
        return tostring(self.root, encoding="unicode")

    @property
    def kind(self) -> Literal["urdf", "mjcf"]:
        """Format of the model by its root element; a RobotFileError if it is another one."""
        if self.root.tag not in ("robot", "mujoco"):
            expected = "<robot> (URDF) or <mujoco> (MJCF); convert models in other formats such as SDF"
            raise RobotFileError(f"{self.path}: the root element is <{self.root.tag}>; expected {expected}")
        return "urdf" if self.root.tag == "robot" else "mjcf"

    def refuse(self, element: Element, message: str) -> NoReturn:
        """Raise a RobotFileError about an element."""
        raise RobotFileError(f"{self.path}: line {self.lines[element]}: {message}")

    def named(self, tag: str) -> dict[str, Element]:
        """Map the names of the root's children of a tag to them; names must exist and be unique."""
        elements: dict[str, Element] = {}
        for element in self.root.findall(tag):
            name = element.get("name")
            if not name:
                self.refuse(element, f'a <{tag}> has no name; write <{tag} name="...">')
            if name in elements:
                self.refuse(element, f"{tag} '{name}' is already defined in line {self.lines[elements[name]]}")
            elements[name] = element
        return elements

    def only(self, parent: Element, tag: str, of: str) -> Element | None:
        """Return the only child of a tag; None if the element has no such child."""
        children = parent.findall(tag)
        if len(children) > 1:
            self.refuse(children[1], f"{of} has {len(children)} <{tag}>; expected one")
        return children[0] if children else None

    def first(self, parent: Element, tag: str, of: str) -> Element | None:
        """Return the first child of a tag, which other readers use, too, and remove the others."""
        children = parent.findall(tag)
        for other in children[1:]:
            self.repair("the first of repeated elements is used", f"<{tag}> of {of}", other)
            parent.remove(other)
        return children[0] if children else None

    def repair(self, repair: str, place: str, element: Element) -> None:
        """Note a repair of an element for a warning."""
        self.repairs.setdefault(repair, []).append(f"{place} in line {self.lines[element]}")

    def numbers(self, element: Element, text: str | None, count: int, what: str) -> list[float]:
        """Parse plain, finite numbers."""
        words = (text or "").split()
        values = [float(word) for word in words if NUMBER.fullmatch(word)]
        if len(values) != len(words) or len(words) != count or not all(map(math.isfinite, values)):
            content = "nothing" if text is None else f"'{text[:60]}'"
            expected = "a finite number" if count == 1 else f"{count} finite numbers"
            self.refuse(element, f"{what} is {content}; expected {expected}")
        return values


def read_xml(path: Path) -> XmlFile:
    """Read an XML file.

    Raises
    ------
    RobotFileError
        If it cannot be read, is not well-formed, defines entities, or is larger or deeper than any robot's model.
    """
    expected = "a URDF or MJCF model, whose path is relative to the robot file"
    content = read_bytes(path, expected, RobotFileError)
    builder, lines, depth = TreeBuilder(), dict[Element, int](), 0
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        element = builder.start(tag, attributes)
        lines[element] = parser.CurrentLineNumber
        if depth > DEEPEST or len(lines) > MOST_ELEMENTS or len(attributes) > DEEPEST:
            raise RobotFileError(
                f"{path}: line {parser.CurrentLineNumber}: <{tag[:60]}> is element {len(lines):,} at depth {depth}; "
                f"expected at most {MOST_ELEMENTS:,} elements, a depth of at most {DEEPEST}, and as many attributes"
            )

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def entity(name: str, *_: object) -> None:
        raise RobotFileError(
            f"{path}: line {parser.CurrentLineNumber}: defines the entity '{name}'; expected a model without entities"
        )

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = builder.data, entity
    parser.buffer_text = True
    try:
        parser.Parse(content, True)
    except (expat.ExpatError, ValueError, LookupError) as error:  # LookupError: an unknown encoding
        raise RobotFileError(f"{path}: is not well-formed XML ({error}); expected a URDF or MJCF model") from error
    return XmlFile(path, builder.close(), lines)
