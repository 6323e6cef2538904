"""The paper's ideal simulator (6.1): forward dynamics with the standing feet as rigid constraints, without noise.

    M a + h = S^T (tau - R) + J^T W,   J a + J' v = 0        (5.5)
    v_next = v + dt a,   q_next = q + dt v_next              Euler, 1 kHz

Each sample of the log is one step: position, velocity, acceleration, torque, friction torque and ground reaction
satisfy the equation of motion together, to rounding. Positions are integrated with the new velocity, so that their
second difference at sample k is the acceleration of sample k. With the old velocity, as in the paper, it is the
acceleration of sample k - 1, and friction from positions has an error of 0.1 N m instead of 0.01.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError, StribeckError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.simulation.friction import FrictionTruth, Instant
from stribeck.simulation.prescribed.exact import Truth
from stribeck.simulation.rigid.rigid_feet import RigidFeet

ITERATIONS = 4
"""Iterations of the friction's secant. Each reduces the error to a fifth; after four, the largest error is 0.2 %."""


@dataclass(frozen=True)
class Support:
    """Standing feet from `start` [s] until the next support of the schedule."""

    start: float
    feet: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class BodyState:
    """True state, the input of a controller.

    Attributes
    ----------
    configuration, velocity
        State of Pinocchio's tree, joints in the tree's order. A floating base comes first, with position and quaternion
        xyzw, and with linear and angular velocity in base coordinates.
    feet
        Standing feet.
    """

    configuration: Array
    velocity: Array
    feet: tuple[str, ...]


Controller = Callable[[float, BodyState], Array]
"""Function from time [s] and state to joint torques [N m], shape (n,), in the tree's order."""


def simulate_constrained(
    robot: Robot,
    controller: Controller,
    supports: Sequence[Support],
    friction: FrictionTruth,
    *,
    configuration: Array,
    duration: float,
    rate: float = 1000.0,
    paper_literal: bool = False,
) -> tuple[RobotLog, Truth]:
    """Build the exact log of a controlled robot on rigid feet, and its truth.

    Parameters
    ----------
    robot
        Robot; a fixed base has no supports.
    controller
        Controller, called once per step.
    supports
        Schedule of the standing feet, which are fixed to the ground.
    friction
        Friction of the joints; used for one run.
    configuration
        Initial configuration at rest, with the first standing feet flat on the ground.
    duration, rate
        Duration [s] and rate [Hz].
    paper_literal
        Use only the equations of the paper: forward Euler, friction as an explicit force, and no correction of feet.
        Steep friction on light links then chatters. Feet drift, and keep the tilt of their landing.

    Raises
    ------
    SettingsError
        If the schedule has an unknown foot, or its times do not increase from zero.
    StribeckError
        If the simulation diverges; the message says when.
    """
    _require_supports(robot, supports)
    model = pin.Model(robot.tree.model)
    feet = RigidFeet(robot, model, _ground(robot, supports, configuration), corrected=not paper_literal)
    step, samples = 1.0 / rate, round(duration * rate)
    body = _Body(robot, model, feet, friction, step, paper_literal)
    q, v, kept = configuration.copy(), np.zeros(model.nv), []
    for k in range(samples):
        v = feet.stand(_standing(supports, k * step), k * step, q, v)
        torque = np.asarray(controller(k * step, BodyState(q.copy(), v.copy(), feet.feet)), dtype=float)
        a, resisting = _accelerate(body, k * step, q, v, torque)
        if not np.isfinite(a).all():
            raise StribeckError(
                f"{robot.name}: the simulation diverges {k * step:.3f} s after the start; "
                f"expected a controller that is stable at {rate:g} Hz"
            )
        kept.append((q, v, a, torque, resisting, feet.standing(), feet.wrenches()))
        end = v + step * a
        q = pin.integrate(model, q, step * (v if paper_literal else end))
        v = feet.held(q, end)
    rows = _Rows(*map(np.array, zip(*kept, strict=True)))
    return _log(robot, model, rows, step), _truth(robot, rows, friction)


@dataclass(frozen=True, eq=False)
class _Body:
    """State of the simulation."""

    robot: Robot
    model: pin.Model
    feet: RigidFeet
    friction: FrictionTruth
    step: float  # [s]
    explicit: bool


def _accelerate(body: _Body, time: float, q: Array, v: Array, torque: Array) -> tuple[Array, Array]:
    """Compute acceleration, shape (nv,), and friction torque in the robot's order, shape (n,).

    Friction depends on the velocity in the middle of the step, u = v + dt a / 2, the difference of positions at this
    sample. With R = D u + c, the equation of motion is (M + dt D / 2) a + h = tau - D v - c + J^T W. The secant D is
    iterated.
    """
    columns, root, model = body.robot.tree.columns, body.robot.tree.root_size, body.model
    position, velocity, sensed = (_in_robot_order(x, columns) for x in (q[len(q) - len(columns) :], v[root:], torque))
    middle, rotor = velocity, np.array(model.armature)
    for _ in range(1 if body.explicit else ITERATIONS):
        now = Instant(time=time, step=body.step, position=position, velocity=middle, torque=sensed)
        damping, offset = body.friction.before(now)
        if body.explicit:
            damping, offset = np.zeros_like(damping), damping * velocity + offset
        effort = np.concatenate([np.zeros(root), torque - (damping * velocity + offset)[columns]])
        model.armature = rotor + body.step / 2 * np.concatenate([np.zeros(root), damping[columns]])
        a = body.feet.acceleration(q, v, effort)
        if not body.explicit:
            middle = velocity + body.step / 2 * _in_robot_order(a[root:], columns)
    model.armature = rotor
    return a, body.friction.after(middle)


