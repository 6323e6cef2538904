"""Where a study's numbers are, and which studies there are."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
NUMBERS = Path(__file__).parent / "numbers"
"""Folder of the numbers of each study, `<study>.json`."""
DIGITS = 4
"""Significant digits that are kept: enough to quote, few enough to be the same on other machines."""

Numbers = Mapping[str, Any]
"""As in a JSON file: numbers, texts, lists and mappings of them."""


def find_studies() -> dict[str, ModuleType]:
    """Import the modules of this package that have a `run`, by name."""
    names = sorted(path.stem for path in NUMBERS.glob("*.json"))
    return {name: importlib.import_module(f"studies.paper.{name}") for name in names}


def plain(value: Any) -> Any:
    """Convert numbers to those of JSON, rounded to `DIGITS` significant digits."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{DIGITS}g}")
    return value.item() if isinstance(value, np.generic) else value
