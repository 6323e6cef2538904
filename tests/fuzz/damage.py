"""Changes to sound texts: of bytes, of words and numbers, and of the structure of XML, TOML and JSON."""

import json
import re
import tomllib
from copy import deepcopy
from xml.etree import ElementTree

NUMBERS = (
    *("0", "-0.0", "-1", "1", "3", "1e-300", "1e300", "-1e300", "nan", "inf", "-inf", "1e999", "0x10", "1_0", "1,5"),
    *("2147483648", "-9223372036854775809", "9" * 400, "1e-5", "100000001", "0.1", "١"),
)
"""Numbers at the edge of what a reader expects, and words that look like one."""
WORDS = (
    *("", " ", "nan", "left", "[left]", "[/]", "a'b", 'a"b', "ä", "\u202e", "\ud83e\udd16", "universe", "base"),
    *("root_joint", "__model__", "../..", "/dev/zero", "x" * 5000, "%s%n", "{}", "true", "fixed", "floating", "ball"),
    *("\x00", "\n", "&amp;", "world", "shoulder", "elbow"),
)
VALUES: tuple[object, ...] = (
    *(None, True, False, 0, -1, 1, 3, 0.5, float("nan"), float("inf"), -1e300, 1e300, 1e-300, 10**30, 100_000_001),
    *(2**63, -(2**63) - 1, "", "x", "[left]", "[/]", "nan", "\ud83e\udd16", [], {}, [1], [[]], ["x"], {"x": 1}),
    *([1.0, 2.0], [0.0] * 6),
)


def pick(generator, choices):
    return choices[int(generator.integers(len(choices)))]


def bytes_damaged(generator, content):
    """Return bytes with another byte, a lost, doubled or inserted part, an extreme number, or two blocks exchanged."""
    start, end = sorted(int(k) for k in generator.integers(0, len(content) + 1, 2))
    end = min(end, start + int(2 ** generator.uniform(0, 12)))
    width = end - start
    match int(generator.integers(8)):
        case 0:
            return content[:start] + generator.bytes(1) + content[start + 1 :]
        case 1:
            return content[:start] + content[end:]
        case 2:
            return content[:end] + content[start:]
        case 3:
            return content[:start]
        case 4:
            return content[:start] + generator.bytes(int(generator.integers(1, 5))) + content[start:]
        case 5:  # blocks exchanged
            return content[:start] + content[end : end + width] + content[start:end] + content[end + width :]
        case 6:
            return content[:start] + bytes(width) + content[end:]
    # a number of 2 to 8 bytes near the start or the end, where headers are
    place = int(2 ** generator.uniform(0, 12))
    start = max(0, min(place, len(content)) if generator.random() < 0.5 else len(content) - place)
    number = pick(generator, (b"\xff", b"\x7f", b"\x80", b"\x00")) * int(2 ** generator.integers(1, 4))
    return content[:start] + number + content[start + len(number) :]


def text_damaged(generator, text):
    """Return a text in which a number, or a word between quotes or tags, is another one."""
    pattern = pick(generator, (r"-?\d[\d.e+-]*", r'(?<=")[^"\n]*(?=")', r"(?<=>)[^<>]+(?=<)", r"\w+"))
    if not (places := list(re.finditer(pattern, text))):
        return text
    place = pick(generator, places)
    return text[: place.start()] + pick(generator, (*NUMBERS, *WORDS)) + text[place.end() :]


def xml_damaged(generator, text):
    """Return an XML document with an element or an attribute lost, doubled, renamed, moved or nested."""
    root = ElementTree.fromstring(text)
    parents = {child: parent for parent in root.iter() for child in parent}
    element, other = (pick(generator, list(root.iter())) for _ in range(2))
    match int(generator.integers(8)):
        case 0 if element in parents:
            parents[element].remove(element)
        case 1 if element in parents:
            parents[element].append(element)
        case 2 if element.attrib:
            del element.attrib[pick(generator, sorted(element.attrib))]
        case 3 if element.attrib:
            word = pick(generator, (*NUMBERS, *filter(str.isprintable, WORDS)))
            element.set(pick(generator, sorted(element.attrib)), word)
        case 4:
            element.tag = other.tag
        case 5:
            element.attrib.update(other.attrib)
        case 6:
            element.append(ElementTree.Element(other.tag, other.attrib))
        case 7 if element in parents:
            deep = element
            for _ in range(int(10 ** generator.uniform(0, 2.4))):
                outer = ElementTree.Element(element.tag, element.attrib)
                outer.append(deep)
                deep = outer
            parents[element].append(deep)
    return ElementTree.tostring(root, encoding="unicode")


