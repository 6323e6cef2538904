"""Files with the studies' numbers, and the list of studies."""

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
"""Significant digits that are stored: enough to quote, few enough to be equal on other machines."""

Numbers = Mapping[str, Any]
"""Content of a JSON file: numbers, texts, lists and mappings."""


def find_studies() -> dict[str, ModuleType]:
    """Import all modules of this package with a function `run`, by name."""
    names = sorted(path.stem for path in NUMBERS.glob("*.json"))
    return {name: importlib.import_module(f"studies.paper.{name}") for name in names}


def plain(value: Any) -> Any:
    """Convert numbers to JSON types, rounded to `DIGITS` significant digits."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{DIGITS}g}")
    return value.item() if isinstance(value, np.generic) else value
