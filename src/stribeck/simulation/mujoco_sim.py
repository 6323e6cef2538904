"""The contact simulator: MuJoCo steps a robot on the ground, with friction taken implicitly at every step.

Friction enters each physics step as a damper that MuJoCo's implicit integrator takes at the end of the step, and an
applied torque; see `stribeck.simulation.friction_truth`.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from stribeck.log import Array
from stribeck.simulation.friction_truth import FrictionTruth
from stribeck.simulation.friction_truth import Instant as Beginning
from stribeck.simulation.mujoco_model import Body

_POSE = np.array([0, 1, 2, 4, 5, 6, 3])
"""MuJoCo's free joint has the quaternion as wxyz."""
_NEXT, _AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])


@dataclass(frozen=True, eq=False)
class _Views:
    """Parts of MuJoCo's data that change in place; looking them up costs more than using them."""

    position: Array
    velocity: Array
    force: Array
    damping: Array
    rotation: Array
    place: Array
    external: Array
    centre: Array


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The true state at one instant; joints in the tree's order.

    Attributes
    ----------
    configuration, velocity
        As Pinocchio has them for the rooted tree: base position, quaternion xyzw, joints; base velocity in the base's
        own coordinates, linear then angular, joints.
    specific_force
        Specific force of the base over the last control period, in the base's coordinates [m/s^2], shape (3,).
    friction_torque
        R in the last physics step [N m], shape (n,).
    """

    configuration: Array
    velocity: Array
    specific_force: Array
    friction_torque: Array


class MujocoSim:
    """A robot on the ground: it is given torques for one control period after another.

    Parameters
    ----------
    body
        The compiled robot.
    friction
        In its joints, in the tree's order.
    configuration
        To start from at rest, as Pinocchio has it for the rooted tree.
    control_period
        How long each torque is held [s], a multiple of the physics step.
    """

    def __init__(self, body: Body, friction: FrictionTruth, configuration: Array, control_period: float = 1e-3):
        self.body, self.friction = body, friction
        self.substeps = round(control_period / body.model.opt.timestep)
        self.period = control_period
        self.data = mujoco.MjData(body.model)
        self.data.qpos[:7] = configuration[[0, 1, 2, 6, 3, 4, 5]]
        self.data.qpos[body.position_index] = configuration[7:]
        self._resisting = np.zeros(len(configuration) - 7)
        self._last_velocity = np.zeros(3)
        mujoco.mj_forward(body.model, self.data)
        data, root = self.data, int(body.model.body_rootid[body.feet[0]])
        self._views = _Views(
            data.qpos,
            data.qvel,
            data.qfrc_applied,
            body.model.dof_damping,
            data.xmat,
            data.xpos,
            data.cfrc_ext,
            data.subtree_com[root],
        )
        self._contact_rotation = np.array([rotation for rotation, _ in body.contact_poses])
        self._contact_translation = np.array([translation for _, translation in body.contact_poses])[:, :, None]
        self._gravity = body.model.opt.gravity.copy()

    def advance(self, torque: Array, push: Array | None = None) -> tuple[Array, Array, Array]:
        """Hold joint torques for one control period.

        Parameters
        ----------
        torque
            Asked for, shape (n,) [N m]; what exceeds a joint's limit is cut.
        push
            Force on the base in the world [N], shape (3,).

        Returns
        -------
        applied
            Torques that acted [N m], shape (n,).
        first, last
            Foot wrenches of the first and the last physics step, shape (feet, 6).
        """
        model, data, views = self.body.model, self.data, self._views
        index, limit, step = self.body.velocity_index, self.body.torque_limit, float(model.opt.timestep)
        applied = np.minimum(np.maximum(torque, -limit), limit)
        if push is not None:
            data.xfrc_applied[1, :3] = push
        self._last_velocity = views.velocity[:3].copy()
        velocity = views.velocity[index]
        first = last = np.zeros((0, 6))
        for k in range(self.substeps):
            position = views.position[self.body.position_index]
            beginning = Beginning(time=data.time, step=step, position=position, velocity=velocity, torque=applied)
            slope, offset = self.friction.before(beginning)
            views.damping[index] = slope
            views.force[index] = applied - offset
            mujoco.mj_step(model, data)
            velocity = views.velocity[index]
            self._resisting = self.friction.after(velocity)
            if k == 0:
                first = self._foot_wrenches()
        last = self._foot_wrenches() if self.substeps > 1 else first
        return applied, first, last

    def now(self) -> Snapshot:
        """Return the state now."""
        views = self._views
        configuration = np.empty(7 + len(self.body.position_index))
        configuration[:7] = views.position[_POSE]
        configuration[7:] = views.position[self.body.position_index]
        rotation = pin.Quaternion(configuration[3:7]).toRotationMatrix()
        linear = views.velocity[:3]
        velocity = np.empty(len(configuration) - 1)
        velocity[:3], velocity[3:6] = linear @ rotation, views.velocity[3:6]
        velocity[6:] = views.velocity[self.body.velocity_index]
        force = (linear - self._last_velocity) / self.period - self._gravity
        return Snapshot(configuration, velocity, force @ rotation, self._resisting)

    def _foot_wrenches(self) -> Array:
        """Return what the ground did to each foot in the last step, in the contact's frame, shape (feet, 6)."""
        mujoco.mj_rnePostConstraint(self.body.model, self.data)
        feet, views = self.body.feet, self._views
        turn = views.rotation[feet].reshape(-1, 3, 3)
        place = views.place[feet] + (turn @ self._contact_translation)[:, :, 0]
        external = views.external[feet]  # moment about the robot's centre of mass, then force, in the world
        arm, force = views.centre - place, external[:, 3:]
        dyad = arm[:, :, None] * force[:, None, :]
        moment = external[:, :3] + dyad[:, _NEXT, _AFTER] - dyad[:, _AFTER, _NEXT]
        world = turn @ self._contact_rotation
        return np.asarray((np.stack([force, moment], axis=1) @ world).reshape(-1, 6))
