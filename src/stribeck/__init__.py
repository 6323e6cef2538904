"""Whole-body joint friction of legged robots and arms, from the logs they already record.

Public names are imported when they are first asked for, so that `import stribeck` costs next to nothing.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stribeck.export import export as export
    from stribeck.pipeline import identify as identify
    from stribeck.readers import read_log as read_log
    from stribeck.report import write_report as write_report
    from stribeck.robot import Robot as Robot
    from stribeck.settings import Settings as Settings
    from stribeck.version import __version__ as __version__

PUBLIC = {
    "Robot": "stribeck.robot",
    "Settings": "stribeck.settings",
    "__version__": "stribeck.version",
    "export": "stribeck.export",
    "identify": "stribeck.pipeline",
    "read_log": "stribeck.readers",
    "write_report": "stribeck.report",
}
"""Public name -> the module that it is in."""
__all__ = list(PUBLIC)


class _Package(ModuleType):
    """Keeps a submodule from hiding the public function of its name, such as `stribeck.export`."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in PUBLIC and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> object:
    if name not in PUBLIC:
        raise AttributeError(f"module 'stribeck' has no attribute '{name}'")
    globals()[name] = found = getattr(import_module(PUBLIC[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *PUBLIC})
