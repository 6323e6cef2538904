"""Fig. 7.5 and 7.6: effect of wrong inertias and of displaced masses on the friction curves.

The exact log is estimated with a wrong model. Friction torque is linear in masses, moments and displaced masses: twice
the error of the model causes twice the error of the friction, and errors add up.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.friction import get_law
from stribeck.judgement.curve_fit.fit import fit_joint
from stribeck.judgement.curve_fit.problem import joint_problem
from stribeck.settings import FilterSettings
from stribeck_simulation.run import Simulated
from studies.markdown import markdown_table
from studies.paper.estimate import Estimate, estimate, rms
from studies.paper.inexact import Change, displaced, scaled, with_bodies
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, SIDE, split, swinging
from studies.paper.walks import get_walk

WALKS = ("legs-contact",)
SETTINGS = Settings(filter=FilterSettings(kind="savitzky-golay", window=11))
"""Settings for a log without noise."""
SHARE = 0.1
"""Relative error of the inertias [1]."""
OFFSET = 0.01
"""Displacement of the centers of mass [m]."""
CHANGES: dict[str, Change] = {
    "inertias": scaled(1 + SHARE, 1 + SHARE),
    "masses": scaled(mass=1 + SHARE),
    "moments": scaled(moments=1 + SHARE),
    "forward": displaced(np.array([OFFSET, 0.0, 0.0])),
    "left": displaced(np.array([0.0, OFFSET, 0.0])),
    "up": displaced(np.array([0.0, 0.0, OFFSET])),
}
LABELS = {
    "inertias": "inertias +10 %",
    "masses": "masses +10 %",
    "moments": "moments +10 %",
    "forward": "CoM 10 mm forward",
    "left": "CoM 10 mm left",
    "up": "CoM 10 mm up",
}
PARAMETERS = ("coulomb", "viscous", "offset")


def run(quick: bool) -> Numbers:
    walk = get_walk("legs-contact", quick)
    right = estimate(walk, SETTINGS)
    wrong = {name: _estimate(walk, change) for name, change in CHANGES.items()}
    fits = {name: _fit(each) for name, each in {"right": right, "inertias": wrong["inertias"]}.items()}
    return {
        "joints": {joint: {name: _change(right, each, joint) for name, each in wrong.items()} for joint in JOINTS},
        "fits": {joint: {name: each[joint] for name, each in fits.items()} for joint in JOINTS},
    }


def _estimate(walk: Simulated, change: Change) -> Estimate:
    return estimate(replace(walk, robot=with_bodies(walk.robot, change)), SETTINGS)


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


def _fit(found: Estimate) -> dict[str, dict[str, float]]:
    """Fit the parameters of the right leg's joints."""
    law, result = get_law("stribeck"), {}
    for joint in JOINTS:
        fit = fit_joint(joint_problem(found.samples, f"{SIDE}_{joint}", law, SETTINGS))
        values = dict(zip(fit.names, map(float, fit.values), strict=True))
        result[joint] = {name: values[name] for name in PARAMETERS}
    return result


def texts(numbers: Numbers) -> dict[str, str]:
    """Format shift and split by joint and change, the fits, and the numbers that sentences quote."""
    joints, fits = numbers["joints"], numbers["fits"]
    head = ("joint", *LABELS.values())
    tables = {
        key: markdown_table(
            head,
            [
                (joint.replace("_", " "), *(f"{round(row[name][key], 3) + 0.0:.3f}" for name in LABELS))
                for joint, row in joints.items()
            ],
        )
        for key in ("shift", "split")
    }
    shares = [
        (joint.replace("_", " "), *(f"{100 * row[name]['offset_share']:.0f} %" for name in LABELS))
        for joint, row in joints.items()
    ]
    fitted = [
        (joint.replace("_", " "), *(f"{row[name][p]:.2f}" for p in PARAMETERS for name in ("right", "inertias")))
        for joint, row in fits.items()
    ]
    names = {"coulomb": "Fc [N m]", "viscous": "Fv [N m s/rad]", "offset": "offset [N m]"}
    knee = joints["knee"]
    return {
        **tables,
        "shares": markdown_table(head, shares),
        "fits": markdown_table(
            ("joint", *(f"{names[p]}, {m}" for p in PARAMETERS for m in ("exact", "+10 %"))), fitted
        ),
        "knee-shift": f"{knee['inertias']['shift']:+.2f} N m",
        "hip-pitch-shift": f"{joints['hip_pitch']['inertias']['shift']:+.2f} N m",
        "hip-pitch-split": f"{joints['hip_pitch']['inertias']['split']:.2f} N m",
        "masses-knee": f"{100 * knee['masses']['rms'] / knee['inertias']['rms']:.0f} %",
        "moments-shift": f"{abs(knee['moments']['shift']):.4f} N m",
        "moments-split": f"{knee['moments']['split']:.3f} N m",
        "masses-split": f"{knee['masses']['split']:.2f} N m",
        "moments-most": f"{100 * max(row['moments']['rms'] / row['inertias']['rms'] for row in joints.values()):.0f} %",
        "share-knee": f"{100 * knee['inertias']['offset_share']:.0f} %",
        "share-hip-pitch": f"{100 * joints['hip_pitch']['inertias']['offset_share']:.0f} %",
        "share-forward": f"{100 * knee['forward']['offset_share']:.0f} %",
        "ankle-roll-inertias": f"{joints['ankle_roll']['inertias']['rms']:.4f} N m",
        "ankle-roll-left": f"{joints['ankle_roll']['left']['rms']:.2f} N m",
    }
