"""Normal equations of a whole log: sufficient statistics of fixed size (docs/estimator-fit.md, equations 17 and 18)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from threading import Event, Lock

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.equations.weak_equations import WeakEquations
from stribeck.core.estimator.model.terms import Columns
from stribeck.core.estimator.noise.outliers import Prediction
from stribeck.core.estimator.noise.whitening import Whitener, make_whitener


@dataclass(frozen=True, eq=False)
class Statistics:
    """Normal equations of the coefficients of all joints' friction, then of corrections.

        chi^2(theta) = s - 2 b^T theta + theta^T A theta

    Laws are fitted to these without the log, and the equations of several segments or logs add up.

    Attributes
    ----------
    friction
        Number f of coefficients.
    information, right, square
        A, b and s, shape (D, D), (D,) and a number.
    count
        Number of equations that count.
    loads
        Number of windows, and sums of the joints' loads [N m] and of their squares, shape (3, n).
    effects
        By gait phase, products of the random effects' columns Z with all values, with each other, and with the left
        sides, shape (D, e), (e, e) and (e,); of a sample of the log.
    """

    friction: int
    information: Array
    right: Array
    square: float
    count: int
    loads: Array
    effects: dict[int, tuple[Array, Array, Array]] = field(default_factory=dict)

    def __add__(self, other: Statistics) -> Statistics:
        """Add the statistics of two parts."""
        effects = dict(self.effects)
        for gait, effect in other.effects.items():
            before = effects.get(gait)
            effects[gait] = effect if before is None else tuple(a + b for a, b in zip(before, effect, strict=True))  # type: ignore[assignment]
        return Statistics(
            self.friction,
            self.information + other.information,
            self.right + other.right,
            self.square + other.square,
            self.count + other.count,
            self.loads + other.loads,
            effects,
        )

    def without(self, fold: Statistics) -> Statistics:
        """Subtract the statistics of a part, for a fit; the result has no random effects."""
        information, right = self.information - fold.information, self.right - fold.right
        return replace(
            self, information=information, right=right, square=self.square - fold.square, count=self.count - fold.count
        )

    def chi_square(self, values: Array) -> float:
        """Compute chi^2 of coefficients and corrections, shape (D,)."""
        return self.square + float(values @ (self.information @ values - 2 * self.right))

    @property
    def mean_load(self) -> Array:
        """Mean load of each joint [N m], shape (n,)."""
        return np.asarray(self.loads[1] / self.loads[0])

    @property
    def load_deviation(self) -> Array:
        """Standard deviation of each joint's load [N m], shape (n,)."""
        return np.asarray(np.sqrt(np.maximum(self.loads[2] / self.loads[0] - self.mean_load**2, 0.0)))


def total(parts: Sequence[Statistics]) -> Statistics:
    """Add the statistics of all parts."""
    return sum(parts[1:], parts[0])


def accumulate(
    equations: Sequence[WeakEquations],
    folds: Sequence[Sequence[int]],
    sampled: int,
    columns: Columns,
    prediction: Prediction,
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[list[Statistics], dict[int, WeakEquations], dict[int, tuple[Array, NDArray[np.bool_]]]]:
    """Accumulate the statistics of folds; keep the equations of the last fold by segment number.

    The windows' centers [s] are returned by segment number as well, with flags of the used windows.

    Two threads add up the folds in a fixed order, because linear algebra releases Python's lock. Only one thread at a
    time computes equations, because threads cannot share Pinocchio's working memory.

    Parameters
    ----------
    equations
        Equations of all segments; computed on access, so that they are never all in memory.
    folds
        Segment numbers of each fold; the last fold is held out.
    sampled
        Number of folds with random effects.
    columns
        Columns of friction.
    prediction
        Prediction by the pilot, whose components are used; windows far from it are rejected.
    progress
        Callback `progress(fraction)`.
    """
    making, over = Lock(), Event()
    kept: dict[int, WeakEquations] = {}
    windows: dict[int, tuple[Array, NDArray[np.bool_]]] = {}
    done, every = [0], sum(map(len, folds))

    def add_up(number: int) -> list[Statistics]:
        totals: list[Statistics] = []
        for place in folds[number]:
            if over.is_set():
                break
            with making:
                part = equations[place]
                done[0] += 1
                progress(done[0] / every)
            statistics, used = _of(part, columns, prediction, number < sampled)
            windows[place] = used.time, used.used
            totals = [totals[0] + statistics] if totals else [statistics]
            if number == len(folds) - 1:
                kept[place] = used
        return totals

    with ThreadPoolExecutor(max_workers=2) as pool:
        tasks = [pool.submit(add_up, number) for number in range(len(folds))]
        try:
            results = [task.result() for task in tasks]
        finally:
            over.set()  # after an error or Ctrl-C, the remaining results are useless
    return [totals[0] for totals in results if totals], kept, windows


def _of(
    part: WeakEquations, columns: Columns, prediction: Prediction, sampled: bool
) -> tuple[Statistics, WeakEquations]:
    """Compute the statistics of a segment, and its equations without rejected windows."""
    joints, size = part.velocity.shape[1], len(prediction.values)
    sampled = sampled and part.gait >= 0
    by_joint = columns.by_joint(part)
    behind = [part.gait_phase_effects()] if sampled else []
    design = columns.design(part, by_joint, *behind, part.residual.reshape(-1, 1))
    load = columns.terms.load(part, by_joint[:, :, : columns.basis.functions.shape[1]])
    part = prediction.set_aside(part, design)
    product = _weighed(part, by_joint, design, make_whitener(part, prediction.components))
    count = int(part.used.sum()) * part.residual.shape[1]
    effects = (product[:size, size:-1], product[size:-1, size:-1], product[size:-1, -1])
    statistics = Statistics(
        friction=joints * columns.per_joint,
        information=product[:size, :size],
        right=product[:size, -1],
        square=float(product[-1, -1]),
        count=count,
        loads=np.stack([np.full(joints, len(load)), load.sum(axis=0), (load**2).sum(axis=0)]),
        effects={part.gait: effects} if sampled else {},
    )
    if prediction.contradicts(statistics.information, statistics.right, statistics.square, count):
        nothing = replace(statistics.without(statistics), effects={})
        return nothing, replace(part, set_aside=np.ones(len(part.time), dtype=bool))
    return statistics, part


def _weighed(part: WeakEquations, columns: Array, design: Array, whitener: Whitener) -> Array:
    """Compute X^T Sigma^-1 X of a design X, which is overwritten.

    Friction of a joint acts through its `columns`, shape (K, n, q). Their product with Sigma^-1 X joint by joint
    takes a fraction of the operations of a full product.
    """
    windows, joints, per_joint = columns.shape
    friction = joints * per_joint
    product = np.empty((design.shape[1],) * 2)
    whitener.whiten(design)
    rest = design[:, friction:]
    product[friction:, friction:] = rest.T @ rest  # NumPy uses the symmetry
    whitener.whiten_back(design)
    on_joints = design.reshape(windows, -1, design.shape[1])
    if part.projection is not None:
        on_joints = part.projection.transpose(0, 2, 1) @ on_joints
    for joint in range(joints):
        product[joint * per_joint : (joint + 1) * per_joint] = columns[:, joint].T @ on_joints[:, joint]
    product[friction:, :friction] = product[:friction, friction:].T
    return product
