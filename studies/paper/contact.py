"""Fig. 6.4 and 6.5: the contact simulator with friction only in the right knee, then in all leg joints.

Errors of a standing leg grow with its effective inertia. Their size depends on the error in the log, therefore the same
walk is also estimated with one sensor error at a time.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from stribeck import Settings
from stribeck.simulation.run import Simulated
from stribeck.simulation.sensors.profiles import REALISTIC
from studies.paper.estimate import UNTRIMMED, Estimate, estimate, rms
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS
from studies.paper.walks import get_walk, sensed

WALKS = ("right-knee-contact", "legs-contact")
SWINGS, STANDS = "left_foot", "right_foot"
"""Support while the right leg swings, and while it stands."""
SETTINGS = Settings(standing_legs=True)
SENSORS = {
    "tilt": ("orientation_bias", "orientation_noise"),
    "encoders": ("position_resolution", "position_noise", "position_bias"),
    "torque sensors": ("torque_noise", "torque_offset", "torque_drift"),
    "time stamps": ("jitter",),
}
"""Errors of realistic sensors, by case."""
SEEDS = (1, 2, 3, 4)
NEAR = ("0 to 0.02", "0.02 to 0.05", "0.05 to 0.10", "0.10 and more")
"""Bins of the time after lift-off or before touch-down [s]."""
EDGES = (0.0, 0.02, 0.05, 0.10, np.inf)


def run(quick: bool) -> Numbers:
    knee, legs = (get_walk(name, quick) for name in WALKS)
    log = knee.log
    late = replace(knee, log=replace(log, torque=np.concatenate([log.torque[:1], log.torque[:-1]])))
    cases = {"as simulated": [knee], "torque a sample late": [late]}
    for case, errors in SENSORS.items():
        profile = REALISTIC.only(*errors)
        cases[case] = [sensed(knee, profile, seed) for seed in (SEEDS[:1] if quick else SEEDS)]
    everywhere = estimate(legs, SETTINGS)
    return {
        "knee": {
            case: _mean([_errors(estimate(each, SETTINGS), "knee") for each in own]) for case, own in cases.items()
        },
        "legs": {joint: _errors(everywhere, joint) for joint in JOINTS},
        "events": _by_distance(legs),
    }


def _errors(found: Estimate, joint: str) -> dict[str, float]:
    """Compute RMS friction and error of a joint of the right leg during swing and stance [N m]."""
    column, swing, stance = found.column(f"right_{joint}"), found.standing_on(SWINGS), found.standing_on(STANDS)
    return {
        "friction": rms(found.truth[swing, column]),
        "swing": rms(found.error[swing, column]),
        "stance": rms(found.error[stance, column]),
    }


def _mean(rows: list[dict[str, float]]) -> dict[str, float]:
    """Compute the root mean square of each number over several runs."""
    return {key: rms(np.array([row[key] for row in rows])) for key in rows[0]}


def _by_distance(walk: Simulated) -> dict[str, dict[str, float]]:
    """Compute the RMS error of the swinging leg's joints by time after lift-off and before touch-down [N m]."""
    found = estimate(walk, SETTINGS.model_copy(update={"support": UNTRIMMED}))
    time, (after, before) = found.samples.time, np.full((2, len(found.error)), np.inf)
    swing = np.zeros(found.error.shape, dtype=bool)
    for side, foot in (("left", STANDS), ("right", SWINGS)):
        rows = found.standing_on(foot)
        here = np.flatnonzero(rows)
        stretch = np.cumsum(np.diff(rows.astype(int), prepend=0) > 0)[here] - 1
        first, last = (np.searchsorted(stretch, np.unique(stretch), way) for way in ("left", "right"))
        after[here], before[here] = time[here] - time[here[first]][stretch], time[here[last - 1]][stretch] - time[here]
        swing[:, [found.column(f"{side}_{joint}") for joint in JOINTS]] = rows[:, None]
    result = {}
    for event, distance, other in (("lift-off", after, before), ("touch-down", before, after)):
        bins = [(distance >= low) & (distance < high) for low, high in pairwise(EDGES)]
        bins[-1] &= other >= EDGES[-2]
        result[event] = {
            label: rms(np.where(swing, found.error, np.nan)[rows]) for label, rows in zip(NEAR, bins, strict=True)
        }
    return result


def texts(numbers: Numbers) -> dict[str, str]:
    """Format errors by case, by joint, and by the time from lift-off and touch-down."""
    knee, events = numbers["knee"], numbers["events"]
    quoted = {
        "late": knee["torque a sample late"]["stance"],
        "tilt": knee["tilt"]["stance"],
        "encoders": knee["encoders"]["stance"],
        "encoders-swing": knee["encoders"]["swing"],
        "clean": knee["as simulated"]["stance"],
        "knee-alone": knee["as simulated"]["swing"],
        "lift-off": events["lift-off"][NEAR[0]],
        "inside": events["lift-off"][NEAR[-1]],
        "trimmed-start": events["lift-off"][NEAR[2]],
        "trimmed-end": events["touch-down"][NEAR[1]],
    }
    return {name: f"{value:.2g} N m" for name, value in quoted.items()}
