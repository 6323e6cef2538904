"""What it is: the robot's model, the roles of its joints, its contacts, and how its logs differ from the contract."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stribeck.base.typing import Array, TorqueSource
from stribeck.robot.kinematics import frame_pose
from stribeck.robot.packages import model_path
from stribeck.robot.robot_file import Contact, read_robot_file, robot_fields, validated
from stribeck.robot.rooting import BASE_FRAME, RootedModel, root_at
from stribeck.settings import LogTable, LoopTable, MotorTable, RobotFile, Settings


@dataclass(frozen=True, eq=False, kw_only=True)
class Robot:
    """A robot: its tree of one-degree-of-freedom joints and what is known about them.

    Attributes
    ----------
    name
        For people.
    tree
        The tree under its own root: a free flyer at the base, or fixed.
    joint_names
        The n joints, in the order of all (T, n) arrays.
    position_controlled
        Joints whose torque is not measured and whose motion is taken as given (5.3), (5.4c).
    contacts
        By name; empty for a fixed base.
    base_frame
        The frame whose orientation a log's `base_orientation` is.
    gravity
        In the world, or in the frame of a fixed base [m/s^2], shape (3,).
    torque_source, log_table, settings
        As the robot file says.
    passive, loops
        Joints without a motor, which are among those under position control, and what moves them (`dynamics.loops`).
    motors
        By joint: what its torque is made of, where the log holds currents or torques before the gear.
    command_gains
        kp [N m/rad] and kd [N m s/rad] of the law that commands torques, shape (n,) each; zero for joints under
        position control. None where the log holds torques.
    couplings
        By name, coefficients b_j of torque-controlled joints: friction R(sum_j b_j v_j) acts on joint j as b_j R.
    warnings
        What is odd about the model.
    path
        The robot file, or the model where there is none.
    model_path
        The model file.

    Examples
    --------
    >>> robot = Robot.from_file("robot.toml")
    >>> robot
    Robot('arm', fixed base, 3 joints, 6 kg)
    >>> robot.joint_names
    ('shoulder', 'elbow', 'slide')
    """

    name: str
    tree: RootedModel
    joint_names: tuple[str, ...]
    position_controlled: tuple[str, ...] = ()
    contacts: dict[str, Contact] = field(default_factory=dict)
    base_frame: str = BASE_FRAME
    gravity: Array
    torque_source: TorqueSource = "link_side_sensor"
    passive: tuple[str, ...] = ()
    loops: tuple[LoopTable, ...] = ()
    motors: dict[str, MotorTable] = field(default_factory=dict)
    command_gains: tuple[Array, Array] | None = None
    couplings: dict[str, dict[str, float]] = field(default_factory=dict)
    log_table: LogTable = field(default_factory=LogTable)
    settings: Settings = field(default_factory=Settings)
    warnings: tuple[str, ...] = ()
    path: str = ""
    model_path: str = ""

    def __repr__(self) -> str:
        feet = f", contacts {', '.join(self.contacts)}" if self.contacts else ""
        return f"Robot({self.name!r}, {self.base} base, {len(self.joint_names)} joints, {self.mass:.3g} kg{feet})"

    @classmethod
    def from_file(cls, path: str | Path) -> Robot:
        """Read a robot file (robot.toml) and the model it names.

        Raises
        ------
        RobotFileError
            If the file or the model cannot be used; the message says where and what would be valid.

        Examples
        --------
        >>> Robot.from_file("robot.toml").mass
        6.0
        """
        return from_robot_file(read_robot_file(Path(path)), Path(path))

    @classmethod
    def from_model(
        cls,
        path: str | Path,
        *,
        base: Literal["floating", "fixed"] = "floating",
        contacts: Mapping[str, str | Mapping[str, str]] | None = None,
        torque_source: TorqueSource = "link_side_sensor",
        position_controlled: Sequence[str] = (),
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
    ) -> Robot:
        """Read a URDF or MJCF model, without a robot file; `from_urdf` is another name of this.

        Parameters
        ----------
        path
            The model file, or `package:NAME` of a package that brings it, as in a robot file.
        base
            Whether the base moves freely.
        contacts
            Of a floating base: name of each foot -> its frame in the model, a surface; or, as in a robot file, a
            mapping `{"frame": ..., "kind": "point"}`.
        torque_source
            Where the torques of its logs come from: "link_side_sensor", "motor_side_sensor", "motor_current" or
            "command".
        position_controlled
            Joints whose torque is not measured and whose motion is taken as given.
        gravity
            In the world, or in the frame of a fixed base [m/s^2], shape (3,).

        Raises
        ------
        RobotFileError
            If the model cannot be used, or does not have these joints or frames.

        Examples
        --------
        >>> Robot.from_urdf("arm.urdf", base="fixed")
        Robot('arm', fixed base, 3 joints, 6 kg)
        >>> Robot.from_model("arm.urdf", contacts={"hand": {"frame": "hand", "kind": "point"}})
        Robot('arm', floating base, 3 joints, 6 kg, contacts hand)
        """
        path = model_path(str(path), Path())
        feet = {
            name: {"frame": foot} if isinstance(foot, str) else dict(foot) for name, foot in (contacts or {}).items()
        }
        table = {
            "model": path.name,
            "base": base,
            "torque_source": torque_source,
            "position_controlled": list(position_controlled),
            "gravity": list(gravity),
        }
        return from_robot_file(validated({"robot": table, "contacts": feet}, path), path)

    from_urdf = from_model

    @property
    def base(self) -> Literal["floating", "fixed"]:
        """Whether the base moves freely."""
        return "floating" if self.tree.floating else "fixed"

    @cached_property
    def mass(self) -> float:
        """Total mass of the model, a fixed base included [kg]."""
        return float(sum(inertia.mass for inertia in self.tree.model.inertias))

    @cached_property
    def armature(self) -> Array:
        """Reflected rotor inertia that the dynamics include [kg m^2], shape (n,)."""
        return self._in_order("armature")

    @cached_property
    def position_limits(self) -> tuple[Array, Array]:
        """Lowest and highest position of each joint [rad] or [m], shape (n,) each; infinite where unlimited."""
        low, high = self._in_order("lowerPositionLimit"), self._in_order("upperPositionLimit")
        endless = (low < -4 * np.pi) | (high > 4 * np.pi) | (high <= low)  # [rad] or [m]; a wider limit is none
        return np.where(endless, -np.inf, low), np.where(endless, np.inf, high)

    @cached_property
    def effort_limits(self) -> Array:
        """Largest torque of each joint [N m] or [N] by the model, shape (n,); infinite where it says none."""
        found = self._in_order("effortLimit")
        return np.where(found > 0, found, np.inf)

    @cached_property
    def speed_limits(self) -> Array:
        """Largest speed of each joint [rad/s] or [m/s] by the model, shape (n,); infinite where it says none."""
        found = self._in_order("velocityLimit")
        return np.where((found > 0) & (found < np.finfo(float).max), found, np.inf)

    def _in_order(self, attribute: str) -> Array:
        """Return an attribute of the tree's joints in the order of `joint_names`, shape (n,)."""
        found = np.empty(len(self.joint_names))
        found[self.tree.columns] = getattr(self.tree.model, attribute)[-len(found) :]
        return found

    @cached_property
    def prismatic(self) -> tuple[bool, ...]:
        """Whether each joint is prismatic."""
        return tuple(axis.prismatic for axis in self.tree.axes)

    @cached_property
    def torque_controlled(self) -> NDArray[np.int64]:
        """Columns of the joints whose torque is measured (the selection S_tc of (5.3))."""
        given = [k for k, name in enumerate(self.joint_names) if name not in self.position_controlled]
        return np.array(given, dtype=np.int64)

    @cached_property
    def passive_columns(self) -> NDArray[np.int64]:
        """Columns of the passive joints."""
        return np.array([k for k, name in enumerate(self.joint_names) if name in self.passive], dtype=np.int64)

    @cached_property
    def independent(self) -> NDArray[np.int64]:
        """Columns of all other joints, whose motion is that of the passive ones too."""
        return np.setdiff1d(np.arange(len(self.joint_names)), self.passive_columns)

    def coefficients(self, joints: Sequence[str], couplings: Sequence[str]) -> Array:
        """Return the coefficients of some joints in some couplings, shape (joints, couplings)."""
        rows = [[self.couplings[coupling].get(joint, 0.0) for coupling in couplings] for joint in joints]
        return np.array(rows).reshape(len(joints), len(couplings))

    @cached_property
    def _rooted(self) -> dict[str, RootedModel]:
        return {}

    def rooted_at(self, contact: str) -> RootedModel:
        """Return the tree re-rooted at a contact's frame; it is built once."""
        if contact not in self._rooted:
            self._rooted[contact] = root_at(self.tree.model, self.contacts[contact].frame)
        return self._rooted[contact]

    def standing(self, feet: tuple[str, ...]) -> NDArray[np.bool_]:
        """Return which joints lie between the base and a standing foot, or in a loop with one of them, shape (n,)."""
        found = set[int]().union(*(self._path(self.contacts[foot].frame) for foot in feet))
        for group in self._loop_groups():  # the ground's force on a loop acts on all of its joints
            if found & group:
                found |= group
        return np.isin(np.arange(len(self.joint_names)), list(found))

    def _path(self, frame: str) -> set[int]:
        """Return the columns of the joints between the base and a frame."""
        joint = int(self.tree.model.frames[self.tree.model.getFrameId(frame)].parentJoint)
        return {self.tree.column(above) for above in self.tree.path_to_root(joint)}

    def _loop_groups(self) -> list[set[int]]:
        """Return the columns of the joints that loops tie together, group by group."""
        groups: list[set[int]] = []
        for loop in self.loops:
            first, second = map(self._path, loop.frames)
            joined = first ^ second
            apart = [group for group in groups if not group & joined]
            groups = [*apart, joined.union(*(group for group in groups if group & joined))]
        return groups

    def foot_pose(self, contact: str, position: Array) -> tuple[Array, Array]:
        """Return rotation (T, 3, 3) and translation (T, 3) [m] of a contact's frame in the base frame."""
        frame = self.tree.model.getFrameId(self.contacts[contact].frame)
        return frame_pose(self.tree, frame, position)


def from_robot_file(file: RobotFile, path: Path) -> Robot:
    """Build the robot that a validated robot file describes; the model's path is relative to `path`.

    Raises
    ------
    RobotFileError
        If the model cannot be read, or the file names joints or frames that it does not have.
    """
    return Robot(**robot_fields(file, path))
