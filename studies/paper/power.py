"""Fig. 7.4: acceleration difference versus velocity, and friction with positive power.

All leg joints have friction. Its offset dissipates nothing and is removed from the log, as by a calibration. To keep
impacts out of the paper's window of 151 samples, 0.1 s are excluded at both ends of a swing.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.settings import FilterSettings
from stribeck_simulation.run import Simulated
from stribeck_simulation.sensors.measure import measure, sensors_for
from stribeck_simulation.sensors.profiles import get_profile
from studies.markdown import markdown_table
from studies.paper.acceleration import AS_PAPER, UNFILTERED, Motion, calibrated, motions
from studies.paper.estimate import estimate
from studies.paper.inexact import drawn, scaled, with_bodies
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, feeding, swinging
from studies.paper.walks import get_walk

WALKS = ("legs-contact",)
SHORT = UNFILTERED.model_copy(update={"filter": FilterSettings(kind="savitzky-golay", window=31)})
FILTERS = {
    "unfiltered": UNFILTERED,
    "window 31": SHORT,
    "window 151": AS_PAPER,
    "window 151, torque too": AS_PAPER.model_copy(update={"averaged_law": True}),
}
MODELS = {"exact": "exact", "+10 %": "inertias +10 %", "-10 %": "inertias -10 %", "drawn": "drawn"}
"""Labels in the table, by key of the numbers."""
SEEDS = range(1, 9)
"""Seeds of models with errors in every body."""


def run(quick: bool) -> Numbers:
    walk = calibrated(get_walk("legs-contact", quick))
    noisy = replace(walk, log=measure(walk.log, sensors_for(walk.log, get_profile("calibrated"), 1)))
    heavier, lighter = (replace(walk, robot=with_bodies(walk.robot, scaled(f, f))) for f in (1.1, 0.9))
    seeds = SEEDS[:1] if quick else SEEDS
    wrong = [replace(walk, robot=with_bodies(walk.robot, drawn(seed))) for seed in seeds]
    models = {"exact": [walk], "+10 %": [heavier], "-10 %": [lighter], "drawn": wrong, "exact, noise": [noisy]}
    moved = {name: motions(walk, settings) for name, settings in FILTERS.items()}
    return {
        "torque": {
            model: {name: _mean([_torque(each, settings) for each in several]) for name, settings in FILTERS.items()}
            for model, several in models.items()
        },
        "difference": {name: _difference(each) for name, each in moved.items()},
    }


def _torque(walk: Simulated, settings: Settings) -> dict[str, float]:
    """Compute the share of samples in which the estimated friction torque has positive power, per joint."""
    found = estimate(walk, settings)
    joints = {joint: swinging(found, joint) for joint in JOINTS}
    return {joint: feeding(each.velocity, each.torque) for joint, each in joints.items()}


def _difference(joints: dict[str, Motion]) -> dict[str, float]:
    """Compute the share of samples in which acceleration difference and velocity have the same sign, per joint."""
    return {joint: feeding(each.velocity, each.model - each.measured) for joint, each in joints.items()}


def _mean(rows: list[dict[str, float]]) -> dict[str, float]:
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the shares of samples with positive power, per joint, by model and filter."""
    torque, difference = numbers["torque"], numbers["difference"]
    shown = [(m, f) for m in MODELS for f in FILTERS if f != "window 31"]
    rows = [
        (
            f"{MODELS[m]}, {f}",
            *(_percent(torque[m][f][joint]) for joint in JOINTS),
            _percent(_over_joints(torque[m][f])),
        )
        for m, f in shown
    ]
    noisy = [(name, *(_percent(torque["exact, noise"][name][joint]) for joint in JOINTS)) for name in FILTERS]
    signs = [(name, *(_percent(difference[name][joint]) for joint in JOINTS)) for name in FILTERS]
    joints = [joint.replace("_", " ") for joint in JOINTS]
    return {
        "table": markdown_table(("model and filter", *joints, "mean"), rows),
        "noise": markdown_table(("filter", *joints), noisy),
        "signs": markdown_table(("filter", *joints), signs),
        "sign-hip-roll": _percent(difference["unfiltered"]["hip_roll"]),
        "exact-raw": _percent(max(torque["exact"]["unfiltered"].values())),
        "heavier-hip-pitch": _percent(torque["+10 %"]["unfiltered"]["hip_pitch"]),
        "heavier-knee": _percent(torque["+10 %"]["unfiltered"]["knee"]),
        "filter-most": _percent(max(torque["exact"]["window 151"].values())),
        "both-most": _percent(max(torque["exact"]["window 151, torque too"].values())),
    }


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _over_joints(row: dict[str, float]) -> float:
    return sum(row.values()) / len(row)
