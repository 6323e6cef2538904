"""Friction observer based on generalized momentum, sample by sample: for controllers, without accelerations.

The momentum p = M(q) v of the rooted tree changes by `p' = tau - R + b`, `b = C^T v - g` (`dynamics.momentum`). Over a
sample period h, with b and tau linear in it, the mean friction torque is

    R_mean = mean(tau + b) - (p_after - p_before) / h

and the observer, `R_est' = K (R - R_est)`, changes as for a friction that is constant over the period:

    R_est <- d R_est + (1 - d) R_mean,    d = exp(-K h),    K = 2 pi bandwidth

This is exact for the low-pass, and stable at every bandwidth, because 0 < d < 1: a bandwidth far above the sample rate
gives R_mean itself. Sources: A. De Luca, A. Albu-Schaeffer, S. Haddadin and G. Hirzinger, "Collision detection and safe
reaction with the DLR-III lightweight manipulator arm", IROS 2006; for friction, L. Le Tien, A. Albu-Schaeffer, A. De
Luca and G. Hirzinger, "Friction observer and compensation for control of robots with joint torque measurement", IROS
2008 (section 2.3 of the paper).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.loops import loop_terms, passive_response, without_loop_forces
from stribeck.core.dynamics.momentum import STEP, momentum_balance
from stribeck.core.dynamics.root_motion import ENOUGH_POINTS
from stribeck.core.dynamics.rooted import RootMotion, joint_inertia
from stribeck.core.dynamics.state import Orientation, State, root_quaternions
from stribeck.core.errors import LogError, SettingsError
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import RootedModel


def decay(bandwidth: ArrayLike, period: float) -> Array:
    """Compute the factor by which a first-order low-pass of a bandwidth [Hz] decays per sample period [s]."""
    return np.exp(-2 * np.pi * period * np.asarray(bandwidth, dtype=np.float64))


def loop_inertia(robot: Robot, rooted: RootedModel, position: Array) -> Array:
    """Compute G^T M G, shape (T, n, n), with zero rows and columns for passive joints; M without loops."""
    inertia = joint_inertia(rooted, position)
    if not robot.loops:
        return inertia
    half = without_loop_forces(robot, position, inertia).transpose(0, 2, 1)
    return without_loop_forces(robot, position, np.ascontiguousarray(half))


def loop_momentum_balance(
    robot: Robot, rooted: RootedModel, position: Array, velocity: Array, root: RootMotion | None = None
) -> tuple[Array, Array]:
    """Compute momentum and b of `momentum_balance` for a tree with closed loops: G^T p, and G^T b + G'^T p.

    Columns of passive joints are zero.
    """
    momentum, change = momentum_balance(rooted, position, velocity, root)
    if not robot.loops:
        return momentum, change
    after, before = (
        passive_response(robot, loop_terms(robot, position + step * velocity).jacobian) for step in (STEP, -STEP)
    )
    turning = np.einsum("tpi,tp->ti", (after - before) / (2 * STEP), momentum[:, robot.passive_columns])
    momentum, change = (without_loop_forces(robot, position, vector) for vector in (momentum, change))
    change[:, robot.independent] += turning
    return momentum, change


class _Instant(NamedTuple):
    """Sample: contact mode, joints whose friction is observable in it, and p, tau + b and v, shape (n,) each."""

    mode: ContactMode
    seen: BoolArray
    momentum: Array
    drive: Array
    velocity: Array


class MomentumObserver:
    """Estimates the friction torque of every joint from position, velocity and torque, sample by sample.

    The estimate is the low-pass filtered friction torque, and starts at zero. When the standing feet change, the tree
    and its momentum change too: the momentum starts anew and the estimate continues, because a joint's friction does
    not depend on the contacts. Joints whose torque depends on unknown foot wrenches (between several standing feet,
    above a point foot, all joints in flight) keep their estimate.

    Parameters
    ----------
    robot
        Robot model; the estimate of its position-controlled joints is NaN.
    period
        Sampling period [s].
    bandwidth
        -3 dB bandwidth of the low-pass [Hz]: one for all joints, or one per joint in robot order, shape (n,).

    Attributes
    ----------
    friction_torque
        Estimate R [N m], for prismatic joints [N], shape (n,).
    velocity
        Velocity after the same low-pass, shape (n,): a law of this velocity has the same lag as the estimate.

    Raises
    ------
    SettingsError
        If period or bandwidth are not positive and finite, or the number of bandwidths is wrong.

    Examples
    --------
    >>> observer = MomentumObserver(robot, period=0.001, bandwidth=20.0)
    >>> for position, velocity, torque in zip(log.position, log.velocity, log.torque, strict=True):
    ...     friction_torque = observer.update(position, velocity, torque)
    >>> friction_torque.shape
    (3,)
    """

    def __init__(self, robot: Robot, period: float, bandwidth: ArrayLike) -> None:
        joints = len(robot.joint_names)
        given = np.asarray(bandwidth, dtype=np.float64)
        if not 0 < period < np.inf:
            raise SettingsError(f"period is {period!r}; expected a positive number of seconds")
        if given.shape not in ((), (joints,)):
            raise SettingsError(
                f"bandwidth has shape {given.shape}; expected one number [Hz], or one per joint, ({joints},)"
            )
        if not (np.isfinite(given) & (given > 0)).all():
            raise SettingsError(f"bandwidth is {bandwidth!r}; expected positive numbers of hertz")
        self._robot, self._period, self._decay = robot, float(period), decay(given, period)
        self._before: _Instant | None = None
        self.friction_torque: Array = np.full(joints, np.nan)
        self.friction_torque[robot.torque_controlled] = 0.0
        self.velocity: Array = np.zeros(joints)

    def update(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        torque: ArrayLike,
        feet: Sequence[str] = (),
        base_orientation: ArrayLike | None = None,
        angular_velocity: ArrayLike | None = None,
    ) -> Array:
        """Process a sample, one period after the last one, and return the friction torque.

        Parameters
        ----------
        position, velocity, torque
            Joint signals in robot order [rad], [rad/s], [N m], shape (n,). Torques of position-controlled joints are
            not used. Add known external torques to the others.
        feet
            Names of the standing contacts of a floating base; empty in flight.
        base_orientation
            Quaternion xyzw of the robot's base frame, shape (4,), as in a log; without it, a standing sole counts as
            level.
        angular_velocity
            Angular velocity of the root link in its coordinates [rad/s], shape (3,); required with one or two point
            feet.

        Returns
        -------
        friction_torque
            R [N m], shape (n,), NaN for position-controlled joints.

        Raises
        ------
        LogError
            If a sample has a wrong shape or is not finite, a foot is unknown, or a signal that point feet require is
            missing. The observer does not change then.
        """
        now = self._make_instant(position, velocity, torque, tuple(feet), base_orientation, angular_velocity)
        before, self._before = self._before, now
        if now is not None and before is not None and set(before.mode.feet) == set(now.mode.feet):
            mean = (before.drive + now.drive) / 2 - (now.momentum - before.momentum) / self._period
            share = np.where(now.seen, 1 - self._decay, 0.0)
            self.friction_torque = self.friction_torque + share * (mean - self.friction_torque)
            self.velocity = self.velocity + share * ((before.velocity + now.velocity) / 2 - self.velocity)
        return self.friction_torque.copy()

    def _make_instant(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        torque: ArrayLike,
        feet: tuple[str, ...],
        base_orientation: ArrayLike | None,
        angular_velocity: ArrayLike | None,
    ) -> _Instant | None:
        """Check and convert a sample; None in flight."""
        robot, joints = self._robot, len(self._robot.joint_names)
        q, v = _check("position", position, (joints,)), _check("velocity", velocity, (joints,))
        if unknown := [foot for foot in feet if foot not in robot.contacts]:
            raise LogError(
                f"feet: found '{unknown[0]}', expected {', '.join(robot.contacts) or 'none on a fixed base'}"
            )
        effort = np.array(torque, dtype=np.float64)
        if effort.shape == (joints,):
            effort[[name in robot.position_controlled for name in robot.joint_names]] = 0.0
        effort = _check("torque", effort, (joints,))
        turn = None
        if base_orientation is not None:
            quaternion = _check("base_orientation", base_orientation, (4,))
            if not quaternion.any():
                raise LogError("base_orientation: found zeros, expected a quaternion x, y, z, w")
            omega = np.zeros(3) if angular_velocity is None else _check("angular_velocity", angular_velocity, (3,))
            turn = Orientation(root_quaternions(robot, q[None], quaternion[None]), omega[None], np.zeros((1, 3)))
        if robot.base == "floating" and feet:
            points = all(robot.contacts[foot].kind != "surface" for foot in feet)
            if points and len(feet) < ENOUGH_POINTS and angular_velocity is None:
                raise LogError(
                    f"{'+'.join(feet)}: up to two point feet leave the base rotation open; expected angular_velocity"
                )
        if robot.base == "floating" and not feet:
            return None
        mode = (self._before.mode if self._before else ContactMode(robot, ())).followed_by(feet)
        root = mode.root(State(q[None], v[None], np.zeros((1, joints)), turn))
        momentum, change = loop_momentum_balance(robot, mode.rooted, q[None], v[None], root)
        seen = ~mode.standing | (not mode.leaves_open)
        return _Instant(mode, seen, momentum[0], effort + change[0], v)


def _check(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Check the shape of an argument of `update`, and that it is finite."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape:
        raise LogError(f"{name}: found shape {array.shape}, expected {shape}")
    if not np.isfinite(array).all():
        place = int(np.argmin(np.isfinite(array)))
        raise LogError(f"{name}: found {array[place]} at place {place}, expected finite numbers")
    return array
