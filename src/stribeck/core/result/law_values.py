"""Parameter values of a law, from the values of a fit or a result by name."""

from collections.abc import Mapping

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw, LawWithState
from stribeck.core.friction.law import Motion


def law_values(law: FrictionLaw, values: Mapping[str, float], load: float = 0.0) -> Array | None:
    """Collect the parameter values of a law under a load [N m], in its order, shape (p,); None if any are missing."""
    if not values or any(p.neutral is None and p.name not in values for p in law.parameters):
        return None
    loaded = at_load(values, load) if load and "load" in values else values
    return np.array([loaded.get(p.name, p.neutral) for p in law.parameters], dtype=float)


def law_slopes(law: FrictionLaw, values: Mapping[str, float], load: float = 0.0) -> Array:
    """Compute the derivatives of a law's values under a load [N m] with respect to the k parameters, shape (p, k)."""
    columns = []
    for name, value in values.items():
        step = 1e-4 * max(abs(value), 1e-4)  # the values are nearly linear in the parameters
        ends = [law_values(law, {**values, name: value + sign * step}, load) for sign in (1, -1)]
        columns.append((np.array(ends[0]) - np.array(ends[1])) / (2 * step))
    return np.column_stack(columns)


def at_load(values: Mapping[str, float], load: float) -> dict[str, float]:
    """Compute the parameters of a joint that carries a load [N m], with larger Coulomb friction Fc.

    The Stribeck effect Fc S is constant, so the gain S decreases.
    """
    coulomb = values["coulomb"] + values.get("load", 0.0) * load
    changed = {**values, "coulomb": coulomb}
    if coulomb > 0 and "stribeck_gain" in values:
        changed["stribeck_gain"] = values["stribeck_gain"] * values["coulomb"] / coulomb
    return changed


def along_motion(law: LawWithState, velocity: Array, values: Array, period: float) -> Array:
    """Compute the friction torque along motions that start with steady friction [N m], shape (T, n)."""
    begins = np.arange(len(velocity)) == 0
    motions = (Motion(velocity=speed, period=period, begins=begins) for speed in velocity.T)
    return np.column_stack([law.torque_along(motion, values) for motion in motions])


def velocity_grid(low: float, high: float, points: int = 31) -> Array:
    """Space about 3 `points` velocities between two limits, dense around zero, where friction changes quickly."""
    reach = max(abs(low), abs(high), 1e-300)  # avoids underflow
    near = np.geomspace(1e-3 * reach, 0.15 * reach, points // 2)
    grid = np.concatenate([np.linspace(low, high, 2 * points), -near, near, [0.0]])
    return np.unique(grid[(grid >= low) & (grid <= high)])
