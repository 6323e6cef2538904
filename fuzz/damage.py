"""Changes to sound texts: of bytes, of words and numbers, and of the structure of XML, TOML and JSON."""

import re
from collections.abc import Sequence
from copy import deepcopy
from typing import Any, TypeVar
from xml.etree import ElementTree

import numpy as np

Generator = np.random.Generator
One = TypeVar("One")

NUMBERS = (
    *("0", "-0.0", "-1", "1", "3", "1e-300", "1e300", "-1e300", "nan", "inf", "-inf", "1e999", "0x10", "1_0", "1,5"),
    *("2147483648", "-9223372036854775809", "9" * 400, "1e-5", "100000001", "0.1", "١"),
)
"""Numbers at the edge of what a reader expects, and what looks like one."""
WORDS = (
    *("", " ", "nan", "left", "[left]", "[/]", "a'b", 'a"b', "ä", "\u202e", "\ud83e\udd16", "universe", "base"),
    *("root_joint", "__model__", "../..", "/dev/zero", "x" * 5000, "%s%n", "{}", "true", "fixed", "floating", "ball"),
    *("\x00", "\n", "&amp;", "world", "shoulder", "elbow"),
)
"""Texts that a reader may trip over."""
VALUES: tuple[Any, ...] = (
    *(
        None,
        True,
        False,
        0,
        -1,
        1,
        3,
        0.5,
        float("nan"),
        float("inf"),
        -1e300,
        1e300,
        1e-300,
        2**63,
        -(2**63) - 1,
        10**30,
        100_000_001,
    ),
    *("", "x", "[left]", "[/]", "nan", "\ud83e\udd16", [], {}, [1], [[]], ["x"], {"x": 1}, [1.0, 2.0], [0.0] * 6),
)
"""Values of any type."""


def pick(generator: Generator, choices: Sequence[One]) -> One:
    """Return one of some choices."""
    return choices[int(generator.integers(len(choices)))]


def bytes_damaged(generator: Generator, content: bytes) -> bytes:
    """Return bytes of which one is another, a part is lost, twice there, or all behind it is lost."""
    start, end = sorted(int(k) for k in generator.integers(0, len(content) + 1, 2))
    end = min(end, start + int(2 ** generator.uniform(0, 10)))
    match int(generator.integers(5)):
        case 0:
            return content[:start] + generator.bytes(1) + content[start + 1 :]
        case 1:
            return content[:start] + content[end:]
        case 2:
            return content[:end] + content[start:]
        case 3:
            return content[:start]
    return content[:start] + generator.bytes(int(generator.integers(1, 5))) + content[start:]


def text_damaged(generator: Generator, text: str) -> str:
    """Return a text in which a number, or a word between quotes or tags, is another one."""
    pattern = pick(generator, (r"-?\d[\d.e+-]*", r'(?<=")[^"\n]*(?=")', r"(?<=>)[^<>]+(?=<)", r"\w+"))
    places = list(re.finditer(pattern, text))
    if not places:
        return text
    place = pick(generator, places)
    new = pick(generator, NUMBERS if generator.random() < 0.6 else WORDS)
    return text[: place.start()] + new + text[place.end() :]


def xml_damaged(generator: Generator, text: str) -> str:
    """Return an XML document with an element or an attribute lost, doubled, renamed, moved or nested."""
    root = ElementTree.fromstring(text)  # a file of this repository  # nosec B314
    parents = {child: parent for parent in root.iter() for child in parent}
    element: ElementTree.Element = pick(generator, list(root.iter()))
    others = list(root.iter())
    match int(generator.integers(8)):
        case 0 if element in parents:
            parents[element].remove(element)
        case 1 if element in parents:
            parents[element].append(element)
        case 2 if element.attrib:
            del element.attrib[pick(generator, sorted(element.attrib))]
        case 3 if element.attrib:
            name = pick(generator, sorted(element.attrib))
            element.set(name, pick(generator, (*NUMBERS, *(word for word in WORDS if word.isprintable()))))
        case 4:
            element.tag = pick(generator, others).tag
        case 5:
            other = pick(generator, others)
            element.attrib.update(other.attrib)
        case 6:
            element.append(ElementTree.Element(pick(generator, others).tag, pick(generator, others).attrib))
        case 7 if element in parents:
            deep = element
            for _ in range(int(10 ** generator.uniform(0, 2.4))):
                outer = ElementTree.Element(element.tag, element.attrib)
                outer.append(deep)
                deep = outer
            parents[element].append(deep)
    return ElementTree.tostring(root, encoding="unicode")


def value_damaged(generator: Generator, document: Any) -> Any:
    """Return plain data in which one value, at any depth, is lost, of another type, or another's."""
    places: list[tuple[Any, Any]] = []
    pending = [document]
    while pending:
        inner = pending.pop()
        keys = list(inner) if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ()
        places += [(inner, key) for key in keys]
        pending += [inner[key] for key in keys]
    if not places:
        return pick(generator, VALUES)
    holder, key = pick(generator, places)
    match int(generator.integers(5)):
        case 0:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[pick(generator, WORDS)] = holder.pop(key)
        case 2:
            other, place = pick(generator, places)
            there = place in other if isinstance(other, dict) else place < len(other)
            holder[key] = deepcopy(other[place]) if there else None
        case _:
            holder[key] = deepcopy(pick(generator, VALUES))
    return document


def nested(generator: Generator, opening: str, inner: str, closing: str) -> str:
    """Return a text inside many brackets."""
    depth = int(10 ** generator.uniform(1, 5))
    return opening * depth + inner + closing * depth
