"""Fig. 7.7 and 7.8 from logs of real robots, which others have published and which are not part of this repository.

Their folder is `$STRIBECK_REAL_LOGS`, or `../shared/real-logs`. Where there is none, the numbers and figures that are
kept stay as they are.
"""

import json
import os
import runpy
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stribeck import Robot, identify
from stribeck.friction import get_law
from stribeck.result import Result
from stribeck.typing import Array
from studies.paper import figures
from studies.paper.markdown import markdown_table
from studies.paper.study import NUMBERS, ROOT, Numbers, Study
from studies.paper.swing import feeding, split

WALKS = ()
DATA = Path(os.environ.get("STRIBECK_REAL_LOGS", ROOT.parent / "shared" / "real-logs"))
ROBOTS = {
    "tx40": "Staubli TX40",
    "kinova-gen3": "Kinova Gen3",
    "go2": "Unitree Go2",
    "double-pendulum": "double pendulum",
}
SHOWN = {"tx40": "joint_2", "kinova-gen3": "joint_4", "go2": "FL_calf_joint", "double-pendulum": "Joint1"}
MOST_POINTS = 320
"""That are drawn of a branch."""
DOT = 0.002
"""Length of a drawn point, over the width of the axes: a path of short strokes takes less than as many markers."""


def run(quick: bool) -> Study:  # noqa: ARG001 - it takes seconds
    if not DATA.is_dir():
        print(f"real_logs: there is no folder {DATA}; what is kept of the real robots stays as it is", file=sys.stderr)
        return Study(json.loads((NUMBERS / "real_logs.json").read_text(encoding="utf-8")), {})
    results = _identify_all()
    numbers = {robot: {joint: _measures(each, joint) for joint in each.joints} for robot, each in results.items()}

    def draw(figure: Figure) -> None:
        figure.set_size_inches(6.5, 4.8)
        panels = figure.subplots(2, 2)
        for axes, (robot, joint) in zip(panels.flat, SHOWN.items(), strict=True):
            _draw(axes, results[robot], joint)
            axes.set_title(f"{ROBOTS[robot]}, {joint.replace('_', ' ')}")
        for axes in panels[1]:
            axes.set_xlabel("velocity [rad/s]")
        for axes in panels[:, 0]:
            axes.set_ylabel("friction torque [N m]")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)

    return Study(numbers, {"real-logs": draw})


def _identify_all() -> dict[str, Result]:
    convert = runpy.run_path(str(ROOT / "examples" / "real_robots" / "convert.py"))["convert"]
    results = {}
    with tempfile.TemporaryDirectory() as place:
        for name in ROBOTS:
            folder = convert(name, DATA, Path(place))
            results[name] = identify(sorted(folder.glob("log*.npz")), Robot.from_file(folder / "curve-fit.toml"))
    return results


def _samples(result: Result, joint: str) -> tuple[Array, Array, Array]:
    """Return velocity, acceleration and friction torque of a joint, shape (N,) each."""
    assert result.evidence is not None
    samples = result.evidence.samples
    column = samples.joint_names.index(joint)
    rows = samples.usable[:, column] & np.isfinite(samples.friction_torque[:, column])
    return tuple(each[rows, column] for each in (samples.velocity, samples.acceleration, samples.friction_torque))


def _measures(result: Result, joint: str) -> dict[str, float]:
    """Return shares with positive power, with and without the offset [1], and the split around the law over Fc [1]."""
    velocity, acceleration, torque = _samples(result, joint)
    parameters = result.joints[joint].parameters
    offset, coulomb = (parameters[name].value for name in ("offset", "coulomb"))
    return {
        "feeding": feeding(velocity, torque),
        "feeding_levelled": feeding(velocity, torque - offset),
        "split": split(velocity, acceleration, torque - _law(result, joint, velocity)) / coulomb,
    }


def _law(result: Result, joint: str, velocity: Array) -> Array:
    """Return the fitted friction torque [N m] at these velocities."""
    law, parameters = get_law(result.law), result.joints[joint].parameters
    return law.torque(velocity, np.array([parameters[parameter.name].value for parameter in law.parameters]))


def _draw(axes: Axes, result: Result, joint: str) -> None:
    velocity, acceleration, torque = _samples(result, joint)
    for k, (label, rows) in enumerate({"velocity rises": acceleration > 0, "falls": acceleration <= 0}.items()):
        step = -(-int(rows.sum()) // MOST_POINTS)
        v, r = velocity[rows][::step], torque[rows][::step]
        strokes = np.stack([v, v + DOT * np.ptp(velocity), np.full_like(v, np.nan)], axis=1).ravel()
        axes.plot(strokes, np.repeat(r, 3), f"C{k}", lw=1.4, solid_capstyle="round", label=label)
    grid = np.linspace(velocity.min(), velocity.max(), 401)
    axes.plot(grid, _law(result, joint, grid), color=figures.ink(), lw=0.9, label="law that is fitted")


def texts(numbers: Numbers) -> dict[str, str]:
    """Return shares and splits by robot, and those that sentences quote."""
    keys = ("feeding", "feeding_levelled", "split")
    rows = []
    for robot, name in ROBOTS.items():
        joints = numbers[robot]
        values = {key: [joints[joint][key] for joint in joints] for key in keys}
        cells = (f"{100 * each:.0f} %" for key in keys for each in (np.mean(values[key]), max(values[key])))
        rows.append((name, len(joints), *cells))
    head = [f"{label}, {kind}" for label in ("as found", "without offset", "split / Fc") for kind in ("mean", "worst")]
    offsets = numbers["kinova-gen3"]["joint_4"]
    splits = [each["split"] for robot in numbers.values() for each in robot.values()]
    return {
        "table": markdown_table(("robot", "joints", *head), rows),
        "kinova": f"{100 * offsets['feeding']:.0f} %",
        "kinova-levelled": f"{100 * offsets['feeding_levelled']:.0f} %",
        "tx40": f"{100 * max(each['feeding_levelled'] for each in numbers['tx40'].values()):.0f} %",
        "split": f"{100 * float(np.median(splits)):.0f} %",
    }
