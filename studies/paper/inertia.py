"""Fig. 7.5 and 7.6: effect of wrong inertias and of displaced masses on the friction curves.

The exact log is estimated with a wrong model. Friction torque is linear in masses, moments and displaced masses: twice
the error of the model causes twice the error of the friction, and errors add up.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.core.settings import FilterSettings
from stribeck.paper.figures.inertias import Change, scaled, split, with_bodies
from studies.markdown import percent
from studies.paper.estimate import Estimate, estimate, rms
from studies.paper.inexact import displaced
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, swinging
from studies.paper.walks import get_walk

WALKS = ("legs-contact",)
SETTINGS = Settings(filter=FilterSettings(kind="savitzky-golay", window=11))
"""Settings for a log without noise."""
CHANGES: dict[str, Change] = {
    "inertias": scaled(1.1, 1.1),
    "masses": scaled(mass=1.1),
    "moments": scaled(moments=1.1),
    "forward": displaced(np.array([0.01, 0.0, 0.0])),
    "left": displaced(np.array([0.0, 0.01, 0.0])),
    "up": displaced(np.array([0.0, 0.0, 0.01])),
}
"""Changes of the bodies, by key of the numbers: inertias by 10 %, and displacements of the centers of mass by 10 mm."""


def run(quick: bool) -> Numbers:
    walk = get_walk("legs-contact", quick)
    right = estimate(walk, SETTINGS)
    wrong = {
        name: estimate(replace(walk, robot=with_bodies(walk.robot, change)), SETTINGS)
        for name, change in CHANGES.items()
    }
    return {"joints": {joint: {name: _change(right, each, joint) for name, each in wrong.items()} for joint in JOINTS}}


def _change(right: Estimate, wrong: Estimate, joint: str) -> dict[str, float]:
    """Compute the error of a joint's curve from a wrong model [N m], and the share that an offset explains [1]."""
    curve = swinging(right, joint)
    error = swinging(wrong, joint).torque - curve.torque
    shift = float(error.mean())
    return {
        "shift": shift,
        "split": split(curve.velocity, curve.acceleration, error),
        "rms": rms(error),
        "offset_share": shift**2 / rms(error) ** 2,
    }


def texts(numbers: Numbers) -> dict[str, str]:
    """Format shift and split by joint and change, and the numbers that sentences quote."""
    joints = numbers["joints"]
    knee, hip = joints["knee"], joints["hip_pitch"]
    return {
        "knee-shift": f"{knee['inertias']['shift']:+.2f} N m",
        "hip-pitch-shift": f"{hip['inertias']['shift']:+.2f} N m",
        "hip-pitch-split": f"{hip['inertias']['split']:.2f} N m",
        "masses-knee": percent(knee["masses"]["rms"] / knee["inertias"]["rms"]),
        "moments-shift": f"{abs(knee['moments']['shift']):.4f} N m",
        "moments-split": f"{knee['moments']['split']:.3f} N m",
        "masses-split": f"{knee['masses']['split']:.2f} N m",
        "moments-most": percent(max(row["moments"]["rms"] / row["inertias"]["rms"] for row in joints.values())),
        "share-knee": percent(knee["inertias"]["offset_share"]),
        "share-hip-pitch": percent(hip["inertias"]["offset_share"]),
        "share-forward": percent(knee["forward"]["offset_share"]),
        "ankle-roll-inertias": f"{joints['ankle_roll']['inertias']['rms']:.4f} N m",
        "ankle-roll-left": f"{joints['ankle_roll']['left']['rms']:.2f} N m",
    }