def value_damaged(generator, document):
    """Return plain data in which one value, at any depth, is lost, renamed, of another type, or that of another key."""
    places, pending = [], [document]
    while pending:
        inner = pending.pop()
        keys = list(inner) if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ()
        places += [(inner, key) for key in keys]
        pending += [inner[key] for key in keys]
    if not places:
        return pick(generator, VALUES)
    holder, key = pick(generator, places)
    other, place = pick(generator, places)
    match int(generator.integers(5)):
        case 0:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[pick(generator, WORDS)] = holder.pop(key)
        case 2:
            holder[key] = deepcopy(other[place])
        case _:
            holder[key] = deepcopy(pick(generator, VALUES))
    return document


def number_damaged(generator, document):
    """Return plain data in which one number is zero, tiny, huge, negated, or missing."""
    places, pending = [], [document]
    while pending:
        inner = pending.pop()
        pairs = inner.items() if isinstance(inner, dict) else enumerate(inner) if isinstance(inner, list) else ()
        places += [(inner, key) for key, value in pairs if isinstance(value, int | float)]
        pending += [value for _, value in pairs]
    if places:
        holder, key = pick(generator, places)
        old = holder[key]
        holder[key] = pick(generator, (0, -old, 1e6 * old, 1e-300, 1e300, 1e308, -1e308, 1e-9, 1e12, None, 2**53, 1))
    return document


def nested(generator, opening, inner, closing):
    """Return a text inside many brackets."""
    depth = int(10 ** generator.uniform(1, 5))
    return opening * depth + inner + closing * depth


def document_damaged(generator, text, kind):
    """Return the bytes of a TOML, JSON, URDF or MJCF document that is damaged somewhere."""
    several = range(int(generator.integers(1, 4)))
    match int(generator.integers(10)):
        case 0 | 1:
            return bytes_damaged(generator, text.encode())
        case 2 | 3 | 4:
            for _ in several:
                text = text_damaged(generator, text)
        case 5 if kind == "xml":
            tag = pick(generator, ("link", "body", "robot", "joint", "x"))
            inside = f'<{tag} name="x"/>' * int(10 ** generator.uniform(1, 5))
            place = pick(generator, [found.start() for found in re.finditer("<", text)][2:])
            deep, wide = nested(generator, f"<{tag}>", "", f"</{tag}>"), text[:place] + inside + text[place:]
            text = pick(generator, (deep, wide, '<?xml version="1.0" encoding="klingon"?>' + text))
        case 5:
            inner = nested(generator, *pick(generator, (("[", "1", "]"), ('{"a":', "1", "}"), ("{a=", "1", "}"))))
            text = text + f"\nx = {inner}" if kind == "toml" else text.replace("{", f'{{"x": {inner},', 1)
        case _ if kind == "xml":
            for _ in several:
                text = xml_damaged(generator, text)
        case _:
            document = tomllib.loads(text) if kind == "toml" else json.loads(text)
            for _ in several:
                document = value_damaged(generator, document)
            text = json.dumps(document) if kind == "json" else as_toml(document)
    return text.encode(errors="surrogatepass")


def as_toml(document, top=True):
    """Return plain data as TOML; values that TOML lacks are written as in JSON."""
    if isinstance(document, dict):
        pairs = [f"{json.dumps(key)} = {as_toml(value, False)}" for key, value in document.items()]
        return "\n".join(pairs) if top else "{" + ", ".join(pairs) + "}"
    if isinstance(document, list):
        return "[" + ", ".join(as_toml(value, False) for value in document) + "]"
    return json.dumps(document)
