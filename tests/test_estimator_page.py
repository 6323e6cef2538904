"""The pages on the estimator's mathematics name existing modules, and number their equations in order."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = "".join((ROOT / "docs" / name).read_text() for name in ("estimator.md", "estimator-fit.md"))


def test_modules_are_there() -> None:
    named = re.findall(r"`([\w/]+\.py)`", PAGE)
    assert len(named) > 20
    for name in named:
        assert (ROOT / "src/stribeck" / name).is_file(), name


def test_equations_are_numbered_in_order() -> None:
    numbers = [int(number) for number in re.findall(r"\\text\{\((\d+)\)\}", PAGE)]
    assert numbers == list(range(1, len(numbers) + 1))
