"""Tuned constants of the estimator stand in one file a room, each with unit and reason."""

import ast
import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[3] / "src/stribeck"
ROOMS = (SOURCE / "equations", SOURCE / "identification/whole_log")
MODULES = [path for room in ROOMS for path in sorted(room.rglob("*.py")) if path.name != "constants.py"]
UNIT = re.compile(r"\[(1|s|K|rad|m|N|N m|rad/s|m/s\^2|rad/s\^2)\]")
DEFINITIONS = {
    "AWAY": "index of a bin",
    "BINS": "number of bins",
    "COLUMNS": "number of columns",
    "CUBIC": "weights of a cubic",
    "DECAY": "follows from the noise of a second derivative",
    "DIGITS": "of what a result tells",
    "FIXED": "numerical guard: as good as zero",
    "GAIN_COLUMN": "index of a column",
    "IGNORED": "numerical guard: as good as infinite",
    "LEAST_CORRELATION": "of what a result tells; no estimate has it",
    "LEAST_DAMPING": "numerical guard",
    "LEAST_INFORMATION": "numerical guard: as good as zero",
    "LEAST_MASS": "numerical guard: as good as zero",
    "LEAST_POWER": "numerical guard: halved or doubled, nothing moves",
    "LEAST_RADIUS": "numerical guard: as good as zero",
    "LINE": "weights of a line",
    "MAD_TO_STANDARD_DEVIATION": "of a normal distribution",
    "MEDIAN_OF_SIZE": "of a normal distribution",
    "MOST_DAMPING": "numerical guard",
    "NO_TORQUE": "numerical guard: as good as zero",
    "ORDER": "knots of a cubic polynomial",
    "RANK": "numerical guard: as good as zero",
    "REACH_OF_FACTOR": "until rows of a Cholesky factor no longer change",
    "SHRINK": "follows from bias and noise of a polynomial",
    "STEP": "step of a numerical derivative",
    "TURN": "step of a numerical derivative",
}
"""Constants that nobody tuned, and why they are as they are."""


def assigned(tree: ast.Module) -> dict[str, str | None]:
    """Return names of a module's constants that have a number in them, each with the docstring that follows."""
    found: dict[str, str | None] = {}
    for node, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        if not isinstance(node, ast.Assign) or not any(_is_number(part) for part in ast.walk(node.value)):
            continue
        text = after.value.value if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) else None
        for target in node.targets:
            found |= {part.id: str(text) if text else None for part in ast.walk(target) if isinstance(part, ast.Name)}
    return {name: text for name, text in found.items() if name.isupper() and not name.startswith("_")}


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in {int, float}


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room.name))
def test_every_tuned_constant_has_its_unit(room: Path) -> None:
    constants = assigned(ast.parse((room / "constants.py").read_text()))
    assert len(constants) > 20
    for name, text in constants.items():
        assert text is not None, name
        assert UNIT.search(text), name


def test_no_other_module_has_one() -> None:
    found = {name: path.name for path in MODULES for name in assigned(ast.parse(path.read_text()))}
    found.pop("KINDS")  # places of columns
    assert found.keys() == DEFINITIONS.keys()
