"""The generalised-momentum friction observer, sample by sample: for a controller, without accelerations.

The momentum p = M(q) v of the rooted tree changes by `p' = tau - R + b`, `b = C^T v - g` (`dynamics.momentum`). Over a
sample period h, with b and tau linear in it, the mean friction torque is

    R_mean = mean(tau + b) - (p_after - p_before) / h

and the observer, `R_est' = K (R - R_est)`, moves by as much as for a friction that is constant over the period:

    R_est <- d R_est + (1 - d) R_mean,    d = exp(-K h),    K = 2 pi bandwidth

That is exact for its low-pass, and stable at every bandwidth, as 0 < d < 1: a bandwidth far above the sample rate gives
R_mean itself. The observer is that of A. De Luca, A. Albu-Schaeffer, S. Haddadin and G. Hirzinger, "Collision detection
and safe reaction with the DLR-III lightweight manipulator arm", IROS 2006; for friction, L. Le Tien, A. Albu-Schaeffer,
A. De Luca and G. Hirzinger, "Friction observer and compensation for control of robots with joint torque measurement",
IROS 2008 (section 2.3 of the paper).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stribeck.base.typing import Array
from stribeck.dynamics.loops import loop_momentum_balance
from stribeck.dynamics.root_motion import ENOUGH_POINTS
from stribeck.dynamics.state import Orientation, State, root_quaternions
from stribeck.errors import LogError, SettingsError
from stribeck.friction_torque.contact_modes import StandingFeet, contact_root, leaves_open, next_mode
from stribeck.robot import Robot


def decay(bandwidth: ArrayLike, period: float) -> Array:
    """Return by what a first-order low-pass of a bandwidth [Hz] shrinks over a sample period [s]."""
    return np.exp(-2 * np.pi * period * np.asarray(bandwidth, dtype=np.float64))


class _Instant(NamedTuple):
    """A sample: the contact mode, the joints whose friction shows in it, and p, tau + b and v, shape (n,) each."""

    mode: StandingFeet
    seen: NDArray[np.bool_]
    momentum: Array
    drive: Array
    velocity: Array


class MomentumObserver:
    """Estimates the friction torque of every joint from position, velocity and torque, sample by sample.

    The estimate is the friction torque through a first-order low-pass of the bandwidth, and begins at zero. When other
    feet stand, the momentum begins anew, that of another tree across an impact, and the estimate is carried on: a
    joint's friction does not ask who stands. Where the wrenches on the feet leave a joint open (between several
    standing feet, above a point foot, all joints in flight), its estimate is held.

    Parameters
    ----------
    robot
        Its model, and which of its joints are position-controlled: those have NaN for an estimate.
    period
        Of the samples [s].
    bandwidth
        Of the low-pass, -3 dB [Hz]: one for all joints, or one a joint in the robot's order, shape (n,).

    Attributes
    ----------
    friction_torque
        The estimate R [N m], for prismatic joints [N], shape (n,).
    velocity
        Through the same low-pass, shape (n,): a law of this velocity lags as the estimate does.

    Raises
    ------
    SettingsError
        If period or bandwidth are not positive and finite, or there are not as many as joints.

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
                f"bandwidth has shape {given.shape}; expected one number [Hz], or one a joint, ({joints},)"
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
        """Take a sample, one period after the last one, and return the friction torque.

        Parameters
        ----------
        position, velocity, torque
            Of the joints, in the robot's order [rad], [rad/s], [N m], shape (n,); torques of position-controlled joints
            are not used. Known external torques are to be added to the others.
        feet
            Names of the contacts that stand, of a floating base; none in flight.
        base_orientation
            Quaternion xyzw of the robot's base frame, shape (4,), as a log has it; without it a standing sole is level.
        angular_velocity
            Of the root link, in its coordinates [rad/s], shape (3,); one or two point feet leave it open.

        Returns
        -------
        friction_torque
            R [N m], shape (n,), NaN for position-controlled joints.

        Raises
        ------
        LogError
            If a sample has another shape or is not finite, a foot is unknown, or what point feet leave open is
            missing. Nothing changes then.
        """
        now = self._instant(position, velocity, torque, tuple(feet), base_orientation, angular_velocity)
        before, self._before = self._before, now
        if now is not None and before is not None and set(before.mode.feet) == set(now.mode.feet):
            mean = (before.drive + now.drive) / 2 - (now.momentum - before.momentum) / self._period
            share = np.where(now.seen, 1 - self._decay, 0.0)
            self.friction_torque = self.friction_torque + share * (mean - self.friction_torque)
            self.velocity = self.velocity + share * ((before.velocity + now.velocity) / 2 - self.velocity)
        return self.friction_torque.copy()

    def _instant(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        torque: ArrayLike,
        feet: tuple[str, ...],
        base_orientation: ArrayLike | None,
        angular_velocity: ArrayLike | None,
    ) -> _Instant | None:
        """Return the sample, None in flight."""
        robot, joints = self._robot, len(self._robot.joint_names)
        q, v = _finite("position", position, (joints,)), _finite("velocity", velocity, (joints,))
        if unknown := [foot for foot in feet if foot not in robot.contacts]:
            raise LogError(
                f"feet: found '{unknown[0]}', expected {', '.join(robot.contacts) or 'none on a fixed base'}"
            )
        effort = np.array(torque, dtype=np.float64)
        if effort.shape == (joints,):
            effort[[name in robot.position_controlled for name in robot.joint_names]] = 0.0
        effort = _finite("torque", effort, (joints,))
        turn = None
        if base_orientation is not None:
            quaternion = _finite("base_orientation", base_orientation, (4,))
            if not quaternion.any():
                raise LogError("base_orientation: found zeros, expected a quaternion x, y, z, w")
            omega = np.zeros(3) if angular_velocity is None else _finite("angular_velocity", angular_velocity, (3,))
            turn = Orientation(root_quaternions(robot, q[None], quaternion[None]), omega[None], np.zeros((1, 3)))
        if robot.base == "floating" and feet:
            points = all(robot.contacts[foot].kind == "point" for foot in feet)
            if points and len(feet) < ENOUGH_POINTS and angular_velocity is None:
                raise LogError(
                    f"{'+'.join(feet)}: so few point feet leave the base's turning open; expected angular_velocity"
                )
        if robot.base == "floating" and not feet:
            return None
        mode = next_mode(self._before.mode if self._before else None, feet)
        rooted, root = contact_root(robot, mode, State(q[None], v[None], np.zeros((1, joints)), turn))
        momentum, change = loop_momentum_balance(robot, rooted, q[None], v[None], root)
        seen = ~robot.standing(feet) | (not leaves_open(robot, feet))
        return _Instant(mode, seen, momentum[0], effort + change[0], v)


def _finite(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return what `update` is given, checked."""
    found = np.asarray(values, dtype=np.float64)
    if found.shape != shape:
        raise LogError(f"{name}: found shape {found.shape}, expected {shape}")
    if not np.isfinite(found).all():
        place = int(np.argmin(np.isfinite(found)))
        raise LogError(f"{name}: found {found[place]} at place {place}, expected finite numbers")
    return found
