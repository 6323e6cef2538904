"""Contact modes: which rows of the equation of motion are used, and their projection (docs/estimator.md, equation 4).

On one standing surface the tree is rooted there, and every joint has an equation of its own. With more feet, or on
points, unknown contact forces act through their Jacobian J on the rows that are used, and only the sums P^T with J P =
0 are free of them: P = null(J) (Aghili 2005; Mistry, Buchli and Schaal 2010). In flight no force acts, but the root's
acceleration is unknown: it takes the place of the forces, and the inertia matrix's columns of the root that of J^T.
Joints without a measured torque are left out of the rows, so that no sum needs them.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from stribeck.base.typing import Array
from stribeck.dynamics.loops import without_loop_forces
from stribeck.dynamics.root_motion import ENOUGH_POINTS, base_root, flying_root, standing_root
from stribeck.dynamics.rooted import RootMotion, inertia_matrix, rooted_inverse_dynamics
from stribeck.dynamics.state import State
from stribeck.robot import Robot
from stribeck.robot.rooting import RootedModel

RANK = 1e-6
"""Singular values below this share of the largest [1] are of feet that constrain the same twice."""


@dataclass(frozen=True, eq=False)
class ContactMode:
    """A tree and its contacts.

    Attributes
    ----------
    robot, rooted
        The robot, and its tree with the root that suits this contact mode.
    foot
        The surface that the tree is rooted at; "" for the robot's own root.
    feet
        Contacts whose unknown forces act on the rows.
    joints
        Columns of the joints that are used, shape (n,).
    sensed
        Whether the wrench on `foot` is measured, so that the root's own six rows are used too.
    """

    robot: Robot
    rooted: RootedModel
    foot: str
    feet: tuple[str, ...]
    joints: NDArray[np.int64]
    sensed: bool = False

    @property
    def flies(self) -> bool:
        """Whether nothing stands, so that the root's acceleration follows from the joints'."""
        return self.rooted.floating and not self.foot and not self.feet

    @property
    def rows(self) -> NDArray[np.int64]:
        """Rows of the equation of motion: the root's six, if free or sensed, the joints'; as in `inertia_matrix`."""
        own = np.arange(self.rooted.root_size) if self.sensed or not self.foot else np.arange(0)
        return np.concatenate([own, self.rooted.root_size + self.joints])

    def root(self, state: State) -> RootMotion | None:
        """Return how the root moves."""
        if not self.rooted.floating:
            return None
        if self.flies:
            return flying_root(self.rooted, state)
        return standing_root(self.robot, self.foot, state) if self.foot else base_root(self.robot, self.feet, state)

    def left_side(self, state: State, torque: Array, measured: Array | None) -> Array:
        """Return torque less inverse dynamics in all rows, contact forces still in it, shape (T, rows).

        `measured` is the wrench on a foot that is sensed, shape (T, 6).
        """
        motion = state.position, state.velocity, state.acceleration
        wrench, needed = rooted_inverse_dynamics(self.rooted, *motion, self.root(state))
        joints = without_loop_forces(self.robot, state.position, torque - needed)[:, self.joints]
        if measured is not None:
            return np.hstack([measured - wrench, joints])
        return joints if self.foot or not self.rooted.floating else np.hstack([-wrench, joints])

    def used(self, position: Array, of_all: Array) -> Array:
        """Return the rows that are used of those of the root and all joints, shape (K, r + n, c) -> (K, rows, c).

        Forces of closed chains are taken out on the way (`robot.loops`).
        """
        if self.robot.loops:
            size = self.rooted.root_size
            joints = without_loop_forces(self.robot, position, of_all[:, size:])
            of_all = np.concatenate([of_all[:, :size], joints], axis=1)
        return np.asarray(of_all[:, self.rows])

    def jacobian(self, position: Array) -> Array:
        """Return the Jacobian of the feet, foot by foot in its own frame, shape (T, c, 6 + all joints)."""
        model, data, frames = _workspace(self)
        order = np.concatenate([np.arange(6), 6 + np.argsort(self.rooted.columns)])
        configuration = pin.neutral(model)
        found = np.empty((len(position), sum(size for _, size in frames), model.nv))
        for k, row in enumerate(position):  # Pinocchio has no batched call for it
            configuration[7:] = row[self.rooted.columns]
            pin.computeJointJacobians(model, data, configuration)
            pin.updateFramePlacements(model, data)
            parts = [pin.getFrameJacobian(model, data, frame, pin.LOCAL)[:size] for frame, size in frames]
            found[k] = np.vstack(parts)
        return found[:, :, order]

    def unknowns(self, position: Array, jacobian: Array | None) -> Array | None:
        """Return what unknown forces, or accelerations of a flying root, do to the rows, shape (K, u, rows), if any."""
        if self.flies:
            jacobian = inertia_matrix(self.rooted, position)[:, :6]
        if jacobian is None or not self.robot.loops:
            return None if jacobian is None else jacobian[:, :, self.rows]
        return self.used(position, jacobian.transpose(0, 2, 1)).transpose(0, 2, 1)

    def responses(self, position: Array, jacobian: Array | None) -> tuple[Array, Array]:
        """Return the response of the rows to errors of joint and root accelerations, (K, rows, n), (K, rows, 6 or 0).

        A root that does not itself stand moves as the joints and the standing points make it.
        """
        inertia = self.used(position, inertia_matrix(self.rooted, position))
        size = self.rooted.root_size
        encoder, root = inertia[:, :, size:], inertia[:, :, :size]
        if jacobian is not None and not self.foot:
            encoder = encoder + root @ _root_from_joints(jacobian)
        return encoder, root


def find_contact_mode(
    robot: Robot, feet: tuple[str, ...], joints: NDArray[np.int64], sensed: Collection[str] = ()
) -> ContactMode:
    """Return the contact mode of standing feet, of which some are `sensed`; none stand with a fixed base."""
    if robot.base == "fixed":
        return ContactMode(robot, robot.tree, "", (), joints)
    surface = next((foot for foot in feet if robot.contacts[foot].kind == "surface"), "")
    rooted = robot.rooted_at(surface) if surface else robot.tree
    others = tuple(foot for foot in feet if foot != surface)
    return ContactMode(robot, rooted, surface, others, joints, not others and surface in sensed)


@cache
def _workspace(mode: ContactMode) -> tuple[pin.Model, pin.Data, tuple[tuple[int, int], ...]]:
    model, contacts = mode.rooted.model, mode.robot.contacts
    frames = tuple((int(model.getFrameId(contacts[foot].frame)), contacts[foot].size) for foot in mode.feet)
    return model, model.createData(), frames


def _root_from_joints(jacobian: Array) -> Array:
    """Return the root's acceleration by the joints' that keeps points where they are, shape (K, 6, n).

    One or two points leave turns open, which the base orientation gives: they do not depend on the joints then.
    """
    root, joints = jacobian[:, :, :6], jacobian[:, :, 6:]
    if jacobian.shape[1] >= 3 * ENOUGH_POINTS:
        return np.asarray(-np.linalg.pinv(root) @ joints)
    found = np.zeros((len(jacobian), 6, joints.shape[2]))
    found[:, :3] = -np.linalg.pinv(root[:, :, :3]) @ joints
    return found


def sees_friction(mode: ContactMode) -> bool:
    """Return whether fewer forces act on the rows than there are rows."""
    forces = sum(mode.robot.contacts[foot].size for foot in mode.feet)
    return len(mode.rows) > forces


def null_projection(jacobian: Array) -> Array:
    """Return P^T with orthonormal rows and J P = 0, shape (K, rows - rank, rows), from J, shape (K, c, rows).

    All samples get as many rows as the one of the largest rank.
    """
    _, values, right = np.linalg.svd(jacobian, full_matrices=True)
    rank = int((values > RANK * values[:, :1]).sum(axis=1).max())
    return np.asarray(right[:, rank:])


def without_contact_forces(left: Array, jacobian: Array) -> Array:
    """Return rows, shape (T, rows), less the contact forces that explain most of them, r - J^T (J^T)^+ r.

    It leaves P^T of the same sample as it is, and makes that of neighbouring samples nearly free of contact forces too.
    """
    forces = np.linalg.pinv(jacobian.transpose(0, 2, 1)) @ left[:, :, None]
    return np.asarray(left - (jacobian.transpose(0, 2, 1) @ forces)[:, :, 0])


def at_every_row(at_centres: Array, first: int, step: int, rows: int) -> Array:
    """Return smooth matrices at every row of a segment from those at windows' centres, the first at row `first`."""
    if len(at_centres) == 1:
        return np.broadcast_to(at_centres, (rows, *at_centres.shape[1:]))
    place = (np.arange(rows) - first) / step
    before = np.clip(np.floor(place).astype(int), 0, len(at_centres) - 2)
    share = (place - before).reshape(-1, *[1] * (at_centres.ndim - 1))
    return np.asarray((1 - share) * at_centres[before] + share * at_centres[before + 1])
