"""Rows of the equation of motion from logs: filtered motion, torque and friction columns, sample by sample."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise

import numpy as np

from stribeck.core.base.typing import Array, BoolArray, IntArray
from stribeck.core.dynamics.contact import SupportPhase
from stribeck.core.dynamics.contact.mode import contact_modes
from stribeck.core.dynamics.rooted import inertia_matrix
from stribeck.core.dynamics.state import State
from stribeck.core.equations.friction_torque.inverse_dynamics import (
    differentiate,
    orientation_filter,
    require_channels,
    spans,
)
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog
from stribeck.core.equations.whole_log.build import acting
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.equations.whole_log.mode_rows import ModeRows, rows_of_mode
from stribeck.core.equations.whole_log.regressors import inertia_regressors
from stribeck.core.filters import make_filter
from stribeck.core.friction import FrictionLaw
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.paper.direct.rows import ROOT, DirectRows


@dataclass(frozen=True)
class Block:
    """Block of correlated samples: rows [first, last) of a log in one contact mode; `phase` contains the block."""

    log: int
    feet: tuple[str, ...]
    first: int
    last: int
    phase: SupportPhase

    @property
    def rows(self) -> slice:
        """Rows of the block."""
        return slice(self.first, self.last)


@dataclass(frozen=True, eq=False, kw_only=True)
class RowMaker:
    """Builder of rows from blocks of logs.

    Attributes
    ----------
    robot, law, settings
        Robot, law and settings; the filter kind "auto" is not allowed.
    joints
        Columns of the joints whose friction is estimated, shape (n,).
    couplings
        Coefficients of these joints in each of c couplings, shape (n, c).
    rest
        Speeds below which joints and couplings are at rest, with unknown friction [rad/s], shape (n + c,).
    corrections
        Selection of the corrected bodies and rotors.
    """

    robot: Robot
    law: FrictionLaw
    settings: Settings
    joints: IntArray
    couplings: Array
    rest: Array
    corrections: Layout
    _modes: dict[tuple[str, ...], ModeRows] = field(default_factory=dict)

    def blocks(self, prepared: Logs) -> list[Block]:
        """Split the logs into blocks: support phases, or equal parts of longer ones."""
        blocks = []
        for number, part in enumerate(prepared):
            longest = max(1, round(self.settings.block / part.sampling.period))
            for phase, mode in zip(part.support.phases, contact_modes(self.robot, part.support.phases), strict=True):
                feet = tuple(sorted(mode.feet, key=lambda foot, rested=mode.rested: foot != rested))  # type: ignore[misc]
                if phase.last == phase.first or phase.kind == "flight":
                    continue
                parts = max(1, round((phase.last - phase.first) / longest))
                edges = np.linspace(phase.first, phase.last, parts + 1).astype(int).tolist()
                blocks += [Block(number, feet, *edge, phase) for edge in pairwise(edges)]
        return blocks

    def rows(self, prepared: Logs, blocks: Sequence[Block], numbers: Sequence[int]) -> list[DirectRows]:
        """Build the rows of some blocks, with given block numbers."""
        columns = self.corrections.inertial_parameters.size * (ROOT + len(self.joints))
        stride = -(-sum(block.last - block.first for block in blocks) * columns // 20_000_000)  # 160 MB
        rows: list[DirectRows] = []
        feet, numbered = list(dict.fromkeys(block.feet for block in blocks)), zip(blocks, numbers, strict=True)
        for log, group in groupby(numbered, key=lambda pair: pair[0].log):
            rows += self._of_log(prepared[log], list(group), feet, max(1, stride))
        return rows

    def has(self, k: int) -> list[int]:
        """List the law's parameters of a joint or coupling; couplings have no parameters that joints can replace."""
        return [i for i, term in enumerate(self.law.parameters) if k < len(self.joints) or term.neutral is None]

    def _mode(self, feet: tuple[str, ...]) -> ModeRows:
        if feet not in self._modes:
            every = np.ones(len(self.joints), dtype=bool)  # rows are selected by the samples in which they are seen
            self._modes[feet] = replace(rows_of_mode(self.robot, feet, self.joints), with_rows=every)
        return self._modes[feet]

    def _of_log(
        self, part: PreparedLog, blocks: Sequence[tuple[Block, int]], feet: Sequence[tuple[str, ...]], stride: int
    ) -> Iterator[DirectRows]:
        require_channels(self.robot, part.log, self.settings)
        mode_of_row, *clusters = np.full((3, len(part.log.time)), -1)
        steady = np.zeros(len(part.log.time), dtype=bool)
        for block, number in blocks:
            phase = block.phase
            mode_of_row[block.rows], clusters[0][block.rows] = feet.index(block.feet), number
            steady[phase.steady_first : phase.steady_last] = True
            if phase.steps:
                since = (part.log.time[block.rows] - part.log.time[phase.start]) / 0.05
                first = 40 * feet.index(block.feet)  # phases of 50 ms since touchdown; the last is unlimited
                clusters[1][block.rows] = first + np.minimum(since.astype(np.int64), 39)
        period = part.sampling.period
        motion_filter = make_filter(self.settings.filter, period)
        turn_filter = orientation_filter(self.robot, part.log, motion_filter, period, self.settings)
        reach = motion_filter.half_width
        for span in spans(part.sampling.segments, max(reach, turn_filter.half_width) + reach):
            kept = np.flatnonzero((mode_of_row[span] >= 0) & (np.arange(span.start, span.stop) % stride == 0))
            if not len(kept):
                continue
            wide = slice(span.start - reach, span.stop + reach)
            state, torque = differentiate(self.robot, part.log, wide, motion_filter, turn_filter, self.settings)
            friction = motion_filter.smooth(self._law_columns(state.velocity))
            known = np.hstack([signal[kept + reach] for signal in (state.velocity, state.acceleration, torque)])
            kept = kept[np.isfinite(np.hstack([known, friction[kept]])).all(axis=1)]
            friction = friction[kept]
            state, torque = state.take(kept + reach), torque[kept + reach]
            span_modes, span_clusters = mode_of_row[span][kept], np.stack(clusters)[:, span][:, kept]
            for piece in _in_pieces(span_modes):
                k = int(span_modes[piece[0]])
                mode = self._mode(feet[k])
                moving = mode.seen(self.settings) & (steady[span][kept][piece, None] | mode.swinging)
                yield from self._of_mode(
                    mode, state.take(piece), torque[piece], friction[piece], moving, span_clusters[:, piece]
                )

    def _law_columns(self, velocity: Array) -> Array:
        """Compute the derivatives of the law with respect to its parameters per joint, shape (T, (n + c) k)."""
        bare = np.array([self.robot.joint_names[column] in self.robot.bare for column in self.joints])
        speeds = velocity[:, self.joints] * ~bare, velocity[:, self.joints] @ self.couplings
        none = np.zeros(len(self.law.parameters))
        return np.hstack([self.law.jacobian(speed, none) for speed in np.hstack(speeds).T])

    def _of_mode(
        self, mode: ModeRows, state: State, torque: Array, law_columns: Array, seen: BoolArray, clusters: IntArray
    ) -> Iterator[DirectRows]:
        """Yield the rows of samples in one contact mode if any seen joint moves; `seen` has shape (K, all joints)."""
        on_joints = acting(self.couplings)
        speeds = state.velocity[:, self.joints] @ on_joints
        turned = state.acceleration[:, self.joints] @ on_joints
        own_columns = law_columns.reshape(len(speeds), len(on_joints.T), -1)
        parts = [
            np.column_stack([own_columns[:, k, self.has(k)], *([turned[:, k]] if k in self.corrections.rotors else [])])
            for k in range(len(on_joints.T))
        ]
        friction = np.concatenate(
            [part[:, None] * direction[:, None] for part, direction in zip(parts, on_joints.T, strict=True)], axis=2
        )
        root = len(mode.rows) - len(self.joints)
        at_rest = (np.abs(speeds) < self.rest * self.law.jumps) @ (on_joints != 0).T
        used = np.hstack([np.tile(seen.all(axis=1, keepdims=True), (1, root)), seen[:, self.joints] & ~at_rest])
        kept = np.flatnonzero(used.any(axis=0))
        if not len(kept):
            return
        effects = [inertia_matrix(mode.rooted, state.position)[:, : mode.rooted.root_size, mode.rows]]
        if mode.loaded and seen.all(axis=1).any():  # forces act on joints that are used
            effects.append(mode.jacobian(state.position)[:, :, mode.rows])
        regressor = inertia_regressors(self.robot, mode.rooted, mode.rows[kept], state, mode.root(state))
        friction = np.concatenate([np.zeros((len(speeds), root, friction.shape[2])), friction], axis=1)
        yield DirectRows(
            left=mode.left_side(state, torque, None)[:, kept],
            columns=np.concatenate([regressor, friction[:, kept]], axis=2),
            effects=np.concatenate(effects, axis=1)[:, :, kept],
            used=used[:, kept],
            kind=np.concatenate([np.arange(root), ROOT + np.arange(len(self.joints))])[kept],
            clusters=clusters,
        )


def _in_pieces(modes: IntArray) -> Iterator[IntArray]:
    """Yield the sample indices of each contact mode in chunks."""
    for mode in np.unique(modes):
        places = np.flatnonzero(modes == mode)
        yield from np.array_split(places, -(-len(places) // 512))
