"""Contact modes: which rows of the equation of motion are used, and their projection (equation 4, docs/estimator.md).

On one standing surface the tree is rooted there, and every joint has its own equation. With more feet, or on points,
unknown contact forces act through their Jacobian J on the rows, and only the sums P^T with J P = 0 are free of them:
P = null(J) (Aghili 2005; Mistry, Buchli and Schaal 2010). Wheels of a known radius roll like balls; their tires are
wide, so that the moment about their heading is unknown, too. In flight no force acts, but the root's acceleration is
unknown: it takes the place of the forces, and the inertia matrix's columns of the root take the place of J^T. Rows
contain no joints without a measured torque, so that no sum needs them.

Contact forces do not act on the rows of joints that are not between the base and a standing foot, such as the arms.
On several soles, only these rows are used, unless `double_support` is "fit". The same rows serve a robot that hangs or
rolls on other wheels: an unknown wrench on its base acts on none of them. Its linear acceleration is unknown, too,
because feet rock and gantries swing, and without a gyroscope also the angular one, if there are many rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.loops import without_loop_forces
from stribeck.core.dynamics.rooted import inertia_matrix, rooted_inverse_dynamics, workspace
from stribeck.core.dynamics.state import State
from stribeck.core.equations.friction_torque.inverse_dynamics import uses_orientation
from stribeck.core.equations.whole_log.segments import Segment
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings

ROWS_PER_UNKNOWN = 2
"""Number of rows per unknown acceleration of the base [1] that can spare it."""
ENOUGH = 0.1
"""Share of a log [1] in modes that have the rows of all joints, above which other modes are not used."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ModeRows(ContactMode):
    """A contact mode with the rows of its equations that are used.

    Attributes
    ----------
    joints
        Columns of the joints that are used, shape (n,).
    with_rows
        Whether the row of each of these joints is used, shape (n,).
    loaded
        Contacts whose unknown forces act on the rows.
    sensor
        Number of the wrench sensor on the surface, if the wrench is used: the root's own six rows are used too then.
    """

    joints: IntArray
    with_rows: BoolArray
    loaded: tuple[str, ...] = ()
    sensor: int | None = None

    @property
    def forces(self) -> int:
        """Number of unknown forces and moments on the rows, or of unknown accelerations of a hung root."""
        if self.hung:
            return 3 if self.gyroscope or self.with_rows.sum() < ROWS_PER_UNKNOWN * 6 else 6
        contacts = [self.robot.contacts[foot] for foot in self.loaded]
        return sum(contact.size + bool(contact.axle) for contact in contacts)

    @property
    def sums(self) -> int:
        """Number of sums of rows without unknown forces and accelerations."""
        unknown = 6 * self.flies + self.forces + 3 * self.slides
        return len(self.rows) - unknown

    @property
    def slides(self) -> bool:
        """Whether the base stands on points only, which slip: its linear acceleration is unknown."""
        return bool(self.loaded) and not self.surface

    @property
    def rows(self) -> IntArray:
        """Rows of the equation of motion: the root's six, if free or sensed, the joints'; as in `inertia_matrix`."""
        without = self.hung or (self.surface and self.sensor is None)
        root_rows = np.arange(0 if without else self.rooted.root_size)
        return np.concatenate([root_rows, self.rooted.root_size + self.joints[self.with_rows]])

    def on_rows(self, on_joints: Array) -> Array:
        """Select the effects on the used rows from effects on the joints, shape (n, c) -> (rows, c)."""
        effects = on_joints[self.with_rows]
        return np.vstack([np.zeros((len(self.rows) - len(effects), effects.shape[1])), effects])

    def left_side(self, state: State, torque: Array, measured: Array | None) -> Array:
        """Compute torque minus inverse dynamics in all rows, contact forces still in it, shape (T, rows).

        `measured` is the wrench on a foot with a sensor, shape (T, 6).
        """
        motion = state.position, state.velocity, state.acceleration
        wrench, needed = rooted_inverse_dynamics(self.rooted, *motion, self.root(state))
        joints = without_loop_forces(self.robot, state.position, torque - needed)[:, self.joints[self.with_rows]]
        if measured is not None:
            return np.hstack([measured - wrench, joints])
        free = not self.surface and not self.hung and self.rooted.floating
        return np.hstack([-wrench, joints]) if free else joints

    def used(self, position: Array, of_all: Array) -> Array:
        """Select the used rows from the rows of the root and all joints, shape (K, r + n, c) -> (K, rows, c).

        Forces of closed chains are removed first (`robot.loops`).
        """
        if self.robot.loops:
            size = self.rooted.root_size
            joints = without_loop_forces(self.robot, position, of_all[:, size:])
            of_all = np.concatenate([of_all[:, :size], joints], axis=1)
        return np.asarray(of_all[:, self.rows])

    def jacobian(self, position: Array, up: Array | None = None) -> Array:
        """Compute the Jacobian of the feet, foot by foot in its own frame, shape (T, c, 6 + all joints).

        Balls and wheels touch the ground below their center. `up` is the upward direction in the root link, shape
        (T, 3); without it, the root link is level.
        """
        (model, data), contacts = workspace(self.rooted), [self.robot.contacts[foot] for foot in self.loaded]
        frames = [(model.getFrameId(contact.frame), contact, np.array(contact.axle)) for contact in contacts]
        up = np.tile(self.robot.up, (len(position), 1)) if up is None else up
        configuration = np.tile(pin.neutral(model), (len(position), 1))
        configuration[:, 7:] = position[:, self.rooted.columns]
        jacobians = np.empty((len(position), self.forces, model.nv))
        for stack, row, above in zip(jacobians, configuration, up, strict=True):  # Pinocchio has no batched call for it
            pin.computeJointJacobians(model, data, row)
            rows = []
            for frame, contact, axle in frames:
                jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL)
                if contact.radius:
                    local = pin.updateFramePlacement(model, data, frame).rotation.T @ above
                    jacobian[:3] += contact.radius * pin.skew(local) @ jacobian[3:]
                rows.append(jacobian[: contact.size])
                if contact.axle:  # the moment about the heading
                    heading = np.cross(axle, local)
                    rows.append(heading[None] / np.linalg.norm(heading) @ jacobian[3:])
            stack[:] = np.vstack(rows)
        return jacobians[:, :, self.rooted.order]

    def responses(self, position: Array, up: Array | None = None) -> tuple[Array, Array, Array | None]:
        """Compute the responses of the rows to errors of accelerations of the joints and the root, and to unknowns.

        Shapes (K, rows, n), (K, rows, 6 or 0) and (K, u, rows). Unknowns are contact forces, and accelerations of a
        flying root, or the linear ones of a root on points, which slip and sink in; None if there are none. A root that
        does not itself stand moves as the joints and the standing points make it.
        """
        inertia, size = self.used(position, inertia_matrix(self.rooted, position)), self.rooted.root_size
        encoder, root = inertia[:, :, size:], inertia[:, :, :size]
        if not self.loaded:
            count = 6 if self.flies else self.forces
            return encoder, root, root.transpose(0, 2, 1)[:, :count] if count else None
        jacobian = self.jacobian(position, up)
        unknown = self.used(position, jacobian.transpose(0, 2, 1)).transpose(0, 2, 1)
        if self.slides:
            encoder = encoder + root @ _root_from_joints(jacobian)
            unknown = np.concatenate([unknown, root[:, :, :3].transpose(0, 2, 1)], axis=1)
        return encoder, root, unknown


