"""Sections 3.3 and 6.1: integration of the smooth law with fixed steps, for one joint and for a robot."""

from functools import partial

import numpy as np

from stribeck import Robot
from stribeck.dynamics.rooted import joint_inertia
from stribeck_simulation.robots.toro import ROBOT_FILE, standing_posture
from stribeck_simulation.run import friction_of
from studies.markdown import markdown_table
from studies.paper.coasting import STEP, chatter, coast, least_inertia, stiffness
from studies.paper.laws import KNEE, SLOPE
from studies.paper.study import Numbers
from studies.paper.walks import SCENARIOS

WALKS = ()
STANCE = "left_foot"
INERTIAS = {"foot": 0.01, "forearm": 0.1, "shank": 0.5}
"""Inertia moved by the ankle pitch, elbow and knee of a TORO-like humanoid's swinging limbs [kg m^2]."""
SLOPES = {"10": 10.0, "20": 20.0, "40": 40.0, "100": 100.0, "300": 300.0, "1000": 1000.0, "the jump": np.inf}
"""Slopes of the law [s/rad]."""
START = 0.5
"""Velocity from which joints coast [rad/s]."""


def integration(inertia: float, slope: float) -> dict[str, float]:
    """Compute the final velocity amplitude [rad/s] of a coasting joint, which should be at rest.

    Parameters
    ----------
    inertia, slope
        Inertia of the joint [kg m^2], slope of the law [s/rad].
    """
    duration = START * inertia / KNEE["coulomb"] + 0.5
    run_down = partial(coast, inertia, slope, start=START, duration=duration)
    return {name: chatter(run_down(implicit=name == "implicit")) for name in ("explicit", "implicit")}


def accuracy(inertia: float) -> dict[str, float]:
    """Compute the RMS difference between steps of 1 ms and of 10 us while coasting [rad/s], at the paper's slope."""
    run_down = partial(coast, inertia, SLOPE, start=START, duration=START * inertia / KNEE["coulomb"])
    fine = run_down(implicit=False, step=STEP / 100)[::100]
    ways = {"explicit": False, "implicit": True}
    return {name: float(np.sqrt(np.mean((run_down(implicit=way) - fine) ** 2))) for name, way in ways.items()}


def robot_gain() -> dict[str, object]:
    """Compute the gains of an explicit step for a TORO-like humanoid on its left foot with the friction of Table 6.1.

    `largest` is the largest eigenvalue of h M_mod^-1 k [1]; above 2 the explicit step chatters. `joint` has the largest
    component of its eigenvector. `alone` is h k / I of each joint, with the effective inertia I if all others are free.
    """
    robot = Robot.from_file(ROBOT_FILE)
    names = robot.joint_names
    posture = np.array([[standing_posture().get(name, 0.0) for name in names]])
    mobility = np.linalg.inv(joint_inertia(robot.rooted_at(STANCE), posture)[0])
    k = np.zeros(len(names))
    for joint, named in friction_of(SCENARIOS["straight"], robot).parameters.items():
        k[names.index(joint)] = named["slope"] * named["coulomb"] * (1 + named["stribeck_gain"]) + named["viscous"]
    root = np.sqrt(k)  # a similar, symmetric matrix has the same eigenvalues
    eigenvalues, vectors = np.linalg.eigh(STEP * root[:, None] * mobility * root)
    alone = STEP * k * np.diag(mobility)
    return {
        "largest": eigenvalues[-1],
        "joint": names[int(np.argmax(np.abs(vectors[:, -1])))],
        "alone": {name: gain for name, gain in zip(names, alone, strict=True) if gain > 0},
    }


def run(quick: bool) -> Numbers:  # noqa: ARG001 - it takes seconds
    return {
        "foot_gain": stiffness(SLOPE) * STEP / INERTIAS["foot"],
        "least_inertia": {name: least_inertia(slope) for name, slope in SLOPES.items() if np.isfinite(slope)},
        "integration": {
            place: {name: integration(inertia, slope) for name, slope in SLOPES.items()}
            for place, inertia in INERTIAS.items()
        },
        "accuracy": {place: accuracy(inertia) for place, inertia in INERTIAS.items()},
        "robot": robot_gain(),
    }


def texts(numbers: Numbers) -> dict[str, str]:
    robot, integrated = numbers["robot"], numbers["integration"]
    jump = {place: each["the jump"]["explicit"] for place, each in integrated.items()}
    shank = numbers["accuracy"]["shank"]
    return {
        "table": _table(numbers),
        "rings": f"{1e3 * max(each['the jump']['implicit'] for each in integrated.values()):.0f} mrad/s",
        "jump": f"{jump['shank']:.4f} to {jump['foot']:.2f} rad/s",
        "foot-gain": f"{numbers['foot_gain']:.1f}",
        "least-inertia": f"{numbers['least_inertia'][f'{SLOPE:g}']:.3f} kg m²",
        "implicit-error": f"{1e3 * shank['implicit']:.3f} mrad/s",
        "explicit-error": f"{1e3 * shank['explicit']:.2f} mrad/s",
        "robot-gain": f"{robot['largest']:.1f}",
        "robot-joint": str(robot["joint"]).replace("_", " "),
    }


def _table(numbers: Numbers) -> str:
    header = ["slope a [s/rad]", "least inertia that rests [kg m²]"]
    header += [f"{place}, {inertia:g} kg m²" for place, inertia in INERTIAS.items()]
    rows = []
    for slope in SLOPES:
        least = numbers["least_inertia"].get(slope)
        cells = [numbers["integration"][place][slope] for place in INERTIAS]
        told = [f"{cell['explicit']:.2g} rad/s" if cell["explicit"] else "rests" for cell in cells]
        rows.append([slope, f"{least:.2g}" if least else "none", *told])
    return markdown_table(header, rows)
