"""The contact simulator: MuJoCo simulates a robot on the ground, with implicit friction in every step.

Friction depends on the velocity in the middle of a physics step, `R = D (v + v_next) / 2 + c`. Half of D is a damper in
MuJoCo's implicit integrator, the rest is an applied torque; see `stribeck.simulation.friction`. D is the secant at the
predicted middle velocity. With the secant at v, `D v_next` would exceed R(v) by the share `a dt / v` while a joint
accelerates, and would be too small while it decelerates. Coriolis and centrifugal torques also use the middle velocity:
MuJoCo computes them at the start of the step, and this lag would look like viscous friction.
"""

from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array
from stribeck.simulation.friction import FrictionTruth, Instant
from stribeck.simulation.mujoco.model import Body
from stribeck.simulation.span import span

_POSE = np.array([0, 1, 2, 4, 5, 6, 3])
"""Indices that convert a free joint's wxyz quaternion in MuJoCo to xyzw."""
TOUCH = 21
"""Values per foot: moment about the robot's center of mass, force, foot position, center of mass, foot rotation."""
VERTICAL_FORCE = 5
"""Index of the vertical force in these values."""


class _Views(NamedTuple):
    """Views of MuJoCo's data, stored because their lookup is slower than their use."""

    position: Array
    velocity: Array
    force: Array
    bias: Array
    damping: Array
    rotation: Array
    place: Array
    external: Array
    centre: Array


class Snapshot(NamedTuple):
    """True state at one instant; joints in the tree's order.

    MuJoCo integrates positions with the new velocity, which makes them half a physics step later than the velocity.
    Here, positions are shifted back to the instant of the velocity, between the accelerations of two steps.

    Attributes
    ----------
    configuration, velocity
        State of Pinocchio's rooted tree: base position, quaternion xyzw, joints; linear and angular velocity of the
        base in base coordinates, joint velocities.
    specific_force
        Specific force of the base over the last period, in the base's coordinates [m/s^2], shape (3,).
    friction_torque
        Friction torque R in the last physics step [N m], shape (n,).
    """

    configuration: Array
    velocity: Array
    specific_force: Array
    friction_torque: Array


