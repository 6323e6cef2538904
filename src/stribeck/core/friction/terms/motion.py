"""Friction of the terms along samples of a motion, as a result and its baseline in service evaluate it."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction.auto import JUMP
from stribeck.core.friction.presliding import SMOOTH_SIGN, lag_behind
from stribeck.core.friction.terms import LADDER, parameters_over
from stribeck.core.friction.terms.term import evaluate


def signals(
    velocity: Array,
    slope: Any = JUMP,
    position: Any = np.nan,
    ends: Any = (-np.inf, np.inf),
    mean: Any = (np.nan, np.nan),
    period: float | None = None,
    top_speed: float = np.nan,
    **others: Any,
) -> dict[str, Any]:
    """Collect the signals of `Term.columns` of samples; their shapes broadcast.

    Parameters
    ----------
    velocity, slope
        Velocity [rad/s], and slope of the friction's rise [s/rad].
    position, ends, mean
        Position [rad], NaN if unknown, its range in the log, and means of its cosine and sine.
    period, top_speed
        Sampling period [s] along the first axis, None for steady motion, and top speed of the log [rad/s].
    others
        Other signals, and settings of the terms.
    """
    return {
        "velocity": velocity,
        "rise": np.tanh(np.asarray(slope) * velocity),
        "temperature": 0.0,
        "elapsed": 0.0,
        "position": np.asarray(position),
        "near": np.clip(position, *ends),
        "mean_cosine": mean[0],
        "mean_sine": mean[1],
        "abs": np.abs,
        "cos": np.cos,
        "sin": np.sin,
        "tanh": np.tanh,
        "lag": partial(_lag, velocity, period, top_speed),
        **others,
    }


def _lag(velocity: Array, period: float | None, top_speed: float, travel: float) -> Array | float:
    """Compute the deficit of friction that builds up over a travel [rad]; zero for steady motion."""
    if period is None or np.isnan(top_speed):
        return 0.0
    flat = velocity.reshape(len(velocity), -1)
    travels = np.full((1, flat.shape[1]), travel)
    return np.asarray(lag_behind(flat, period, SMOOTH_SIGN * top_speed, travels)[0].reshape(velocity.shape))


def beyond_velocity(values: Mapping[str, Any], motion: Mapping[str, Any]) -> Array:
    """Compute the friction of the terms beyond velocity [N m] from values and signals by name."""
    friction = np.zeros(motion["velocity"].shape)
    for term in LADDER:
        if values.keys().isdisjoint(term.names) or any(motion.get(name) is None for name in term.settings):
            continue
        for name, column in zip(term.names, term.columns, strict=False):
            torque = values.get(name, 0.0) * evaluate(column, motion)
            friction = friction + (np.nan_to_num(torque) if term.over == "position" else torque)
    return friction


def drift(values: Mapping[str, float], velocity: Array) -> Array:
    """Compute the change of friction from the start of a log to its end [N m]."""
    drifts = {name: values[name] for name in parameters_over("time") if name in values}
    return beyond_velocity(drifts, signals(velocity, values.get("slope", JUMP), elapsed=1.0))
