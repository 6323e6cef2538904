"""Provenance of a result: hashes of the logs, versions and settings."""

import platform
from collections.abc import Collection, Sequence
from importlib.metadata import version

from stribeck.core.base.checked_table import flat
from stribeck.core.base.files import sha256
from stribeck.core.base.version import __version__
from stribeck.core.log import RobotLog
from stribeck.core.result import LogSummary
from stribeck.core.settings import Settings


def log_summary(logs: Sequence[RobotLog], rate: float, samples_used: int) -> LogSummary:
    """Summarize one log, or several with lists of paths and hashes."""
    paths, hashes = [log.path for log in logs], [sha256(log.path) for log in logs]
    single = len(paths) == 1
    return LogSummary(
        path=paths[0] if single else paths,
        sha256=hashes[0] if single else hashes,
        duration=float(sum(log.time[-1] - log.time[0] for log in logs)),
        rate=float(rate),
        samples_used=samples_used,
        samples=sum(len(log.time) for log in logs),
    )


def provenance(
    settings: Settings, uses: Collection[str], robot_file: str, choices: Sequence[tuple[str, str]]
) -> list[tuple[str, str]]:
    """List label and text of all information needed to reproduce a result, with the settings used."""
    used = {key: value for key, value in flat(settings).items() if key in uses and not key.startswith("filter.")}
    libraries = ", ".join(f"{name} {version(name)}" for name in ("pin", "numpy", "scipy", "pyarrow"))
    return [
        ("stribeck", __version__),
        ("Python", platform.python_version()),
        ("Libraries", libraries),
        ("Robot file", robot_file),
        *([("Robot file SHA-256", sha256(robot_file))] if sha256(robot_file) else []),
        *choices,
        *((f"Setting {key}", str(value)) for key, value in used.items()),
    ]
