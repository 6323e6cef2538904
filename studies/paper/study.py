"""What a study gives, and which studies there are."""

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[2]
NUMBERS = Path(__file__).parent / "numbers"
"""Where the numbers of each study are kept, `<study>.json`."""
DIGITS = 4
"""Significant digits that are kept: enough to quote, few enough to be the same on other machines."""

Numbers = Mapping[str, Any]
"""As in a JSON file: numbers, texts, lists and mappings of them."""


@dataclass(frozen=True, eq=False)
class Study:
    """What a study gives.

    Attributes
    ----------
    numbers
        Goes to `numbers/<study>.json`; NumPy's numbers and arrays are fine.
    figures
        Name of the file -> what draws it, on a figure of the house's width, in every theme again. Colours are "C0" to
        "C5" and `figures.ink()`.
    """

    numbers: Numbers
    figures: Mapping[str, Callable[[Figure], None]]


def find_studies() -> dict[str, ModuleType]:
    """Return the modules of this package that have a `run`, by name."""
    names = [module.name for module in pkgutil.iter_modules([str(Path(__file__).parent)])]
    modules = {name: importlib.import_module(f"studies.paper.{name}") for name in names if name != "__main__"}
    return {name: module for name, module in modules.items() if hasattr(module, "run")}


def plain(value: Any) -> Any:
    """Return numbers as JSON has them, rounded to `DIGITS` significant digits."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{DIGITS}g}")
    return value.item() if isinstance(value, np.generic) else value
