"""One class knows where everything stands in the parameter vector."""

import ast
from pathlib import Path

import numpy as np

from stribeck.identification.whole_log.model import layout
from stribeck.identification.whole_log.model.layout import ModelLayout

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


def test_joints_rotors_gaits_and_bodies_have_their_places() -> None:
    places = np.arange(LAYOUT.size)
    np.testing.assert_array_equal(places[LAYOUT.joint(1)], range(6, 12))
    np.testing.assert_array_equal(LAYOUT.each_joint(4, np.array([0, 2])), [4, 16])
    assert LAYOUT.rotor(0) == places[LAYOUT.part("rotors")][0]
    np.testing.assert_array_equal(places[LAYOUT.gait(1)], places[LAYOUT.part("random_effects")][5:])
    masses, centres, moments = LAYOUT.body_groups()
    np.testing.assert_array_equal(masses, [18, 28])
    np.testing.assert_array_equal(np.sort(np.concatenate([masses, centres, moments])), places[LAYOUT.part("bodies")])


def test_what_is_left_out_leaves_no_gap() -> None:
    assert LAYOUT.without("gaits", "alternatives").size == LAYOUT.size - 18
    assert LAYOUT.beside(0, 0).part("bodies").start == 0


def test_no_other_file_computes_an_offset() -> None:
    counted = {"size", "gains", "zeros", "tilts", "delays", "wrenches", "rotors", "bodies", "gaits", "believed"}
    for path in Path(layout.__file__).parents[1].rglob("*.py"):
        if path.samefile(layout.__file__):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Slice):
                used = {each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)}
                assert not used & counted, f"{path.name}:{node.lower and node.lower.lineno}"
