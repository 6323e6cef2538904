"""One method of stribeck with default settings.

python -m benchmarks.contest.contestants.stribeck_method METHOD CASE OUT
"""

import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from studies.held_out import predicted_torque

from benchmarks.contest import schema
from stribeck import Robot, Settings, __version__, identify, read_log
from stribeck.core.base.typing import Array
from stribeck.core.errors import StribeckError
from stribeck.core.log.interpolation import linear
from stribeck.core.result import JointResult, ParameterEstimate, Result

NEEDS: Mapping[str, list[schema.Need]] = {
    "curve-fit": ["contact flags"],
    "direct": ["contact flags"],
    "observer": ["contact flags"],
    "whole-log": ["contact flags", "IMU"],
    "ground-reaction": ["contact flags", "foot wrenches"],
}
"""Required channels of a walking robot, by method; wrenches or kinematics replace missing contact flags."""


def answer(method: str, folder: Path, out: Path) -> schema.Answer:
    """Run a method on a case, and write predicted torques to `out`."""
    case, robot = schema.read(schema.Case, folder / schema.CASE), Robot.from_file(folder / "robot.toml")
    needs = NEEDS.get(method, []) if robot.base == "floating" else []
    reply = partial(schema.Answer, method=method, version=__version__, needs=needs)
    try:
        result = identify([read_log(folder / log, robot) for log in case.logs], robot, Settings(method=method))
    except StribeckError as error:
        return reply(blank=str(error).replace(f"{folder}/", ""))
    if case.predict:
        np.savez(out / schema.TORQUE, torque=predicted(folder / schema.PREDICT, robot, result))
    joints = {joint: of_joint(result.joints[joint], np.array(asked.velocity)) for joint, asked in case.joints.items()}
    found = {joint: each for joint, each in joints.items() if each}
    blank = "; ".join(f"{joint} is {result.joints[joint].verdict}" for joint in joints if joint not in found)
    return reply(joints=found, blank=blank or None)


def of_joint(found: JointResult, velocity: Array) -> schema.JointAnswer | None:
    """Convert a joint's result to an answer; the verdict "no friction" becomes a deliberate zero."""
    if not found.parameters and found.verdict != "no friction":
        return None
    given = {name: estimate(found.parameters[name]) for name in schema.PARAMETERS if name in found.parameters}
    if found.verdict == "no friction":
        given |= {"coulomb": schema.Estimate(value=0.0), "viscous": schema.Estimate(value=0.0)}
    curve = found.friction(velocity) if "offset" in found.parameters else None
    return schema.JointAnswer(**given, curve=None if curve is None else curve.tolist())


def estimate(found: ParameterEstimate) -> schema.Estimate:
    """Convert a parameter; weak parameters are not marked as good."""
    low, high = found.interval_95
    return schema.Estimate(
        value=found.value,
        standard_error=found.standard_error if np.isfinite(found.standard_error) else None,
        interval_95=(low, high) if np.isfinite([low, high]).all() else None,
        good=found.verdict != "weak",
    )


def predicted(path: Path, robot: Robot, result: Result) -> Array:
    """Predict the torques of a motion with the identified model and friction [N m], shape (T, n)."""
    with np.load(path) as file:
        motion = {name: file[name] for name in ("time", "position", "velocity", "acceleration")}
    period = float(np.median(np.diff(motion["time"])))
    position, velocity, acceleration = (motion[name] for name in ("position", "velocity", "acceleration"))
    torque, _ = predicted_torque(robot, result, position, velocity, acceleration, period=period)
    late = result.corrections.torque_delay if result.corrections else None
    return linear(motion["time"] - late[0], motion["time"], torque) if late else torque


def main() -> None:
    method, folder, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    schema.write(answer(method, folder, out), out / schema.ANSWER)


if __name__ == "__main__":
    main()
