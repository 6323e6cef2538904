"""Whole-body joint friction of legged robots and arms, from the logs they already record.

Public names are imported at first use to keep `import stribeck` fast.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stribeck.base.version import __version__ as __version__
    from stribeck.errors import LogError as LogError
    from stribeck.errors import NothingIdentifiedError as NothingIdentifiedError
    from stribeck.errors import RobotFileError as RobotFileError
    from stribeck.errors import SettingsError as SettingsError
    from stribeck.errors import StribeckError as StribeckError
    from stribeck.exporters import export as export
    from stribeck.friction import FrictionLaw as FrictionLaw
    from stribeck.friction.register import register_law as register_law
    from stribeck.friction_torque.observer import MomentumObserver as MomentumObserver
    from stribeck.inspection import inspect_log as inspect_log
    from stribeck.log import RobotLog as RobotLog
    from stribeck.log.readers import read_log as read_log
    from stribeck.log.writers import write_log as write_log
    from stribeck.online import OnlineFriction as OnlineFriction
    from stribeck.pipeline import identify as identify
    from stribeck.plan.plan import plan as plan
    from stribeck.report import write_report as write_report
    from stribeck.result import Result as Result
    from stribeck.result import read_result as read_result
    from stribeck.result.compare import compare as compare
    from stribeck.robot import Robot as Robot
    from stribeck.settings import Settings as Settings

_EXPORTS = {
    "FrictionLaw": "stribeck.friction",
    "LogError": "stribeck.errors",
    "MomentumObserver": "stribeck.friction_torque.observer",
    "NothingIdentifiedError": "stribeck.errors",
    "OnlineFriction": "stribeck.online",
    "Result": "stribeck.result",
    "Robot": "stribeck.robot",
    "RobotFileError": "stribeck.errors",
    "RobotLog": "stribeck.log",
    "Settings": "stribeck.settings",
    "SettingsError": "stribeck.errors",
    "StribeckError": "stribeck.errors",
    "__version__": "stribeck.base.version",
    "compare": "stribeck.result.compare",
    "export": "stribeck.exporters",
    "identify": "stribeck.pipeline",
    "inspect_log": "stribeck.inspection",
    "plan": "stribeck.plan.plan",
    "read_log": "stribeck.log.readers",
    "read_result": "stribeck.result",
    "register_law": "stribeck.friction.register",
    "write_log": "stribeck.log.writers",
    "write_report": "stribeck.report",
}
"""Public name -> the module that defines it."""

__all__ = [*_EXPORTS]


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_EXPORTS[name]), name)
    return found


def __dir__() -> list[str]:
    return [*__all__]


class _Package(ModuleType):
    """Keeps `stribeck.exporters` a function: importing the submodule of the same name would replace it."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _EXPORTS and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
