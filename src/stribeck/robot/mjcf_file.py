"""What an MJCF file says, checked by line before MuJoCo and Pinocchio read it."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from stribeck.errors import RobotFileError
from stribeck.files import irregular, read_text
from stribeck.robot.xml_file import MOST_BODIES, MOST_JOINTS, XmlFile, read_xml, require_few

MOST_FILES = 100
"""That a model is made of [1]."""
GENERATED = ("replicate", "composite", "flexcomp", "attach")
"""Elements that MuJoCo makes bodies of, any number of them, and Pinocchio does not read."""
COUNTS = ("nrow", "ncol", "width", "height", "nsample", "nkey", "num", "resolution", "params")
LARGEST = 5000
"""Of what MuJoCo makes as many of as the file says: pixels, samples, numbers of a user [1]."""
BODIES = ("body", "frame", "inertial", "joint", "geom")
MEASURES = (
    *("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "axis", "ref", "armature"),
    *("mass", "diaginertia", "fullinertia", "density", "size", "fromto"),
)
"""What says where bodies are and what they weigh; MuJoCo takes `nan` for what is not stated."""


def check_mjcf_file(xml: XmlFile) -> None:
    """Check the file, and those that it includes, for what would make native readers hang, or drop what is stated.

    Raises
    ------
    RobotFileError
        Naming the element and its line.
    """
    files = list(_with_included(xml))
    bodies = [body for file in files for body in file.root.iter("body")]
    joints = [joint for body in bodies for joint in body.findall("joint")]
    for elements, most in ((bodies, MOST_BODIES), (joints, MOST_JOINTS)):
        owner = next((file for file in files if elements[most:] and elements[most] in file.lines), xml)
        require_few(owner, elements, most)
    folders = [
        xml.path.parent / (compiler.get(name) or "")
        for file in files
        for compiler in file.root.iter("compiler")
        for name in ("assetdir", "meshdir", "texturedir")
    ]
    for file in files:
        read_text(file.path, "an MJCF model", RobotFileError)  # MuJoCo takes bytes as they are, whatever the encoding
        for element in file.root.iter():
            _check_element(file, element, [xml.path.parent, file.path.parent, *folders])


def _with_included(xml: XmlFile) -> Iterator[XmlFile]:
    """Yield a file and all that it includes, each once."""
    pending, seen = [xml], {xml.path.resolve()}
    while pending:
        file = pending.pop()
        yield file
        for include in file.root.iter("include"):
            name = include.get("file") or ""
            for path in (xml.path.parent / name, file.path.parent / name):
                if name and path.exists() and path.resolve() not in seen:
                    if len(seen) >= MOST_FILES:
                        file.refuse(include, f"includes the {MOST_FILES + 1}th file; expected {MOST_FILES} at most")
                    seen.add(path.resolve())
                    pending.append(read_xml(path))


def _check_element(xml: XmlFile, element: Element, folders: list[Path]) -> None:
    tag = element.tag
    if tag in GENERATED:
        xml.refuse(element, f"<{tag}> makes bodies that Pinocchio does not read; write the bodies themselves")
    for name, text in element.items():
        counts = name in COUNTS or name.startswith("nuser_") or (tag, name) == ("numeric", "size")
        if counts and max(_numbers(xml, element, name), default=0.0) > LARGEST:
            xml.refuse(element, f"{name} of <{tag}> is {text[:60]}; expected {LARGEST} at most")
    for name in MEASURES if tag in BODIES else ():
        if name in element.attrib:
            values = _numbers(xml, element, name)
            if name in ("mass", "diaginertia", "density", "armature") and min(values, default=0.0) < 0:
                xml.refuse(element, f"{name} of <{tag}> is {element.get(name)}; expected zero or more")
    path = element.get("file", "")
    for folder in folders if path else ():
        for candidate in (folder / path, folder / Path(path).name):
            if candidate.exists() and (kind := irregular(candidate)) and not candidate.is_dir():
                xml.refuse(element, f"<{tag}> names {candidate}, which is {kind}; expected a file")


def _numbers(xml: XmlFile, element: Element, name: str) -> list[float]:
    text = element.get(name, "")
    return xml.numbers(element, text, len(text.split()), f"{name} of <{element.tag}>")
