"""Identify joint friction of real robots from their published logs, and compare it with the published figures.

`python examples/real_robots/run.py DATA_FOLDER` prints the tables of results.md: the result with default settings, and
the curve fit with the settings in the robot's curve-fit.toml.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from convert import convert
from scipy.spatial.transform import Rotation

from stribeck import Robot, identify, read_log
from stribeck.core.result import Result
from stribeck.core.settings import FilterSettings

Published = Mapping[str, Sequence[float]]
"""Parameters by name, one value per joint."""

TX40: Published = {  # TX40_config.yaml: fs, fv, Ia of joints 1 to 6
    "coulomb": (7.14, 8.26, 6.34, 2.48, 3.03, 0.282),
    "viscous": (8.05, 5.53, 1.97, 1.11, 1.86, 0.65),
    "armature": (0.362, 0.362, 0.0988, 0.0313, 0.0468, 0.0105),
}
DOUBLE_PENDULUM: Published = {  # design_C.1_model_1.0.yml: cf, b, and gr^2 Ir
    "coulomb": (0.16, 0.12),
    "viscous": (0.001, 0.001),
    "armature": (36 * 6.2872e-5, 36 * 6.2872e-5),
    "offset": (0.0, 0.0),
}
CASSIE_TOE, CASSIE_HEEL = np.array([-0.0457, 0.112, 0.0]), np.array([0.088, 0.0, 0.0])
"""Ends of Cassie's sole in its foot frame [m]."""
PARAMETERS = ("coulomb", "viscous", "armature", "offset")
AS_PUBLISHED = {"rest": 0.0, "holdout": 10_000, "fit_armature": True}
"""Settings that reproduce the published Kinova fit: all samples, including rest, and the rotor inertia."""


def kinova_published(data: Path) -> Published:
    """Read the published friction of the Kinova's seven joints."""
    values = np.loadtxt(data / "kinova-gen3" / "friction_parameters_solution_5.csv").reshape(4, 7)
    return {name: row.tolist() for name, row in zip(PARAMETERS, values, strict=True)}


def found(result: Result, name: str) -> list[float]:
    """List a parameter of every joint: NaN for joints without a result, 0 for parameters outside the fit."""
    return [
        joint.parameters[name].value if name in joint.parameters else 0.0 if joint.parameters else np.nan
        for joint in result.joints.values()
    ]


def by_default(result: Result, published: Published | None) -> str:
    """Format the result of default settings, and the published friction at the same speed."""
    joints, rows = result.all_friction, list(result.all_friction)
    middle = [joint.curve[1] if joint.curve else None for joint in joints.values()]
    checks = [joint.validation for joint in joints.values()]
    columns = {
        "joint": rows,
        "verdict": [joint.verdict for joint in joints.values()],
        "friction [N m]": [
            f"{p.value:.3g} ± {p.standard_error:.2g} at {p.velocity:.2g} rad/s" if p else "–" for p in middle
        ],
        "held-out rms [N m]": numbers([check.rms if check else np.nan for check in checks]),
        "without friction": numbers([check.rms_zero_friction if check else np.nan for check in checks]),
    }
    if published:
        known = dict(zip(rows, zip(published["coulomb"], published["viscous"], strict=True), strict=False))
        columns["published [N m]"] = [
            f"{known[name][0] + known[name][1] * point.velocity:.3g}" if point and name in known else "–"
            for name, point in zip(rows, middle, strict=True)
        ]
    return table(columns)


def unexplained(log: Path, robot: Robot, parameters: Published) -> list[float]:
    """Compute the RMS torque [N m] of every joint that parameters do not explain in a log's moving samples."""
    settings = robot.settings.model_copy(update={"fit_armature": False})  # samples then include the rotors' torque
    samples = identify(log, robot, settings).evidence.samples
    speed = np.abs(samples.velocity)
    predicted = parameters["coulomb"] * np.sign(samples.velocity) + parameters["viscous"] * samples.velocity
    predicted += parameters["armature"] * samples.acceleration + parameters["offset"]
    moving = speed > robot.settings.rest * np.percentile(speed, 99, axis=0)
    squares = np.where(moving, (samples.friction_torque - predicted) ** 2, 0.0)
    return np.sqrt(squares.sum(axis=0) / moving.sum(axis=0)).tolist()


