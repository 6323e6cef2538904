"""State file of an online estimator, so that it continues after a restart."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from stribeck.core.base.files import read_text
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.errors import SettingsError
from stribeck.service.online.alarms import Alarm

KEPT = (
    *(f"filters.{name}" for name in ("state", "covariance", "noise", "lagged", "last", "count")),
    *(f"watchdog.{name}" for name in ("reference", "learned", "recent", "observed", "payload")),
    *(f"watchdog.{name}" for name in ("active", "large", "small", "normal_until")),
    *("time", "motion"),
)
"""Attributes of an estimator that are its state: arrays and numbers."""


def save_state(online: Any, path: Path) -> None:
    """Write the state of an `OnlineFriction`, completely or not at all."""
    document = {name: np.asarray(attrgetter(name)(online)).tolist() for name in KEPT}
    document |= {"result": _hash(online.result.to_json()), "alarms": list(map(asdict, online.alarms.values()))}
    body = json.dumps(document)[:-1]
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(f'{body}, "checksum": "{_hash(body)}"}}', encoding="utf-8")


def load_state(online: Any, path: Path) -> None:
    """Read a state file into an `OnlineFriction`.

    Raises
    ------
    SettingsError
        If the file is damaged or belongs to another result; the estimator is unchanged then.
    """
    text = read_text(path, "a state file of stribeck watch", SettingsError)
    try:
        body, _, checksum = text.rpartition(', "checksum": ')
        if checksum != f'"{_hash(body)}"}}':
            raise ValueError("its checksum differs")
        document = json.loads(text)
        alarms = {alarm.key: alarm for alarm in (Alarm(**fields) for fields in document["alarms"])}
        owner, values = document["result"], {}
        for name in KEPT:
            current = np.asarray(attrgetter(name)(online))
            values[name] = np.asarray(document[name], dtype=current.dtype).reshape(current.shape)
        finite = all(np.isfinite(value).all() for name, value in values.items() if name != "time")
        if not finite or np.linalg.eigvalsh(values["filters.covariance"]).min() <= 0:
            raise ValueError("a value is not finite, or a covariance is not positive")
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise SettingsError(f"{path}: is damaged or no state file ({reason}); delete it to start anew") from error
    if owner != _hash(online.result.to_json()):
        raise SettingsError(f"{path}: belongs to another result; delete it to start anew, or use another file")
    for name, value in values.items():
        part, _, last = name.rpartition(".")
        setattr(attrgetter(part)(online) if part else online, last, value if value.ndim else float(value))
    online.alarms = alarms


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