class MujocoSim:
    """A robot on the ground with constant torques during each period.

    Parameters
    ----------
    body
        The compiled robot.
    friction
        Friction of its joints in the tree's order.
    configuration
        Initial configuration of Pinocchio's rooted tree, at rest.
    period
        Duration of constant torque [s], a multiple of the physics step.
    """

    def __init__(self, body: Body, friction: FrictionTruth, configuration: Array, period: float = 1e-3):
        self.body, self.friction = body, friction
        self.substeps = round(period / body.model.opt.timestep)
        self.period = period
        self.data = mujoco.MjData(body.model)
        self._positions, self._velocities = span(body.position_index), span(body.velocity_index)
        self.data.qpos[:7] = configuration[[0, 1, 2, 6, 3, 4, 5]]
        self.data.qpos[body.position_index] = configuration[7:]
        self._resisting = np.zeros(len(configuration) - 7)
        self._last_velocity = np.zeros(3)
        self._change = np.zeros(body.model.nv)
        self._bias = np.zeros(body.model.nv)
        mujoco.mj_forward(body.model, self.data)
        data, root = self.data, int(body.model.body_rootid[body.feet[0]])
        self._views = _Views(
            data.qpos,
            data.qvel,
            data.qfrc_applied,
            data.qfrc_bias,
            body.model.dof_damping,
            data.xmat,
            data.xpos,
            data.cfrc_ext,
            data.subtree_com[root],
        )
        self._gravity = body.model.opt.gravity.copy()

    def advance(self, torque: Array, push: Array | None = None) -> tuple[Array, Array, Array]:
        """Hold joint torques for one period.

        Parameters
        ----------
        torque
            Desired torques, shape (n,) [N m]; clipped to the joints' limits.
        push
            Force on the base in the world [N], shape (3,).

        Returns
        -------
        applied
            Applied torques [N m], shape (n,).
        first, last
            Contact forces on the feet in the first and the last physics step, input of `foot_wrenches`.
        """
        model, data, views = self.body.model, self.data, self._views
        index, limit, step = self._velocities, self.body.torque_limit, float(model.opt.timestep)
        applied = np.minimum(np.maximum(torque, -limit), limit)
        if push is not None:
            data.xfrc_applied[1, :3] = push
        self._last_velocity = views.velocity[:3].copy()
        velocity = views.velocity.copy()
        first = last = np.zeros((0, TOUCH))
        for k in range(self.substeps):
            middle = velocity + 0.5 * self._change
            beginning = Instant(data.time, step, views.position[self._positions], middle[index], applied)
            slope, offset = self.friction.before(beginning)
            half = 0.5 * slope
            views.damping[index], views.force[index] = half, applied - offset - half * velocity[index]
            self._step(velocity, middle)
            end = views.velocity.copy()
            self._resisting = self.friction.after(0.5 * (velocity + end)[index])
            self._change, velocity = end - velocity, end
            if k == 0:
                first = self._touch()
        last = self._touch() if self.substeps > 1 else first
        return applied, first, last

    def _step(self, velocity: Array, middle: Array) -> None:
        """Make a physics step from a velocity, with Coriolis and centrifugal torques at the middle velocity."""
        model, data, views = self.body.model, self.data, self._views
        mujoco.mj_step1(model, data)
        views.velocity[:] = middle
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._bias)
        views.velocity[:] = velocity
        mujoco.mj_comVel(model, data)
        views.bias[:] = self._bias
        mujoco.mj_step2(model, data)

    def now(self) -> Snapshot:
        """Return the present state."""
        views = self._views
        linear, joints = views.velocity[:3], views.velocity[self._velocities]
        ahead = 0.5 * float(self.body.model.opt.timestep)
        spin, pose = views.velocity[3:6].copy(), views.position[_POSE]
        turn = pin.Quaternion(pose[3:]) * pin.Quaternion(pin.exp3(-ahead * spin))
        joint_positions = views.position[self._positions] - ahead * joints
        configuration = np.concatenate([pose[:3] - ahead * linear, turn.coeffs(), joint_positions])
        rotation = turn.toRotationMatrix()
        velocity = np.concatenate([linear @ rotation, spin, joints])
        force = (linear - self._last_velocity) / self.period - self._gravity
        return Snapshot(configuration, velocity, force @ rotation, self._resisting)

    def _touch(self) -> Array:
        """Collect MuJoCo's contact forces on the feet in the last step, shape (feet, `TOUCH`)."""
        mujoco.mj_rnePostConstraint(self.body.model, self.data)
        feet, views = self.body.feet, self._views
        touch = np.empty((len(feet), TOUCH))
        touch[:, :6] = views.external[feet]
        touch[:, 6:9] = views.place[feet]
        touch[:, 9:12] = views.centre
        touch[:, 12:] = views.rotation[feet]
        return touch


def foot_wrenches(body: Body, touch: Array) -> Array:
    """Compute force and moment of the ground on each foot in its contact's frame.

    Parameters
    ----------
    body
        The robot.
    touch
        Contact forces from `MujocoSim.advance`, of one or many steps, shape (..., feet, `TOUCH`).

    Returns
    -------
    wrenches
        Forces [N] and moments [N m], shape (..., feet, 6).
    """
    rotation = np.array([rotation for rotation, _ in body.contact_poses])
    translation = np.array([translation for _, translation in body.contact_poses])
    turn = touch[..., 12:].reshape(*touch.shape[:-1], 3, 3)
    place = touch[..., 6:9] + (turn @ translation[:, :, None])[..., 0]
    force = touch[..., VERTICAL_FORCE - 2 : VERTICAL_FORCE + 1]
    moment = touch[..., :3] + np.cross(touch[..., 9:12] - place, force)
    world = turn @ rotation
    return np.concatenate([(vector[..., None, :] @ world)[..., 0, :] for vector in (force, moment)], axis=-1)