def unseen(logs: Sequence[Path], robot: Robot, published: Published) -> tuple[list[float], list[float]]:
    """Compute the unexplained RMS torque [N m] of each log: by the fit to the other logs, and by published figures."""
    ours, theirs = [], []
    for log in logs:
        others = identify([other for other in logs if other != log], robot)
        ours.append(unexplained(log, robot, {name: found(others, name) for name in PARAMETERS}))
        theirs.append(unexplained(log, robot, published))
    together = [np.sqrt(np.mean(np.square(rms), axis=0)).tolist() for rms in (ours, theirs)]
    return together[0], together[1]


def table(columns: Mapping[str, Sequence[str]]) -> str:
    """Format columns, the first of them text, as a Markdown table."""
    lines = [list(columns), ["---", *["---:"] * (len(columns) - 1)], *zip(*columns.values(), strict=True)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def numbers(values: Sequence[float], digits: int = 3) -> list[str]:
    """Format numbers; a dash for NaN."""
    return ["–" if np.isnan(value) else f"{value:.{digits}f}" for value in values]


def estimates(result: Result, name: str, digits: int = 3) -> list[str]:
    """Format a parameter of every joint with its standard error; a dash for joints without a result."""
    pairs = [joint.parameters.get(name) for joint in result.joints.values()]
    return [f"{pair.value:.{digits}f} ± {pair.standard_error:.{digits}f}" if pair else "–" for pair in pairs]


def tx40(logs: Sequence[Path], robot: Robot, data: Path) -> str:  # noqa: ARG001 - the figures are constants
    """Format identified and published figures of every joint, and their differences."""
    result = identify(logs, robot)
    columns = {"joint": list(result.joints)}
    for title, name, digits in (
        ("Coulomb [N m]", "coulomb", 2),
        ("viscous [N m s/rad]", "viscous", 2),
        ("rotor inertia [kg m²]", "armature", 3),
    ):
        differences = 100 * (np.array(found(result, name)) / TX40[name] - 1)
        columns[title] = estimates(result, name, digits)
        columns[f"{title.split(' [')[0]}, published"] = [f"{value:g}" for value in TX40[name]]
        columns[f"{title.split(' [')[0]}, difference"] = [f"{difference:+.1f} %" for difference in differences]
    variants = {"samples at rest stay in": {"rest": 0.0}, "stribeck chooses the filter": {"filter": FilterSettings()}}
    lines = []
    for text, update in variants.items():
        coulomb = found(identify(logs, robot, robot.settings.model_copy(update=update)), "coulomb")
        lines.append(f"Coulomb friction if {text}: {', '.join(numbers(coulomb, 2))} N m.\n")
    return "\n".join([table(columns), *lines])


def kinova(logs: Sequence[Path], robot: Robot, data: Path) -> str:
    """Format identified and published figures, a fit with the published settings, and residuals on unseen logs."""
    result, published = identify(logs, robot), kinova_published(data)
    their_way = identify(logs[-1], robot, robot.settings.model_copy(update=AS_PUBLISHED))
    ours, theirs = unseen(logs, robot, published)
    return table(
        {
            "joint": list(result.joints),
            "Coulomb [N m]": estimates(result, "coulomb"),
            "Coulomb, log 5 their way": numbers(found(their_way, "coulomb")),
            "Coulomb, published": numbers(published["coulomb"]),
            "viscous [N m s/rad]": estimates(result, "viscous"),
            "viscous, log 5 their way": numbers(found(their_way, "viscous")),
            "viscous, published": numbers(published["viscous"]),
            "rms, unseen logs [N m]": numbers(ours),
            "rms, published figures": numbers(theirs),
        }
    )


def go2(logs: Sequence[Path], robot: Robot, data: Path) -> str:  # noqa: ARG001 - nothing is published
    """Format Coulomb friction, viscous friction, rotor inertia and held-out residual of every joint."""
    result = identify(logs, robot)
    validations = [joint.validation for joint in result.joints.values()]
    return table(
        {
            "joint": list(result.joints),
            "Coulomb [N m]": estimates(result, "coulomb"),
            "viscous [N m s/rad]": estimates(result, "viscous"),
            "rotor inertia [kg m²]": estimates(result, "armature", 4),
            "held-out rms [N m]": numbers([part.rms if part else np.nan for part in validations]),
            "without friction": numbers([part.rms_zero_friction if part else np.nan for part in validations]),
        }
    )


def double_pendulum(logs: Sequence[Path], robot: Robot, data: Path) -> str:  # noqa: ARG001 - the figures are constants
    """Format identified and published figures, figures of each log individually, and residuals on the other log."""
    result = identify(logs, robot)
    ours, theirs = unseen(logs, robot, DOUBLE_PENDULUM)
    return table(
        {
            "joint": list(result.joints),
            "Coulomb [N m]": estimates(result, "coulomb"),
            "log 1 only": numbers(found(identify(logs[0], robot), "coulomb")),
            "log 2 only": numbers(found(identify(logs[1], robot), "coulomb")),
            "Coulomb, published": numbers(DOUBLE_PENDULUM["coulomb"]),
            "viscous [N m s/rad]": estimates(result, "viscous"),
            "viscous, published": numbers(DOUBLE_PENDULUM["viscous"]),
            "rotor inertia [kg m²]": estimates(result, "armature", 4),
            "rotor inertia, published": numbers(DOUBLE_PENDULUM["armature"], 4),
            "rms, unseen log [N m]": numbers(ours),
            "rms, published figures": numbers(theirs),
        }
    )


def cassie(logs: Sequence[Path], robot: Robot, data: Path) -> str:  # noqa: ARG001 - nothing is published
    """Format the median slope of the soles after landings, which tests angles, joint orders, signs and offsets."""
    slopes = []
    for path in logs:
        log = read_log(path, robot)
        base = Rotation.from_quat(log.base_orientation[-1])
        for foot in robot.contacts:
            toe_to_heel = robot.foot_pose(foot, log.position[-1:])[0][0] @ (CASSIE_HEEL - CASSIE_TOE)
            slopes.append(np.rad2deg(np.arcsin(base.apply(toe_to_heel)[2] / np.linalg.norm(toe_to_heel))))
    return f"{len(logs)} logs; the soles end within {np.median(np.abs(slopes)):.1f} degrees of level (median).\n"


SECTIONS: dict[str, Callable[[Sequence[Path], Robot, Path], str]] = {
    "tx40": tx40,
    "kinova-gen3": kinova,
    "go2": go2,
    "double-pendulum": double_pendulum,
}
"""Functions that format the curve fit with the settings of each robot's curve-fit.toml."""


def shown(name: str, data: Path, scratch: Path) -> str:
    """Format the tables of a robot: default settings and curve fit."""
    known: dict[str, Published] = {
        "tx40": {name: values[:4] for name, values in TX40.items()},  # joints 5 and 6 share a motor
        "kinova-gen3": kinova_published(data),
        "double-pendulum": DOUBLE_PENDULUM,
    }
    folder = convert(name, data, scratch)
    logs, robot = sorted(folder.glob("log*.npz")), Robot.from_file(folder / "robot.toml")
    if name == "cassie-landings":
        return f"### {robot.name}\n\n{cassie(logs, robot, data)}"
    curves = SECTIONS[name](logs, Robot.from_file(folder / "curve-fit.toml"), data)
    return f"### {robot.name}\n\n{by_default(identify(logs, robot), known.get(name))}\n{curves}"


def main(data: Path) -> None:
    """Print the tables of all robots."""
    with tempfile.TemporaryDirectory() as scratch:
        for name in (*SECTIONS, "cassie-landings"):
            print(shown(name, data, Path(scratch)))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python run.py DATA_FOLDER")
    main(Path(sys.argv[1]))
