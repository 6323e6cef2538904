"""Arbitrary robot files and models are read or refused in one sentence."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.robot.test_robot import MJCF, URDF, write_robot

from stribeck.errors import RobotFileError
from stribeck.robot import Robot, read_robot_file

TABLES = ("robot", "contacts", "log", "identify", "filter", "support", "position", "torque", "left", "joint_names")
KEYS = (
    *TABLES,
    "model",
    "base",
    "armature",
    "locked",
    "gravity",
    "scale",
    "unit",
    "frame",
    "kind",
    "window",
    "rate",
    "x",
)
LEAVES = st.one_of(st.integers(), st.floats(), st.booleans(), st.text(max_size=5))
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(KEYS), inner, max_size=3)),
    max_leaves=6,
)
WORDS = ("0", "-1", "nan", "inf", "", "abc", "1 2", "0 0 0", "prismatic", "fixed", "floating", "ball", "base", "lower")
PLACES = re.compile(r'(?<=")[^"]*(?=")| \w+="[^"]*"|<\w+[^<>]*/>')
QUIET = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def toml(value: Any) -> str:
    """Format a value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml(inner) for inner in value) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


def accept_or_refuse(read, path: Path):
    try:
        return read(path)
    except RobotFileError as error:
        message = str(error)
    assert message.startswith(str(path.parent))
    assert "\n" not in message
    return None


@QUIET
@given(
    st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=4),
    st.dictionaries(st.sampled_from(("base", "armature", "locked", "gravity", "name", "x")), VALUES, max_size=3),
)
def test_any_robot_file(tmp_path, document, table):
    path = tmp_path / "robot.toml"
    document = document | {"robot": {"model": "arm.urdf", **table}}
    path.write_text("\n".join(f"{key} = {toml(value)}" for key, value in document.items()), encoding="utf-8")
    accept_or_refuse(read_robot_file, path)


@QUIET
@given(st.sampled_from([(URDF, "arm.urdf"), (MJCF, "arm.xml")]), st.data())
def test_any_damaged_model(tmp_path, model, data):
    """Replace or delete one or two texts, attributes or elements of a valid model."""
    text, name = model
    for _ in range(data.draw(st.integers(1, 2))):
        place = data.draw(st.sampled_from(list(PLACES.finditer(text))))
        word = "" if place.group()[:1] in "< " else data.draw(st.sampled_from(WORDS))
        text = text[: place.start()] + word + text[place.end() :]
    base = data.draw(st.sampled_from(["fixed", "floating"]))
    robot = accept_or_refuse(Robot.from_file, write_robot(tmp_path, 'torque_source = "command"', text, name, base))
    if robot is not None:
        assert robot.joint_names
        assert np.isfinite(robot.mass)
