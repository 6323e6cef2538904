"""Which joint feels which body: the friction error by one body of a wrong mass, or with its mass in another place.

The right leg, while it swings and while it stands. The log is exact, as for Fig. 7.5.
"""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from stribeck import Settings
from stribeck.settings import FilterSettings
from stribeck_simulation.run import Simulated
from studies.paper.estimate import Estimate, estimate, rms
from studies.paper.inexact import ROOT, Change, body_names, displaced, scaled, with_bodies
from studies.paper.markdown import markdown_table
from studies.paper.study import Numbers, Study
from studies.paper.swing import JOINTS, SIDE
from studies.paper.walks import get_walk

WALKS = ("legs-contact",)
SUPPORTS = {"swings": "left_foot", "stands": "right_foot"}
"""What the right leg does -> the foot that stands."""
SETTINGS = Settings(filter=FilterSettings(kind="savitzky-golay", window=11), standing_legs=True)
"""The log has no noise."""
SHARE, OFFSET = 0.1, 0.01
"""Of the mass [1], and of the centre of mass along one axis [m]."""
KINDS = {"mass": "mass +10 %", "place": "CoM by 10 mm"}
COLOURS = LogNorm(1e-2, 10.0)
"""[N m]"""
LEAST = 5e-4
"""Errors below this [N m] are rounding."""


def run(quick: bool) -> Study:
    walk = get_walk("legs-contact", quick)
    right = estimate(walk, SETTINGS)
    groups = _groups(body_names(walk.robot))
    numbers: dict[str, dict[str, dict[str, dict[str, float]]]] = {
        kind: {phase: {joint: {} for joint in JOINTS} for phase in SUPPORTS} for kind in KINDS
    }
    shifts = [displaced(OFFSET * axis) for axis in np.eye(3)]
    for group, bodies in groups.items():
        changes: dict[str, list[Change]] = {"mass": [scaled(mass=1 + SHARE)], "place": shifts}
        for kind, several in changes.items():
            wrong = [_estimate(walk, change, bodies) for change in several]
            for phase in SUPPORTS:
                for joint in JOINTS:
                    numbers[kind][phase][joint][group] = max(_error(right, each, phase, joint) for each in wrong)

    def draw(figure: Figure) -> None:
        figure.set_size_inches(6.5, 5.0)
        own = list(JOINTS)
        panels = figure.subplots(2, 2, width_ratios=(len(own), len(groups)), sharex="col", sharey=True)
        for row, (kind, title) in zip(panels, KINDS.items(), strict=True):
            for axes, phase in zip(row, SUPPORTS, strict=True):
                _heat_map(axes, numbers[kind][phase], own if phase == "swings" else list(groups))
                axes.set_title(f"{title}, leg {phase} [N m]")

    return Study(numbers, {"bodies": draw})


def _groups(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Return the bodies that are looked at together: each of the right leg's alone, the rest in parts."""
    legs = [name for name in names if name.split("_", 1)[-1] in JOINTS]
    arms = [name for name in names if "shoulder" in name or "elbow" in name or "wrist" in name]
    return {joint: (f"{SIDE}_{joint}",) for joint in JOINTS} | {
        "pelvis": (ROOT,),
        "trunk": ("waist",),
        "head": tuple(name for name in names if name.startswith("neck")),
        "arms": tuple(arms),
        "other leg": tuple(name for name in legs if not name.startswith(SIDE)),
    }


def _estimate(walk: Simulated, change: Change, bodies: tuple[str, ...]) -> Estimate:
    robot = with_bodies(walk.robot, change, bodies)
    return estimate(replace(walk, robot=robot), SETTINGS)


def _error(right: Estimate, wrong: Estimate, phase: str, joint: str) -> float:
    """Return the RMS of what the wrong model changes in a joint's friction torque [N m]."""
    rows, column = right.standing_on(SUPPORTS[phase]), right.column(f"{SIDE}_{joint}")
    error = rms(wrong.samples.friction_torque[rows, column] - right.samples.friction_torque[rows, column])
    return error if error > LEAST else 0.0


def _heat_map(axes: Axes, rows: dict[str, dict[str, float]], groups: list[str]) -> None:
    values = np.array([[rows[joint][group] for group in groups] for joint in JOINTS])
    shown = axes.pcolormesh(np.ma.masked_equal(values, 0.0), cmap="viridis", norm=COLOURS, edgecolors="none")
    for (i, k), value in np.ndenumerate(values):
        if value:
            bright = np.mean(shown.cmap(COLOURS(value))[:3]) > 0.45
            axes.text(
                k + 0.5, i + 0.5, _short(value), ha="center", va="center", fontsize=6, color="k" if bright else "w"
            )
    axes.set_xticks(
        np.arange(len(groups)) + 0.5, [group.replace("_", " ") for group in groups], rotation=60, ha="right"
    )
    axes.set_yticks(np.arange(len(JOINTS)) + 0.5, [joint.replace("_", " ") for joint in JOINTS])
    axes.set_ylim(len(JOINTS), 0)
    axes.grid(visible=False)
    axes.tick_params(length=0)


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def texts(numbers: Numbers) -> dict[str, str]:
    """Return errors by joint and body, of the leg that swings, and what sentences quote."""
    swings, stands = ({kind: numbers[kind][phase] for kind in KINDS} for phase in SUPPORTS)
    tables = {
        f"{kind}-{phase}": markdown_table(
            ("joint", *(group.replace("_", " ") for group in shown)),
            [
                (joint.replace("_", " "), *(_short(row[group]) if row[group] else "" for group in shown))
                for joint, row in rows.items()
            ],
        )
        for phase, each, shown in (("swings", swings, JOINTS), ("stands", stands, tuple(stands["mass"]["knee"])))
        for kind, rows in each.items()
    }
    return {
        **tables,
        "knee-shank": f"{swings['mass']['knee']['knee']:.2g} N m",
        "knee-foot": f"{swings['mass']['knee']['ankle_pitch']:.2g} N m",
        "ankle-roll-foot": f"{swings['mass']['ankle_roll']['ankle_pitch']:.2g} N m",
        "ankle-roll-foot-place": f"{swings['place']['ankle_roll']['ankle_pitch']:.2g} N m",
        "ankle-roll-stands": f"{stands['place']['ankle_roll']['trunk']:.2g} N m",
        "knee-trunk": f"{stands['place']['knee']['trunk']:.2g} N m",
    }
