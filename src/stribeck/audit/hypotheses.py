"""Competition of single causes of torques that disagree with the model of a robot on a fixed base.

A mass at the flange, a tilted base and a wrong torque gain all make gravity's torques look too large or too small. Each
cause is therefore fitted to all joints together, as a linear change of the model's torques in addition to friction, and
judged on held-out parts of the log. The best cause leaves the smallest shares unexplained.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from stribeck.audit.evidence import Evidence
from stribeck.audit.motion import gravity_torques
from stribeck.audit.regression import friction_shapes, without
from stribeck.base.typing import Array
from stribeck.dynamics.state import State
from stribeck.robot.inertial_parameters import SIZE
from stribeck.whole_log.equations.regressors import inertia_regressors

FLOOR = 5e-4
"""Unexplained share of a torque [1] that any model leaves: 2 % of its amplitude."""
CLEARLY = np.log(3.0)
"""Difference of the summed logarithms of unexplained shares from which a cause is clearly better [1]."""
PER_GAIN = 0.3
"""Cost of a gain [1]: of two sets of joints that explain the torques equally well, the smaller one wins."""
MOST_ROWS = 1500
"""Bins that are compared [1]."""
FEWEST_BINS = 125
"""Bins from which causes are compared [1]."""
MOST_JOINTS = 8
"""Number of joints up to which gains of two and three of them are tried [1]."""
FOLDS, BLOCKS = 5, 20
"""Number of folds, and of consecutive parts of the log that are distributed over them [1]."""
SCALES = np.array([1.0, *3 * [0.1], *6 * [0.01]])
"""Units of inertial parameters, so that a fit can leave out directions without information [kg, kg m, kg m^2]."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One cause, fitted to the log.

    Attributes
    ----------
    kind
        "none", "gain", "common gain", "gravity" or "body".
    places
        Numbers of the torque-controlled joints, or the number of the body.
    left
        Share of each joint's held-out torque, without friction, that stays unexplained [1], shape (joints,).
    cost
        Sum of the logarithms of these shares, with a cost per gain [1].
    values
        Changes: of gains [1], of gravity [m/s^2], or of a body's inertial parameters in its joint's frame.
    """

    kind: str
    places: tuple[int, ...]
    left: Array
    cost: float
    values: Array


def compete(evidence: Evidence, joints: Sequence[int]) -> list[Hypothesis]:
    """Fit all causes to the torques of some joints, and sort them by cost; empty without enough evidence."""
    robot = evidence.robot
    if robot.base != "fixed" or robot.loops or len(evidence.rows) < FEWEST_BINS:
        return []
    joints, products = _products(evidence, joints)
    if not joints:
        return []
    bodies = (products.shape[2] - 5) // SIZE
    found = [_fit(products, *each) for each in _hypotheses(joints, bodies)]
    return sorted((each for each in found if _possible(evidence, each)), key=lambda each: each.cost)


def rivals(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """List the best cause of each kind that is not clearly worse than the best of all.

    The list is empty if the model is about as good as the best cause, or the best cause does not explain the torques
    that the model contradicts.
    """
    best: dict[str, Hypothesis] = {}
    for each in found:
        if each.cost < found[0].cost + CLEARLY:
            best.setdefault(each.kind, each)
    given = next((each for each in found if each.kind == "none"), None)
    if given is None or given.kind in best or np.any(found[0].left[given.left > 1.2] > 0.5):
        return []
    return list(best.values())


def _products(evidence: Evidence, among: Sequence[int]) -> tuple[list[int], Array]:
    """Compute the products of each fold and joint, shape (folds, joints, 1 + c, 1 + c), without friction.

    The first column is the torque minus the model's; the c others are the model's torque, gravity's three directions,
    and each body's inertial parameters.
    """
    robot, count = evidence.robot, len(evidence.rows)
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).astype(int))
    rows = rows[np.isfinite(evidence.model[rows]).all(axis=1)]
    if len(rows) < FEWEST_BINS:
        return [], np.zeros(0)
    known, log = robot.torque_controlled, evidence.prepared.log
    position = log.position[evidence.rows[rows]]
    motion = np.zeros((2, *position.shape))
    motion[:, :, known] = evidence.velocity[rows], evidence.acceleration[rows]
    columns = np.argsort(robot.tree.columns)[known]
    state = State(position, *motion)
    of_bodies = inertia_regressors(robot, robot.tree, columns, state, None)
    gravity = gravity_torques(evidence, robot, np.eye(3))[rows]
    scale = np.tile(SCALES, of_bodies.shape[2] // SIZE)
    blocks = np.minimum(np.arange(len(rows)) * BLOCKS // len(rows), BLOCKS - 1)
    joints, found = [], []
    chosen = np.isin(np.arange(count), rows)
    for k in among:
        if not evidence.moves(k) or evidence.torque[rows, k].std() == 0:
            continue
        own = np.column_stack([evidence.model[rows, k], gravity[:, k], of_bodies[:, k] * scale])
        left, own, torque = without(
            friction_shapes(evidence, k, chosen), evidence.torque[rows, k] - own[:, 0], own, evidence.torque[rows, k]
        )
        power = float(torque @ torque)
        if power <= 1e-6 * float(np.sum(evidence.torque[rows, k] ** 2)):
            continue
        both = np.column_stack([left, own]) / np.sqrt(power)
        joints.append(k)
        found.append([both[blocks % FOLDS == fold].T @ both[blocks % FOLDS == fold] for fold in range(FOLDS)])
    return joints, np.array(found).swapaxes(0, 1) if found else np.zeros(0)


def _hypotheses(joints: Sequence[int], bodies: int) -> Iterator[tuple[str, tuple[int, ...], NDArray[np.intp], Array]]:
    """Yield kind, places, column of each parameter, shape (p,), and whether it acts on a joint, shape (joints, p)."""
    count = len(joints)
    yield "none", (), np.zeros(0, dtype=np.intp), np.zeros((count, 0))
    for size in {*range(1, min(count, 3 if count <= MOST_JOINTS else 1) + 1), count}:
        for some in combinations(range(count), size):
            yield "gain", tuple(joints[place] for place in some), np.zeros(size, dtype=np.intp), np.eye(count)[:, some]
    every = np.ones((count, SIZE))
    if count > 1:
        yield "common gain", tuple(joints), np.zeros(1, dtype=np.intp), every[:, :1]
    yield "gravity", (), np.arange(1, 4), every[:, :3]
    for body in range(bodies):
        yield "body", (body,), np.arange(4 + SIZE * body, 4 + SIZE * (body + 1)), every


def _fit(products: Array, kind: str, places: tuple[int, ...], columns: NDArray[np.intp], acts: Array) -> Hypothesis:
    """Fit a cause to all folds but one, judge it on this one, and fit it to the whole log."""
    square = products[:, :, 0, 0]
    along = products[:, :, 0, 1 + columns] * acts
    inner = products[:, :, 1 + columns[:, None], 1 + columns] * acts[:, :, None] * acts[:, None]
    held_out = np.zeros(len(acts))
    for fold in range(FOLDS):
        others = np.arange(FOLDS) != fold
        values = _solve(*(each[others].sum(axis=0) for each in (square, along, inner)))
        held_out += square[fold] - 2 * along[fold] @ values + np.einsum("kpq,p,q->k", inner[fold], values, values)
    values = _solve(*(each.sum(axis=0) for each in (square, along, inner)))
    cost = float(np.log(np.maximum(held_out, 0.0) + FLOOR).sum()) + PER_GAIN * len(columns) * ("gain" in kind)
    return Hypothesis(kind, places, held_out, cost, values * (SCALES if kind == "body" else 1.0))


def _solve(square: Array, along: Array, inner: Array) -> Array:
    """Fit the parameters, with joints weighted by the inverse of their residuals."""
    left, values = square, np.zeros(along.shape[1])
    for _ in range(4):
        weight = 1 / (np.maximum(left, 0.0) + FLOOR)
        values = np.linalg.lstsq(np.einsum("k,kpq->pq", weight, inner), weight @ along, rcond=1e-7)[0]
        left = square - 2 * along @ values + np.einsum("kpq,p,q->k", inner, values, values)
    return values


def _possible(evidence: Evidence, found: Hypothesis) -> bool:
    """Whether a cause is physically possible: positive gains, gravity of the given size, a positive mass."""
    if found.kind in ("gain", "common gain"):
        return bool(np.all(found.values > -1))
    if found.kind == "gravity":
        given = evidence.robot.gravity
        return bool(abs(np.linalg.norm(given + found.values) - (size := np.linalg.norm(given))) < 0.1 * size)
    if found.kind == "body":
        own = evidence.robot.tree.model.inertias[found.places[0] + 1].toDynamicParameters() + found.values
        return float(own[0]) > 0
    return True