def rows_of_mode(
    robot: Robot,
    feet: tuple[str, ...],
    joints: IntArray,
    sensed: Sequence[str] = (),
    *,
    loops: bool = True,
    gyroscope: bool = False,
) -> ModeRows:
    """Build the contact mode of the standing feet (none for a fixed base), some with force sensors (`sensed`).

    Without `loops`, several feet, one of them a surface, keep only the rows that contact forces do not act on.
    """
    mode = ModeRows(robot, feet, gyroscope=gyroscope, joints=joints, with_rows=np.ones(len(joints), dtype=bool))
    if robot.base == "fixed":
        return mode
    free, surface = ~mode.standing[joints], mode.surface
    if mode.hung:
        return replace(mode, with_rows=free)
    others = tuple(foot for foot in feet if foot != surface)
    if surface and others and (free.all() or not loops):
        unknown = 3 if gyroscope else 6  # feet rock on the ground: their motion matters more than these sums
        return replace(mode, with_rows=free, rocks=bool(free.sum() >= ROWS_PER_UNKNOWN * unknown))
    sensor = sensed.index(surface) if surface in sensed and not others else None
    return replace(mode, loaded=others, sensor=sensor)


def rows_of_modes(
    robot: Robot,
    log: RobotLog,
    segments: Sequence[Segment],
    joints: IntArray,
    settings: Settings,
    sensed: Sequence[str] = (),
) -> dict[tuple[str, ...], ModeRows]:
    """Build the contact modes of a log that the settings allow, by standing feet.

    Flight requires a base orientation that is measured and used. Encoder zeros turn the contact forces of loops, which
    are not used then. Modes without the rows of some joints, and modes with few sums in a log with flights, are used
    only if the log has little else: equations of all joints are worth more.
    """
    tilted, gyroscope = uses_orientation(robot, log, settings), log.angular_velocity is not None
    calibrated = settings.corrections == "calibration"
    loops = settings.double_support == "fit" and not calibrated  # soles that stand together add little
    time: dict[tuple[str, ...], int] = {}
    for segment in segments:
        time[segment.feet] = time.get(segment.feet, 0) + segment.last - segment.first
    modes = {feet: rows_of_mode(robot, feet, joints, sensed, loops=loops, gyroscope=gyroscope) for feet in time}
    modes = {
        feet: mode
        for feet, mode in modes.items()
        if mode.with_rows.any()
        and (tilted or not (mode.flies or mode.hung))
        and not (mode.loaded and calibrated)
        and mode.sums > 0
    }
    least = 0.5 * len(joints) if () in modes and time[()] > ENOUGH * sum(time.values()) else 0  # feet slip on landing
    whole = {feet: mode for feet, mode in modes.items() if mode.with_rows.all() and mode.sums >= least}
    return whole if sum(time[feet] for feet in whole) > ENOUGH * sum(time.values()) else modes


