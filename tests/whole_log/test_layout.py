"""One class knows where everything stands in the parameter vector; every tuned constant has its unit."""

import ast
import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from stribeck.whole_log.model import layout
from stribeck.whole_log.model.layout import ModelLayout

LAYOUT = ModelLayout(
    joints=3,
    per_joint=6,
    bodies=2,
    gains=3,
    zeros=4,
    tilts=3,
    delays=2,
    wrenches=2,
    rotors=1,
    gaits=2,
    gait_effects=5,
    alternatives=8,
)
PARTS = (
    *("friction", "bodies", "gains", "zeros", "tilts", "delays"),
    *("wrenches", "rotors", "random_effects", "alternatives"),
)


def test_parts_follow_one_another_and_fill_the_vector() -> None:
    places = np.arange(LAYOUT.size)
    np.testing.assert_array_equal(np.concatenate([places[LAYOUT.part(name)] for name in PARTS]), places)
    sizes = [len(places[LAYOUT.part(name)]) for name in PARTS]
    assert sizes == [18, 20, 3, 4, 3, 2, 14, 1, 10, 8]
    assert len(places[LAYOUT.corrections]) == 47
    assert [len(places[part]) for part in (LAYOUT.nearly_right, LAYOUT.model)] == [32, 57]


def test_no_other_file_computes_an_offset() -> None:
    counted = {"size", "gains", "zeros", "tilts", "delays", "wrenches", "rotors", "bodies", "gaits", "believed"}
    for path in Path(layout.__file__).parents[1].rglob("*.py"):
        if path.samefile(layout.__file__):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Slice):
                used = {each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)}
                assert not used & counted, f"{path.name}:{node.lower and node.lower.lineno}"


def test_every_tuned_constant_has_its_unit() -> None:
    room = Path(layout.__file__).parents[1]
    for constants in (room / "constants.py", room / "equations" / "constants.py"):
        lines = ast.parse(constants.read_text(encoding="utf-8")).body
        for line, below in pairwise(lines):
            if isinstance(line, ast.Assign):
                assert re.search(r"\[[\w /^]+\]", ast.unparse(below)), ast.unparse(line)
