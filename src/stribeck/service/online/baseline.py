"""Identified friction of all joints at once, as the baseline of a robot in service."""

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.errors import SettingsError
from stribeck.core.friction import LawWithState, Stribeck, get_law
from stribeck.core.friction.auto import JUMP
from stribeck.core.friction.terms import BEYOND_VELOCITY, LADDER
from stribeck.core.friction.terms.motion import beyond_velocity, signals
from stribeck.core.result import JointResult, Result
from stribeck.core.result.bodies import with_bodies
from stribeck.core.result.law_values import law_values
from stribeck.core.robot import Robot


class Baseline:
    """Friction of a result, for the joints of a robot that have some.

    Attributes
    ----------
    columns
        Robot columns of the n tracked joints, shape (n,).
    sure
        Joints whose friction is identified, not weak, shape (n,); only these raise alarms.
    names
        Names of the tracked joints.
    level, speed
        Friction at middle speed [N m], [N], and this speed [rad/s], [m/s], shape (n,).
    speeds
        Slow, middle and top speed, shape (3, n).
    spread
        Standard deviation of friction from log to log relative to `level`, shape (n,).
    own_error
        Standard error of the friction at `speeds` relative to its value, shape (3, n).
    viscous_share
        Share of viscous friction at middle speed [1], shape (n,).

    Raises
    ------
    SettingsError
        If the robot does not have the result's joints, or no joint has friction in N m or N.
    """

    def __init__(self, result: Result, robot: Robot) -> None:
        if strange := [name for name in result.joints if name not in robot.joint_names]:
            raise SettingsError(
                f"{result.path or 'result'}: joint '{strange[0]}' is no joint of {robot.name}; expected a result "
                "of this robot"
            )
        coupled = set().union(*(coupling.joints for coupling in result.couplings.values()))
        results = {name: joint for name, joint in result.joints.items() if _is_tracked(joint) and name not in coupled}
        if not results:
            raise SettingsError(
                f"{result.path or 'result'}: no joint has friction in N m or N; expected an identified joint"
            )
        self.names = tuple(results)
        self.columns: IntArray = np.array([robot.joint_names.index(name) for name in results])
        joints = list(results.values())
        self.sure = np.array([joint.verdict == "identified" for joint in joints])
        curve = np.array([[(p.velocity, p.value, p.standard_error) for p in joint.curve] for joint in joints])
        self.speeds, values, errors = np.maximum(curve.transpose(2, 1, 0), 1e-9)
        self.level, self.speed, self.own_error = values[1], self.speeds[1], errors / values
        spreads = [max(point.between_logs for point in joint.curve) for joint in joints]
        self.spread = np.clip(np.hypot(spreads, self.own_error[1]), 0.02, 0.5)  # bounds of the spread [1]
        viscous = np.array([joint.values.get("viscous", 0.0) for joint in joints])
        self.viscous_share = np.clip(viscous * self.speed / self.level, 0.0, 1.0)
        self.offset = np.array([joint.values.get("offset", 0.0) for joint in joints])
        self.residual = np.array([_residual(joint) for joint in joints]) / self.level
        self.mean_temperature = np.array([np.nan_to_num(joint.mean_temperature or 0.0) for joint in joints])
        self._law = get_law(result.law)
        parts = [law_values(self._law, {**joint.values, "offset": 0.0}) for joint in joints]
        self._values = np.column_stack([part for part in parts if part is not None])
        names = set[str]().union(*(joint.values for joint in joints))
        self._beyond = {  # missing parameters are zero, but a missing slope is a sharp sign
            name: np.array([joint.values.get(name, JUMP if name == "slope" else 0.0) for joint in joints])
            for name in names
        }
        settings = (name for term in LADDER for name in term.settings)
        self._settings = {name: np.array([getattr(joint, name) or 0.0 for joint in joints]) for name in settings}
        self._direction = np.array([joint.mean_direction or (np.nan, np.nan) for joint in joints]).T
        self._range = np.array([joint.position_range or (-np.inf, np.inf) for joint in joints]).T

    def friction(self, velocity: Array, position: Array, torque: Array, warmer: Array | float = 0.0) -> Array:
        """Compute the friction torque without offset, shape (T, n), from signals of the same shape.

        `warmer` is the temperature minus the mean temperature of the joint's log [K].
        """
        if isinstance(self._law, Stribeck) and not isinstance(self._law, LawWithState):
            friction = self._law.torque(velocity, self._values[:, None])
        else:  # other laws may not broadcast over joints
            pairs = zip(velocity.T, self._values.T, strict=True)
            friction = np.column_stack([self._law.torque(v, values) for v, values in pairs])
        if self._beyond.keys().isdisjoint(parameter.name for parameter in BEYOND_VELOCITY):
            return np.asarray(friction)
        places = position, self._range, self._direction
        motion = signals(velocity, self._beyond.get("slope", JUMP), *places, load=torque - friction, temperature=warmer)
        return np.asarray(friction + beyond_velocity(self._beyond, motion | self._settings))


def _is_tracked(joint: JointResult) -> bool:
    """Check whether a joint has friction in N m or N whose change can be observed."""
    enough = joint.verdict in ("identified", "weak") and len(joint.curve) == 3 and joint.torque_unit is None
    return enough and min(point.value for point in joint.curve) > 0


def _residual(joint: JointResult) -> float:
    """Find the torque that the joint's friction does not explain [N m], [N]."""
    known = joint.residual_rms or (joint.validation.rms if joint.validation else None)
    return known or joint.curve[1].value


def with_estimates(robot: Robot, result: Result) -> Robot:
    """Replace bodies and armatures of a robot by the estimates of a result.

    Raises
    ------
    SettingsError
        If the corrections belong to another model.
    """
    robot = with_bodies(robot, result.corrections)
    model = robot.tree.model
    armature = np.array(model.armature)
    for name, joint in result.joints.items():
        if "armature" in joint.parameters:
            armature[model.joints[model.getJointId(name)].idx_v] = joint.parameters["armature"].value
    model.armature = armature
    return robot
