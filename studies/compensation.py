"""Measure friction compensation in closed loop, with friction identified from the arm's own noisy log.

    python -m studies.compensation --save studies/compensation.json

An arm with six joints makes an excitation motion with noisy encoders and torque sensors. Its friction is identified
with default settings, exported as a C header, compiled, and compensated in a loop at 1 kHz: computed torque tracks slow
sines through reversals.

Velocities are low-pass filtered differences of noisy positions. For comparison, the loop runs without compensation,
with the true friction, and with one and a half times the true friction (overestimation).
"""

import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from stribeck import Robot, RobotLog, identify
from stribeck.app.exporters import export
from stribeck.app.exporters.joints import joint_terms
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.result import Result
from stribeck.simulation.friction import FrictionTruth, LawFriction
from stribeck.simulation.friction.parameters import Parameters
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.rigid.constrained import BodyState, simulate_constrained
from stribeck.simulation.robots import MODELS
from stribeck.simulation.sensors.measure import with_noise
from studies.command import Row, command
from studies.markdown import markdown_table

LAW = "stribeck"
COULOMB = (4.0, 4.0, 3.0, 1.2, 1.0, 0.6)
"""Coulomb friction of the joints [N m]: 1/30 to 1/20 of their torque limits, typical of harmonic drives."""

OTHERS = {"stribeck_gain": 0.3, "stribeck_velocity": 0.1, "slope": 60.0, "offset": 0.0}
VISCOUS = 0.3
"""Viscous friction divided by Coulomb friction [s/rad]."""

ENCODER, TORQUE = 2e-5, 0.05
"""Noise of encoders [rad] and torque sensors [N m], in the log and in the loop."""

RATE, SECONDS, SETTLED = 1000.0, 12.0, 2.0
"""Loop rate [Hz], duration of a run [s], and settling time that is not measured [s]."""

SIZE, SLOWEST = 0.35, 0.08
"""Amplitude of the sines [rad], and their lowest frequency [Hz]."""

STIFF = 30.0
"""Natural frequency of the controller [rad/s]."""

LOW_PASS = 0.01
"""Time constant of velocities [s]."""

SETTINGS = {"gain": 0.9, "near": 0.05, "dead_zone": 0.01, "release": 0.005, "fade": 0.02, "limit": 50.0}
KINDS = ("none", "identified", "true", "half as much again")

Compensation = Callable[[Array, Array], Array]
"""Measured and desired velocities -> torques [N m], shape (n,) each."""


def arm() -> Robot:
    """Return the arm."""
    return Robot.from_file(MODELS / "arm.toml")


def truth_of(robot: Robot) -> dict[str, dict[str, float]]:
    """Return the friction of every joint."""
    levels = zip(robot.joint_names, COULOMB, strict=True)
    return {name: {"coulomb": level, "viscous": VISCOUS * level, **OTHERS} for name, level in levels}


def noisy_log(robot: Robot) -> RobotLog:
    """Return the arm's own noisy log."""
    exact, _ = exact_log(robot, get_law(LAW), truth_of(robot), duration=40.0, seed=1)
    return with_noise(exact, position=ENCODER, torque=TORQUE, seed=2)


@cache
def identified() -> Result:
    """Identify friction from the arm's own noisy log."""
    return identify(noisy_log(arm()), arm())


def with_truth(result: Result, truth: Parameters, factor: float = 1.0) -> Result:
    """Replace a result's friction by the true one, Coulomb and viscous friction times a factor."""
    joints = {}
    some = next(each for joint in result.joints.values() for each in joint.parameters.values())
    for name, values in truth.items():
        scaled = {key: value * (factor if key in ("coulomb", "viscous") else 1.0) for key, value in values.items()}
        parameters = {key: replace(some, value=value) for key, value in scaled.items()}
        joints[name] = replace(result.joints[name], parameters=parameters, verdict="identified", law=LAW)
    return replace(result, law=LAW, joints=joints)


def compiled(result: Result, robot: Robot) -> Compensation:
    """Compile the exported header as a compensation."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        export(result, robot, path / "friction.h", "c", include_weak=True)
        (path / "loop.c").write_text(
            '#include "friction.h"\n'
            "static friction_state state[FRICTION_JOINT_COUNT];\n"
            "double act(int k, double v, double w) {\n"
            f"    static const friction_settings own = {{{', '.join(map(repr, SETTINGS.values()))}}};\n"
            f"    return friction_compensation(k, v, w, 0, 0, {1 / RATE!r}, &own, &state[k]);\n"
            "}\n"
        )
        command = ["cc", "-std=c99", "-O2", "-shared", "-fPIC", "loop.c", "-o", "loop.so", "-lm"]
        subprocess.run(command, cwd=path, check=True)
        act = ctypes.CDLL(str(path / "loop.so")).act
    act.argtypes, act.restype = [ctypes.c_int, ctypes.c_double, ctypes.c_double], ctypes.c_double
    written = joint_terms(result, None, include_weak=True)
    number = {robot.joint_names.index(name): k for k, name in enumerate(written)}

    def compensate(measured: Array, desired: Array) -> Array:
        torques = np.zeros(len(measured))
        for joint, k in number.items():
            torques[joint] = act(k, measured[joint], desired[joint])
        return torques

    return compensate


def run(compensation: str) -> Row:
    """Simulate the arm with a compensation; return the tracking error, root mean square [mrad]."""
    robot = arm()
    compensate = _made(compensation, robot)
    model = robot.tree.model
    data, generator = model.createData(), np.random.default_rng(3)
    joints = np.arange(model.nv)
    speed = 2 * np.pi * SLOWEST * (1 + 0.35 * joints)
    seen = {name: np.zeros(model.nv) for name in ("position", "velocity")}
    measured: list[Array] = []

    def aim(time: float) -> tuple[Array, Array, Array]:
        phase = speed * time
        return SIZE * np.sin(phase), SIZE * speed * np.cos(phase), -SIZE * speed**2 * np.sin(phase)

    def controller(time: float, state: BodyState) -> Array:
        position = state.configuration + ENCODER * generator.standard_normal(model.nv)
        if time > 0:
            share = 1 / (1 + LOW_PASS * RATE)
            seen["velocity"] += share * ((position - seen["position"]) * RATE - seen["velocity"])
        seen["position"] = position
        velocity, (q, v, a) = seen["velocity"], aim(time)
        push = STIFF**2 * (q - position) + 2 * STIFF * (v - velocity)
        torque = pin.rnea(model, data, position, velocity, a + push)
        if time > SETTLED:
            measured.append(q - state.configuration)
        return np.asarray(torque if compensate is None else torque + compensate(velocity, v))

    law = LawFriction(robot.joint_names, get_law(LAW), truth_of(robot))
    start, friction = np.zeros(model.nv), FrictionTruth(model.nv, [law])
    simulate_constrained(robot, controller, (), friction, configuration=start, duration=SECONDS)
    return {"error": 1e3 * float(np.sqrt(np.mean(np.square(measured))))}


def _made(kind: str, robot: Robot) -> Compensation | None:
    """Build a new compensation, which has its own state; None for no compensation."""
    if kind == "none":
        return None
    result = identified()
    if kind != "identified":
        result = with_truth(result, truth_of(robot), 1.0 if kind == "true" else 1.5)
    return compiled(result, robot)


def tables(rows: list[Row]) -> list[str]:
    """Format the table."""
    return [markdown_table(KINDS, [[f"{row['error']:.3g} mrad" for row in rows]], 0)]


if __name__ == "__main__":
    command(__doc__, [{"compensation": kind} for kind in KINDS], run, tables)
