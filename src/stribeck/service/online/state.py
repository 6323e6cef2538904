"""State file of an online estimator, so that it continues after a restart."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from operator import attrgetter
from pathlib import Path
from typing import Protocol

import numpy as np
from pydantic import TypeAdapter

from stribeck.core.base.files import read_text
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.result import Result
from stribeck.service.online.alarms import Alarm


class Restorable(Protocol):
    """Estimator with a state, alarms and the result that it watches."""

    result: Result
    alarms: dict[str, Alarm]


KEPT = (
    *(f"filters.{name}" for name in ("state", "covariance", "noise", "lagged", "last", "count")),
    *(f"watchdog.{name}" for name in ("reference", "learned", "payload", "active", "large", "small", "normal_until")),
    *("time", "checked", "motion"),
)
"""Attributes of an estimator that are its state: arrays and numbers."""


def save_state(online: Restorable, path: Path) -> None:
    """Write a state file, completely or not at all."""
    document = {name: np.asarray(attrgetter(name)(online)).tolist() for name in KEPT}
    document |= {"result": _digest(online), "alarms": [asdict(alarm) for alarm in online.alarms.values()]}
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(json.dumps(document), encoding="utf-8")


def load_state(online: Restorable, path: Path) -> None:
    """Read a state file into an estimator.

    Raises
    ------
    SettingsError
        If the file is damaged or belongs to another result; the estimator is unchanged then.
    """
    text = read_text(path, "a state file of stribeck watch", SettingsError)
    try:
        document = json.loads(text)
        alarms = {alarm.name: alarm for alarm in TypeAdapter(list[Alarm]).validate_python(document["alarms"])}
        owner, values = document["result"], {}
        for name in KEPT:
            current = np.asarray(attrgetter(name)(online))
            values[name] = np.asarray(document[name], dtype=current.dtype).reshape(current.shape)
        if not _is_possible(values):
            raise ValueError("impossible numbers")
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise SettingsError(f"{path}: is damaged or no state file ({reason}); delete it to start anew") from error
    if owner != _digest(online):
        raise SettingsError(f"{path}: belongs to another result; delete it to start anew, or use another file")
    for name, value in values.items():
        part, _, last = name.rpartition(".")
        setattr(attrgetter(part)(online) if part else online, last, value if value.ndim else float(value))
    online.alarms = alarms


def _is_possible(values: Mapping[str, Array]) -> bool:
    """Check that numbers are moderate, or -inf where nothing was seen, and variances and covariances are positive."""
    if not all(np.all((np.abs(value) < 1e15) | (value == -np.inf)) for value in values.values()):
        return False
    covariance = values["filters.covariance"]
    return bool(values["filters.noise"].min() > 0 and np.linalg.eigvalsh(covariance).min() > 0)


def _digest(online: Restorable) -> str:
    """Compute a hash of the result."""
    return hashlib.sha256(online.result.to_json().encode()).hexdigest()
