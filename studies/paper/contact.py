"""Fig. 6.4 and 6.5: the contact simulator with friction only in the right knee, then in all leg joints.

Errors of a standing leg grow with its effective inertia. Their size depends on the error in the log, therefore the same
walk is also estimated with one sensor error at a time.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stribeck import Settings
from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck_simulation.run import Simulated
from stribeck_simulation.sensors.measure import measure, sensors_for
from stribeck_simulation.sensors.profiles import SensorProfile, get_profile
from studies.markdown import markdown_table, short
from studies.paper.estimate import UNTRIMMED, Estimate, estimate, rms
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS
from studies.paper.walks import get_walk

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
    found = {
        case: [estimate(replace(knee, log=log), SETTINGS) for log in logs]
        for case, logs in _cases(knee.log, quick).items()
    }
    clean = found["as simulated"][0]
    everywhere = estimate(legs, SETTINGS)
    return {
        "knee": {case: _mean([_errors(each, "knee") for each in several]) for case, several in found.items()},
        "other_joints_swing": max(_errors(clean, joint)["swing"] for joint in JOINTS if joint != "knee"),
        "legs": {joint: _errors(everywhere, joint) for joint in JOINTS},
        "events": _by_distance(legs),
    }


def _late(log: RobotLog) -> RobotLog:
    """Delay the torque of a log by one sample."""
    return replace(log, torque=np.concatenate([log.torque[:1], log.torque[:-1]]))


def _sensed(log: RobotLog, errors: tuple[str, ...], seed: int) -> RobotLog:
    """Add the named errors of realistic sensors to a log."""
    realistic = get_profile("realistic")
    profile = SensorProfile(**{error: getattr(realistic, error) for error in errors})
    return measure(log, sensors_for(log, profile, seed))


def _cases(log: RobotLog, quick: bool) -> dict[str, list[RobotLog]]:
    """Make logs with one error at a time; random errors are drawn with several seeds."""
    seeds = SEEDS[:1] if quick else SEEDS
    sensed = {case: [_sensed(log, errors, seed) for seed in seeds] for case, errors in SENSORS.items()}
    return {"as simulated": [log], "torque a sample late": [_late(log)], **sensed}


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
    after, before = np.full((2, len(found.error)), np.inf)
    swing = np.zeros(found.error.shape, dtype=bool)
    for side, foot in (("left", STANDS), ("right", SWINGS)):
        rows = found.standing_on(foot)
        after[rows], before[rows] = _distances(found.samples.time, rows)
        swing[:, [found.column(f"{side}_{joint}") for joint in JOINTS]] = rows[:, None]
    result = {}
    for event, distance in (("lift-off", after), ("touch-down", before)):
        other = before if event == "lift-off" else after
        bins = [(distance >= low) & (distance < high) for low, high in pairwise(EDGES)]
        bins[-1] &= other >= EDGES[-2]
        result[event] = {
            label: rms(np.where(swing, found.error, np.nan)[rows]) for label, rows in zip(NEAR, bins, strict=True)
        }
    return result


def _distances(time: Array, rows: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Compute, for each selected sample, the time since the start and until the end of its swing [s]."""
    stretch = np.cumsum(np.diff(rows.astype(int), prepend=0) > 0)[rows]
    here = time[rows]
    firsts = np.array([here[stretch == k][0] for k in np.unique(stretch)])
    lasts = np.array([here[stretch == k][-1] for k in np.unique(stretch)])
    return here - firsts[stretch - 1], lasts[stretch - 1] - here


def texts(numbers: Numbers) -> dict[str, str]:
    """Format errors by case, by joint, and by the time from lift-off and touch-down."""
    keys = ("friction", "swing", "stance")
    cases, joints = (
        [
            (name.replace("_", " "), *(f"{row[key]:.2g}" for key in keys), short(row["stance"] / row["swing"]))
            for name, row in numbers[part].items()
        ]
        for part in ("knee", "legs")
    )
    events = [(label, *(f"{numbers['events'][event][label]:.2g}" for event in numbers["events"])) for label in NEAR]
    knee = numbers["knee"]
    return {
        "late": f"{knee['torque a sample late']['stance']:.2g} N m",
        "tilt": f"{knee['tilt']['stance']:.2g} N m",
        "encoders": f"{knee['encoders']['stance']:.2g} N m",
        "encoders-swing": f"{knee['encoders']['swing']:.2g} N m",
        "clean": f"{knee['as simulated']['stance']:.2g} N m",
        "knee-alone": f"{knee['as simulated']['swing']:.2g} N m",
        "others": f"{numbers['other_joints_swing']:.2g} N m",
        "lift-off": f"{numbers['events']['lift-off'][NEAR[0]]:.2g} N m",
        "inside": f"{numbers['events']['lift-off'][NEAR[-1]]:.2g} N m",
        "trimmed-start": f"{numbers['events']['lift-off'][NEAR[2]]:.2g} N m",
        "trimmed-end": f"{numbers['events']['touch-down'][NEAR[1]]:.2g} N m",
        "knee": markdown_table(("log", "friction", "error, swings", "error, stands", "ratio"), cases),
        "legs": markdown_table(("joint", "friction", "error, swings", "error, stands", "ratio"), joints),
        "events": markdown_table(("time [s]", "after lift-off", "before touch-down"), events),
    }
