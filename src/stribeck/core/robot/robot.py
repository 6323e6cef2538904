"""`Robot`: model, roles of the joints, contacts, and settings for its logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from stribeck.core.base.frozen import freeze_dicts
from stribeck.core.base.text_table import TextTable, number, span
from stribeck.core.base.typing import Array, BoolArray, IntArray, TorqueSource
from stribeck.core.errors import RobotFileError
from stribeck.core.robot.kinematics import frame_pose
from stribeck.core.robot.limbs import columns_of_limbs, columns_to
from stribeck.core.robot.robot_file import Contact, model_fields, open_questions, read_robot_file, robot_fields
from stribeck.core.robot.rooting import BASE_FRAME, RootedModel, root_at
from stribeck.core.settings import LogTable, LoopTable, MotorTable, PayloadTable, Settings


@dataclass(frozen=True, eq=False, kw_only=True)
class Robot:
    """Robot: a tree of joints with one degree of freedom, its contacts and settings.

    Attributes
    ----------
    name
        Name for reports.
    tree
        Kinematic tree under its own root, which is a free flyer at the base or fixed.
    joint_names
        Names of the n joints, in the order of all (T, n) arrays.
    position_controlled
        Joints whose torque is not measured and whose motion is taken as given (5.3), (5.4c).
    contacts
        Contacts by name; empty for a fixed base.
    base_frame
        Frame that a log's `base_orientation` refers to.
    gravity
        Gravity in the frame of the world or of a fixed base [m/s^2], shape (3,).
    torque_source, log_table, settings
        Entries of the robot file.
    passive, loops, payloads
        Joints without a motor (also listed as position-controlled), the loops that move them (`dynamics.loops`), and
        masses that the robot carries for some time (`friction_torque.payload`).
    motors
        Conversion from currents or torques before the gear to joint torques, by joint.
    command_gains
        Drive gains kp [N m/rad] and kd [N m s/rad] for commanded torques, shape (n,) each; zero for position-controlled
        joints, NaN where kp is unknown. None for other torque sources.
    command_delay
        Known time from the stamp of a command until it acts [s], shape (n,); None if it is not known.
    couplings
        Coefficients b_j of torque-controlled joints by coupling: friction R(sum_j b_j v_j) acts on joint j as b_j R.
    bare
        Joints without separate friction: all of it acts on couplings.
    known_rotors
        Joints whose rotor inertia is stated by the robot file; that of other joints is the model's.
    warnings
        Problems of the model, and questions that `stribeck init` left open in the robot file.
    path
        Path of the robot file, or of the model if there is no robot file; empty for a Pinocchio model.
    model_path
        Path of the model file; empty for a Pinocchio model.

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
    payloads: tuple[PayloadTable, ...] = ()
    motors: dict[str, MotorTable] = field(default_factory=dict)
    command_gains: tuple[Array, Array] | None = None
    command_delay: Array | None = None
    couplings: dict[str, dict[str, float]] = field(default_factory=dict)
    bare: frozenset[str] = frozenset()
    known_rotors: frozenset[str] = frozenset()
    log_table: LogTable = field(default_factory=LogTable)
    settings: Settings = field(default_factory=Settings)
    warnings: tuple[str, ...] = ()
    path: str = ""
    model_path: str = ""

    def __post_init__(self) -> None:
        """Make dictionaries read-only."""
        freeze_dicts(self)

    def __repr__(self) -> str:
        feet = f", contacts {', '.join(self.contacts)}" if self.contacts else ""
        return f"Robot({self.name!r}, {self.base} base, {len(self.joint_names)} joints, {self.mass:.3g} kg{feet})"

    def _repr_html_(self) -> str:
        """Format one row per joint as an HTML table for notebooks."""
        limits, idle = np.transpose(self.position_limits), "passive or position-controlled"
        rows = [
            [name, span(limits[k]), "m" if self.prismatic[k] else "rad", number(self.effort_limits[k])]
            for k, name in enumerate(self.joint_names)
        ]
        rows = [[*row, "measured" if k in self.torque_controlled else idle] for k, row in enumerate(rows)]
        right = ["limits", "unit", "largest torque [N m]"]
        return TextTable(title=repr(self), left=["joint"], right=right, last=["torque"], rows=rows).html()

    @property
    def model_file(self) -> Path:
        """Path of the model file.

        Raises
        ------
        RobotFileError
            If the robot was made from a Pinocchio model.
        """
        if not self.model_path:
            raise RobotFileError(
                f"{self.name}: was made from a Pinocchio model, and this needs a model file; use Robot.from_file or "
                "Robot.from_model with a path"
            )
        return Path(self.model_path)

    @classmethod
    def from_file(cls, path: str | Path) -> Robot:
        """Read a robot file (robot.toml) and its model.

        Raises
        ------
        RobotFileError
            If the file or the model cannot be used; the message names the place and the valid choices.

        Examples
        --------
        >>> Robot.from_file("robot.toml").mass
        6.0
        """
        robot = Robot(**robot_fields(read_robot_file(Path(path)), Path(path)))
        return replace(robot, warnings=(*robot.warnings, *open_questions(Path(path))))

    @classmethod
    def from_model(
        cls,
        model: str | Path | pin.Model,
        *,
        base: Literal["floating", "fixed"] | None = None,
        contacts: Mapping[str, str | Mapping[str, str]] | None = None,
        torque_source: TorqueSource = "link_side_sensor",
        position_controlled: Sequence[str] = (),
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
    ) -> Robot:
        """Read a URDF or MJCF model, or take a Pinocchio model, without a robot file. `from_urdf` is an alias.

        Parameters
        ----------
        model
            Path of the model file, `package:NAME` for a model of an installed package, or a `pinocchio.Model`, which is
            copied. Exports and replays that need a model file refuse a robot made from a Pinocchio model.
        base
            Whether the base moves freely ("floating") or not ("fixed"). None is floating with `contacts`, and that
            of a Pinocchio model; otherwise it is an error.
        contacts
            Feet of a floating base: name -> frame in the model, for a surface contact, or name -> a mapping
            `{"frame": ..., "kind": "point"}`.
        torque_source
            Source of the torques in the logs: "link_side_sensor", "motor_side_sensor", "motor_current" or "command".
        position_controlled
            Joints whose torque is not measured and whose motion is taken as given.
        gravity
            Gravity in the frame of the world or of a fixed base [m/s^2], shape (3,).

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
        >>> import pinocchio
        >>> Robot.from_model(pinocchio.buildModelFromUrdf("arm.urdf"))
        Robot('arm', fixed base, 3 joints, 6 kg)
        """
        return Robot(**model_fields(model, base, contacts or {}, torque_source, position_controlled, gravity))

    from_urdf = from_model

    @property
    def base(self) -> Literal["floating", "fixed"]:
        """Whether the base moves freely ("floating") or not ("fixed")."""
        return "floating" if self.tree.floating else "fixed"

    @cached_property
    def up(self) -> Array:
        """Upward direction in world coordinates, or in the frame of a fixed base, shape (3,)."""
        return -self.gravity / np.linalg.norm(self.gravity)

    @cached_property
    def mass(self) -> float:
        """Total mass of the model, including a fixed base [kg]."""
        return float(sum(inertia.mass for inertia in self.tree.model.inertias))

    @cached_property
    def has_kp(self) -> bool:
        """Whether kp of any drive is known, so that torques are computed from commands even if the log has torques."""
        return self.command_gains is not None and bool(np.isfinite(self.command_gains[0][self.torque_controlled]).any())

    @cached_property
    def armature(self) -> Array:
        """Reflected rotor inertia in the dynamics [kg m^2], shape (n,)."""
        return self.tree.in_order("armature")

    @cached_property
    def position_limits(self) -> tuple[Array, Array]:
        """Lowest and highest position of each joint [rad] or [m], shape (n,) each; infinite where unlimited."""
        low, high = self.tree.in_order("lowerPositionLimit"), self.tree.in_order("upperPositionLimit")
        endless = (low < -4 * np.pi) | (high > 4 * np.pi) | (high <= low)  # [rad] or [m]; wider counts as unlimited
        return np.where(endless, -np.inf, low), np.where(endless, np.inf, high)

    @cached_property
    def effort_limits(self) -> Array:
        """Largest torque of each joint in the model [N m] or [N], shape (n,); infinite if not given."""
        limits = self.tree.in_order("effortLimit")
        return np.where(limits > 0, limits, np.inf)

    @cached_property
    def speed_limits(self) -> Array:
        """Largest speed of each joint in the model [rad/s] or [m/s], shape (n,); infinite if not given."""
        limits = self.tree.in_order("velocityLimit")
        return np.where((limits > 0) & (limits < np.finfo(float).max), limits, np.inf)

    @cached_property
    def prismatic(self) -> tuple[bool, ...]:
        """Whether each joint is prismatic."""
        return tuple(axis.prismatic for axis in self.tree.axes)

    @cached_property
    def torque_controlled(self) -> IntArray:
        """Columns of the joints with measured torque (the selection S_tc of (5.3))."""
        given = [k for k, name in enumerate(self.joint_names) if name not in self.position_controlled]
        return np.array(given, dtype=np.int64)

    @cached_property
    def passive_columns(self) -> IntArray:
        """Columns of the passive joints."""
        return np.array([k for k, name in enumerate(self.joint_names) if name in self.passive], dtype=np.int64)

    @cached_property
    def independent(self) -> IntArray:
        """Columns of all other joints; their motion determines the motion of the passive joints."""
        return np.setdiff1d(np.arange(len(self.joint_names)), self.passive_columns)

    def coefficients(self, joints: Sequence[str], couplings: Sequence[str]) -> Array:
        """Return the coefficients of joints in couplings, shape (joints, couplings)."""
        rows = [[self.couplings[coupling].get(joint, 0.0) for coupling in couplings] for joint in joints]
        return np.array(rows).reshape(len(joints), len(couplings))

    @cached_property
    def _rooted(self) -> dict[str, RootedModel]:
        return {}

    def rooted_at(self, contact: str) -> RootedModel:
        """Root the tree at a contact's frame. The result is cached."""
        if contact not in self._rooted:
            self._rooted[contact] = root_at(self.tree.model, self.contacts[contact].frame)
        return self._rooted[contact]

    def standing(self, feet: tuple[str, ...]) -> BoolArray:
        """Find the joints between the base and a standing foot, or in a loop with one of them, shape (n,).

        Names that are not contacts, such as "hung", count as no foot.
        """
        frames = [self.contacts[foot].frame for foot in feet if foot in self.contacts]
        return np.isin(np.arange(len(self.joint_names)), list(columns_of_limbs(self.tree, frames, self.loops)))

    def carried(self, feet: tuple[str, ...]) -> bool:
        """Return whether the base moves in a way that the joints do not show: if it hangs, and on some wheels.

        These are wheels of unknown radius, and wheels without legs, which share the load in an unknown way.
        """
        shown = {
            name
            for name, contact in self.contacts.items()
            if contact.kind != "wheel" or (contact.radius and len(columns_to(self.tree, contact.frame)) > 2)
        }
        return self.base == "floating" and not shown.issuperset(feet)

    def foot_pose(self, contact: str, position: Array) -> tuple[Array, Array]:
        """Compute rotation (T, 3, 3) and translation (T, 3) [m] of a contact's frame in the base frame."""
        return frame_pose(self.tree, self.tree.model.getFrameId(self.contacts[contact].frame), position)
