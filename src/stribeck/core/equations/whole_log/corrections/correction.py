"""Layout of all corrections, and one correction: size, prior, columns, effect on a log, and place in a result."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from stribeck.core.base.finding import Finding
from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.rooted import RootMotion
from stribeck.core.dynamics.state import State
from stribeck.core.equations.whole_log.mode_rows import ModeRows
from stribeck.core.equations.whole_log.regressors import inertia_regressors, zero_regressors
from stribeck.core.log import RobotLog
from stribeck.core.robot import Robot
from stribeck.core.settings import Priors


@dataclass(frozen=True, eq=False, kw_only=True)
class Layout:
    """Corrections of a log, and named slices of the parameter vector, whose offsets `places` and `part` compute.

    Friction comes first, joint by joint with `per_joint` entries each, then the corrections. The order is the same for
    coordinates and for the values that enter the equations linearly. `lay_out` makes a layout without friction.

    Attributes
    ----------
    sizes
        Number of entries of each part by name, in the order of the vector.
    per_joint
        Number of friction entries per joint.
    bodies, inertial_parameters
        Names of the bodies, and their inertial parameters in the model, shape (bodies, 10).
    floating
        Whether the first body is a floating base whose load the log shows, because it steps or hangs.
    command_delays
        Standard errors of the delay of each joint's commands [s]; empty for measured torques.
    rotors, armature, guessed
        Indices of joints and couplings, their rotor inertias in the model [kg m^2], and a mask of those that the robot
        file does not state, shape (rotors,).
    payloads
        Masses of the payloads [kg].
    log_effects
        Number of contrasts between logs, one fewer than the logs, of effects that differ between logs [N m], and of
        joints. The effects are offset, Coulomb friction, and viscous friction at top speed, or none.
    """

    sizes: Mapping[str, int] = field(default_factory=dict)
    per_joint: int = 0
    bodies: tuple[str, ...] = ()
    floating: bool = False
    inertial_parameters: Array = field(default_factory=lambda: np.zeros((0, 10)))
    command_delays: tuple[float, ...] = ()
    rotors: tuple[int, ...] = ()
    armature: Array = field(default_factory=lambda: np.zeros(0))
    guessed: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    payloads: tuple[float, ...] = ()
    log_effects: tuple[int, int, int] = (0, 0, 0)

    def with_friction(self, joints: int, per_joint: int) -> "Layout":
        """Put the friction of joints before the corrections."""
        return replace(self, sizes={"friction": joints * per_joint, **self.sizes}, per_joint=per_joint)

    @cached_property
    def _ends(self) -> dict[str, int]:
        return dict(zip(self.sizes, np.cumsum(list(self.sizes.values())).tolist(), strict=True))

    def part(self, first: str, last: str | None = None) -> slice:
        """Return the slice from one named part to another, both included."""
        return slice(self._ends[first] - self.sizes[first], self._ends[last or first])

    def places(self, first: str, last: str | None = None) -> IntArray:
        """Return the indices from one named part to another, both included."""
        return np.arange(self.size)[self.part(first, last)]

    @property
    def size(self) -> int:
        """Length of the whole vector."""
        return sum(self.sizes.values())

    def joint(self, joint: int) -> slice:
        """Return one joint's entries."""
        return slice(joint * self.per_joint, (joint + 1) * self.per_joint)


@dataclass(frozen=True, eq=False, kw_only=True)
class Signals:
    """Smoothed signals of a segment at the windows' centers, from which columns are computed.

    Attributes
    ----------
    layout, mode, state
        The corrections, contact mode, and motion.
    slip
        Acceleration of the base in addition to the one that standing points imply [m/s^2], shape (K, 3).
    on_joints
        Effect of the friction of joints and couplings on the joints, shape (n, n + couplings).
    torque, torque_rate
        Measured torques [N m] and their time derivatives [N m/s], shape (K, n) each.
    wrench
        Measured wrench on the standing foot [N], [N m], shape (K, 6); None if it is not used.
    carried
        Whether the robot carries each of its payloads.
    """

    layout: Layout
    mode: ModeRows
    state: State
    slip: Array | None
    on_joints: Array
    torque: Array
    torque_rate: Array
    wrench: Array | None
    carried: Sequence[bool]

    @cached_property
    def acting(self) -> Array:
        """Effect of the friction of joints and couplings on the rows, shape (rows, n + couplings)."""
        return self.mode.on_rows(self.on_joints)

    @property
    def torque_effects(self) -> Array:
        """Effect of the joints' torques on the rows, shape (rows, n)."""
        return self.acting[:, : len(self.mode.joints)]

    @cached_property
    def root(self) -> RootMotion | None:
        """Motion of the root."""
        root = self.mode.root(self.state)
        if self.slip is None or root is None or root.acceleration is None:
            return root
        return replace(root, acceleration=root.acceleration + np.pad(self.slip, ((0, 0), (0, 3))))

    @cached_property
    def by_inertia(self) -> Array:
        """Derivatives by the bodies' inertial parameters, shape (K, rows, 10 bodies)."""
        mode, loops = self.mode, self.mode.robot.loops
        rows = np.arange(len(mode.rooted.order)) if loops else mode.rows
        regressors = inertia_regressors(mode.robot, mode.rooted, rows, self.state, self.root)
        return mode.used(self.state.position, regressors) if loops else regressors

    @cached_property
    def by_angles(self) -> Array:
        """Derivatives by encoder errors, then by the tilt of the base, shape (K, rows, all joints + 3)."""
        return zero_regressors(self.mode.rooted, self.mode.rows, self.state, self.root)


class Found(NamedTuple):
    """Values of a correction with their standard errors, and the names of the fitted joints and of all encoders."""

    layout: Layout
    values: Array
    errors: Array
    joints: Sequence[str]
    encoders: Sequence[str]

    @property
    def pairs(self) -> list[tuple[float, float]]:
        """Values and their standard errors."""
        return list(zip(self.values.tolist(), self.errors.tolist(), strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class Correction:
    """Correction of model or calibration; its values are to be subtracted.

    Attributes
    ----------
    name
        Name of its part of the parameter vector.
    columns
        Function that computes the derivatives of the left side, shape (K, rows, size); None if added elsewhere.
    scales
        Function that computes the prior standard deviation of each column, or one for all; None for bodies.
    count
        Function from the robot and names of joints and couplings to the number of columns, for calibration.
    size
        Function from the layout to the number of columns, for corrections of the model, and command delays.
    apply
        Function that corrects a log, given the robot, columns of the fitted joints, and values.
    grouped
        Whether the columns share a prior standard deviation, which the log determines.
    kind, apart, finding
        Kind of the competing cause, "" for none; whether each column is a cause; and the function from numbers, values
        and errors of a cause to its finding.
    describe
        Function from the found values to fields of `Corrections` in a result.
    """

    name: str
    columns: Callable[[Signals], Array] | None = None
    scales: Callable[[Priors, Layout], Any] | None = None
    count: Callable[[Robot, Sequence[str]], int] | None = None
    size: Callable[[Layout], int] | None = None
    apply: Callable[[RobotLog, Robot, IntArray, Array], RobotLog] | None = None
    grouped: bool = False
    kind: str = ""
    apart: bool = False
    finding: Callable[[Sequence[int], Array, Array, Robot], Finding] | None = None
    describe: Callable[[Found], Mapping[str, Any]] | None = None