class _Rows(NamedTuple):
    """Samples of a run, one per row; joints in the tree's order except for friction."""

    configuration: Array
    velocity: Array
    acceleration: Array
    torque: Array
    friction: Array
    contact: NDArray[np.bool_]
    wrench: Array


def _log(robot: Robot, model: pin.Model, rows: _Rows, step: float) -> RobotLog:
    columns, root = robot.tree.columns, robot.tree.root_size
    joints, floating = len(columns), robot.base == "floating"
    orientation, rate, force = _imu(robot, model, rows) if floating else (None, None, None)
    return RobotLog(
        time=np.arange(len(rows.torque), dtype=np.float64) * step,
        joint_names=robot.joint_names,
        position=_in_robot_order(rows.configuration[:, model.nq - joints :], columns),
        velocity=_in_robot_order(rows.velocity[:, root:], columns),
        acceleration=_in_robot_order(rows.acceleration[:, root:], columns),
        torque=_in_robot_order(rows.torque, columns),
        base_orientation=orientation,
        angular_velocity=rate,
        linear_acceleration=force,
        foot_names=tuple(robot.contacts),
        contact=rows.contact if floating else None,
        foot_wrench=rows.wrench if floating else None,
        torque_source=robot.torque_source,
    )


def _truth(robot: Robot, rows: _Rows, friction: FrictionTruth) -> Truth:
    base: dict[str, Array] = {}
    if robot.base == "floating":
        base = {"base_position": rows.configuration[:, :3], "base_orientation": rows.configuration[:, 3:7]}
        base |= {"base_velocity": rows.velocity[:, :6], "base_acceleration": rows.acceleration[:, :6]}
    return Truth(friction_torque=rows.friction, parameters=friction.parameters, **base)


def _imu(robot: Robot, model: pin.Model, rows: _Rows) -> tuple[Array, Array, Array]:
    """Compute orientation xyzw (T, 4), angular velocity and specific force (T, 3) of the base frame in its axes."""
    data, frame = model.createData(), model.getFrameId(robot.base_frame)
    orientation, rate, force = (np.empty((len(rows.torque), size)) for size in (4, 3, 3))
    local = pin.ReferenceFrame.LOCAL
    for k, (q, v, a) in enumerate(zip(rows.configuration, rows.velocity, rows.acceleration, strict=True)):
        pin.forwardKinematics(model, data, q, v, a)
        turn = pin.updateFramePlacement(model, data, frame).rotation
        orientation[k] = pin.Quaternion(turn).coeffs()
        rate[k] = pin.getFrameVelocity(model, data, frame, local).angular
        change = pin.getFrameClassicalAcceleration(model, data, frame, local).linear
        force[k] = change - turn.T @ robot.gravity
    return orientation, rate, force


def _in_robot_order(values: Array, columns: NDArray[np.int64]) -> Array:
    """Reorder joint values from the tree's order to the robot's; joints are the last axis."""
    result = np.empty_like(values)
    result[..., columns] = values
    return result


def _standing(supports: Sequence[Support], time: float) -> tuple[str, ...]:
    begun = [support for support in supports if support.start <= time + 1e-9]
    return begun[-1].feet if begun else ()


def _ground(robot: Robot, supports: Sequence[Support], configuration: Array) -> float:
    """Compute the height of the first standing feet [m]."""
    model, data = robot.tree.model, robot.tree.model.createData()
    pin.framesForwardKinematics(model, data, configuration)
    frames = [model.getFrameId(robot.contacts[foot].frame) for foot in _standing(supports, 0.0)]
    return float(np.mean([data.oMf[frame].translation[2] for frame in frames])) if frames else 0.0


def _require_supports(robot: Robot, supports: Sequence[Support]) -> None:
    """Reject unknown feet, and times that do not increase from zero."""
    for support in supports:
        for foot in support.feet:
            if foot not in robot.contacts:
                contacts = ", ".join(robot.contacts) or "none"
                raise SettingsError(f"supports: robot has no contact '{foot}'; it has {contacts}")
    times = [support.start for support in supports]
    if times and (times[0] != 0.0 or np.any(np.diff(times) <= 0)):
        raise SettingsError(
            f"supports: start times are {', '.join(map(str, times))}; expected 0.0 first and then rising"
        )
