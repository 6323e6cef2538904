"""Fig. 7.3 and 7.4: acceleration difference versus velocity, and friction with positive power.

All leg joints have friction. Its offset dissipates nothing and is removed from the log, as by a calibration. To keep
impacts out of the paper's window of 151 samples, 0.1 s are excluded at both ends of a swing.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.core.judgement.passivity import positive_power_fraction
from stribeck.core.settings import FilterSettings, SupportSettings
from stribeck.paper.figures.inertias import scaled, with_bodies
from stribeck.simulation.run import Simulated
from studies.markdown import percent
from studies.paper.estimate import Differences, estimate
from studies.paper.inexact import drawn
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, model_acceleration, swinging
from studies.paper.walks import get_walk

WALKS = ("legs-contact",)
TRIMMED = SupportSettings(trim_start=0.1, trim_end=0.1)
AS_PAPER = Settings(filter=FilterSettings(kind="savitzky-golay", window=151), support=TRIMMED, filter_torque=False)
"""Settings of the paper: a filtered acceleration and an unfiltered torque."""
FILTERS = {
    "unfiltered": Settings(filter=Differences(scheme="central"), support=TRIMMED, filter_torque=False),
    "window 151": AS_PAPER,
    "window 151, torque too": AS_PAPER.model_copy(update={"averaged_law": True}),
}
SEEDS = range(1, 9)
"""Seeds of models with errors in every body."""


def run(quick: bool) -> Numbers:
    walk = _calibrated(get_walk("legs-contact", quick))
    robots = {
        "exact": [walk.robot],
        "+10 %": [with_bodies(walk.robot, scaled(1.1, 1.1))],
        "-10 %": [with_bodies(walk.robot, scaled(0.9, 0.9))],
        "drawn": [with_bodies(walk.robot, drawn(seed)) for seed in (SEEDS[:1] if quick else SEEDS)],
    }
    return {
        "torque": {
            model: {name: _torque([replace(walk, robot=robot) for robot in each], own) for name, own in FILTERS.items()}
            for model, each in robots.items()
        },
        "difference": {name: _difference(walk, each) for name, each in FILTERS.items()},
    }


def _calibrated(walk: Simulated) -> Simulated:
    """Subtract the friction's offset, which dissipates nothing, from a walk's torque."""
    offset = np.array([walk.truth.parameters.get(name, {}).get("offset", 0.0) for name in walk.log.joint_names])
    return replace(walk, log=replace(walk.log, torque=walk.log.torque - offset))


def _torque(walks: list[Simulated], settings: Settings) -> dict[str, float]:
    """Compute the share of samples in which the estimated friction torque has positive power, per joint."""
    found = [estimate(walk, settings) for walk in walks]
    curves = {joint: [swinging(each, joint) for each in found] for joint in JOINTS}
    return {
        joint: float(np.mean([positive_power_fraction(each.velocity, each.torque) for each in own]))
        for joint, own in curves.items()
    }


def _difference(walk: Simulated, settings: Settings) -> dict[str, float]:
    """Compute the share of samples in which acceleration difference and velocity have the same sign, per joint."""
    found = estimate(walk, settings)
    curves, model = [swinging(found, joint) for joint in JOINTS], model_acceleration(walk, found)
    shares = [positive_power_fraction(each.velocity, model[:, k] - each.acceleration) for k, each in enumerate(curves)]
    return dict(zip(JOINTS, shares, strict=True))


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the shares of samples with positive power, per joint, by model and filter."""
    torque, difference = numbers["torque"], numbers["difference"]
    return {
        "sign-hip-roll": percent(difference["unfiltered"]["hip_roll"], 1),
        "exact-raw": percent(max(torque["exact"]["unfiltered"].values()), 1),
        "heavier-hip-pitch": percent(torque["+10 %"]["unfiltered"]["hip_pitch"], 1),
        "heavier-knee": percent(torque["+10 %"]["unfiltered"]["knee"], 1),
        "filter-most": percent(max(torque["exact"]["window 151"].values()), 1),
        "both-most": percent(max(torque["exact"]["window 151, torque too"].values()), 1),
    }
