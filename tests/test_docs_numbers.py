"""Numbers of the prose that stand in the code are the code's.

Such a number has its place in the code behind it, in a comment that no reader sees:
`0.33<!-- stribeck.methods.whole_log.CRITERIA.widest -->`, times a factor where the page has another unit:
`5<!-- stribeck.log.clock.SHARE * 100 --> %`. A place is a constant, the default of a setting, or an item of either.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
WORDS = {
    "tenth": 0.1,
    "twentieth": 0.05,
    "two": 2,
    "twice": 2,
    "three": 3,
    "four": 4,
    "sixth": 6,
    "eight": 8,
    "hundred": 100,
}
MARK = re.compile(r"([\w.,+-]+)<!-- ([\w.]+)(?:\[([\w-]+)\])?(?: \* ([\w.-]+))? -->")
MARKED = [
    pytest.param(*found.groups(), id=f"{path.relative_to(ROOT)} {found[1]} {found[2].rpartition('.')[2]}")
    for path in PAGES
    for found in MARK.finditer(path.read_text(encoding="utf-8"))
]


def resolve(place: str) -> Any:
    """Return what a dotted name stands for: a module's constant, or a default of its class of settings."""
    module, _, name = place.rpartition(".")
    if name in getattr(owner := _imported(module), "model_fields", {}):
        assert issubclass(owner, BaseModel)
        return owner.model_fields[name].default
    return getattr(owner, name)


def _imported(place: str) -> Any:
    try:
        return import_module(place)
    except ModuleNotFoundError:
        module, _, name = place.rpartition(".")
        return getattr(import_module(module), name)


@pytest.mark.parametrize(("shown", "place", "item", "factor"), MARKED)
def test_a_number_is_the_codes(shown: str, place: str, item: str | None, factor: str | None) -> None:
    value = resolve(place)
    if item is not None:
        value = value[int(item) if item.isdigit() else item]
    said = WORDS[shown.lower()] if shown.lower() in WORDS else float(shown.replace(",", ""))
    assert said == pytest.approx(float(factor or 1) * value, rel=1e-9)


def test_numbers_are_marked_and_every_mark_is_read() -> None:
    assert len(MARKED) > 50
    assert sum(path.read_text(encoding="utf-8").count("<!-- stribeck.") for path in PAGES) == len(MARKED)