def _root_from_joints(jacobian: Array) -> Array:
    """Compute the root's acceleration per joint acceleration that keeps points where they are, shape (K, 6, n).

    The base orientation gives rotations, which do not depend on the joints.
    """
    response = np.zeros((len(jacobian), 6, jacobian.shape[2] - 6))
    response[:, :3] = -np.linalg.pinv(jacobian[:, :, :3]) @ jacobian[:, :, 6:]
    return response


def null_projection(jacobian: Array) -> Array:
    """Compute P^T with orthonormal rows and J P = 0, shape (K, rows - rank, rows), from J, shape (K, u, rows).

    All samples get as many rows as the one of the largest rank.
    """
    _, values, right = np.linalg.svd(jacobian, full_matrices=True)
    rank = int((values > 1e-6 * values[:, :1]).sum(axis=1).max())  # smaller ones: feet that constrain the same twice
    return np.asarray(right[:, rank:])


def unknown_acceleration(remainder: Array, unknowns: Array) -> Array:
    """Estimate the last three unknowns, the base's acceleration, that explain most of the rows, shape (K, 3) [m/s^2].

    The rows have the shape (K, rows), and the unknowns' effects on them (K, u, rows).
    """
    solution = np.linalg.pinv(unknowns.transpose(0, 2, 1)) @ remainder[:, :, None]
    return np.asarray(solution[:, -3:, 0])


def without_forces(remainder: Array, at_centers: Array, first: int, step: int) -> Array:
    """Subtract the contact forces that explain most of the rows, r - J^T (J J^T)^-1 J r, shape (T, rows).

    J is interpolated from the windows' centers, every `step` rows from row `first` on, shape (K, u, rows).
    The product with P^T of the same sample is unchanged; with P^T of a neighboring sample, contact forces nearly
    vanish.
    """
    place = (np.arange(len(remainder)) - first) / step
    before = np.clip(place.astype(int), 0, len(at_centers) - 2)
    share = (place - before)[:, None, None]
    jacobian = (1 - share) * at_centers[before] + share * at_centers[before + 1]
    transposed = jacobian.transpose(0, 2, 1)
    square = jacobian @ transposed
    damping = 1e-14 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(square.shape[1])
    forces = np.linalg.solve(square + damping, jacobian @ remainder[:, :, None])
    return np.asarray(remainder - (transposed @ forces)[:, :, 0])
