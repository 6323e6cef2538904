"""Fig. 7.7 and 7.8: the paper's experiment, whose data are not public, repeated on a simulated walk with bad sensors.

Friction of forty steps with sensors of the profile `harsh` is estimated with the exact model, and with models in which
every body has errors.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.core.judgement.passivity import positive_power_fraction
from stribeck.core.settings import FilterSettings, SupportSettings
from stribeck.paper.figures.inertias import split, with_bodies
from studies.markdown import percent
from studies.paper.estimate import Estimate, estimate
from studies.paper.inexact import drawn
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, swinging
from studies.paper.walks import get_walk

WALKS = ("harsh", "legs-contact")
SEEDS = (1, 2, 3, 4)
"""Seeds of models with errors in every body."""
SETTINGS = Settings(
    filter=FilterSettings(kind="savitzky-golay", window=151),  # the paper's
    averaged_law=True,  # the torque goes through it, too
    support=SupportSettings(trim_start=0.1, trim_end=0.1),
)


def run(quick: bool) -> Numbers:
    found: dict[str, Numbers] = {}
    for name in WALKS:
        walk = get_walk(name, quick)
        wrong = [replace(walk, robot=with_bodies(walk.robot, drawn(k))) for k in (SEEDS[2:3] if quick else SEEDS)]
        models = {"exact": [estimate(walk, SETTINGS)], "drawn": [estimate(each, SETTINGS) for each in wrong]}
        found[name] = {
            model: {joint: _measures(several, joint) for joint in JOINTS} for model, several in models.items()
        }
    return found


def _measures(found: Sequence[Estimate], joint: str) -> dict[str, float]:
    """Compute the mean share with positive power [1] and the mean split of the error [N m] over several models."""
    curves = [swinging(each, joint) for each in found]
    return {
        "feeding": float(np.mean([positive_power_fraction(each.velocity, each.torque) for each in curves])),
        "split": float(np.mean([split(each.velocity, each.acceleration, each.torque - each.truth) for each in curves])),
    }


def texts(numbers: Numbers) -> dict[str, str]:
    """Format shares and splits by log, model and joint."""
    exact, wrong = (numbers["harsh"][model]["knee"] for model in ("exact", "drawn"))
    return {
        "knee-exact": percent(exact["feeding"]),
        "knee-wrong": percent(wrong["feeding"]),
        "split-exact": f"{exact['split']:.2f} N m",
        "split-wrong": f"{wrong['split']:.2f} N m",
    }
