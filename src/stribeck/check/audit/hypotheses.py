"""Competition of single causes of torques that disagree with the model of a robot on a fixed base.

A mass at the flange, a tilted base and a wrong torque gain all make gravity's torques look too large or too small. All
causes are compared by their marginal likelihood: torques are linear in the cause, in friction, and in small errors of
all bodies. Friction is projected out; the errors of bodies have the priors of `[identify.priors]`, or twice or four
times as large ones, and are integrated out, so that a cause wins only if usual errors of a model do not explain the
torques as well. Beside a body as the cause, the errors have only the priors: larger ones would take over its mass.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from stribeck.check.audit.evidence import AuditData
from stribeck.check.audit.motion import gravity_torques
from stribeck.check.audit.regression import effective_share, friction_shapes, without
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.state import State
from stribeck.core.equations.whole_log.corrections import inertial_parameters_of
from stribeck.core.equations.whole_log.regressors import inertia_regressors
from stribeck.core.estimator.model.bodies import bodies_of
from stribeck.core.robot.inertial_parameters import SIZE

FLOOR = 5e-4
"""Share of a torque's variance [1] that any model of load and friction leaves unexplained: 2 % of its amplitude."""
FEWEST_BINS = 125
"""Bins from which causes are compared [1]."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One cause, fitted to the log.

    Attributes
    ----------
    kind
        "none", "gain", "common gain", "gravity" or "body".
    places
        Numbers of the torque-controlled joints, or the number of the body.
    cost
        Minus the logarithm of the marginal likelihood, up to a constant [1].
    values
        Changes: of the gain of each place [1], of gravity [m/s^2], or of a body's inertial parameters in its joint's
        frame.
    explains
        Whether the cause and usual errors of bodies explain the torques up to `FLOOR`, or the cause explains at least
        half of the torques that these errors leave.
    """

    kind: str
    places: tuple[int, ...]
    cost: float
    values: Array
    explains: bool

    def gains(self, joints: Sequence[str]) -> dict[str, float]:
        """Gains by joint [1]."""
        return {joints[k]: 1 + change for k, change in zip(self.places, self.values.tolist(), strict=True)}


def compete(evidence: AuditData, joints: Sequence[int]) -> list[Hypothesis]:
    """Fit all causes to the torques of some joints, and sort them by cost; empty without enough evidence.

    Errors of bodies are multiplied by gains. If gains far from one win, the torques are divided by them first; then
    only these gains are listed.
    """
    factors, linear, rounds = np.ones(len(evidence.joints)), 2.0, 4  # gains up to `linear` and errors of bodies add [1]
    for _ in range(rounds):
        ranking = _ranked(replace(evidence, torque=evidence.torque / factors), joints)
        if not ranking or "gain" not in ranking[0].kind:
            break
        gains = np.array([ranking[0].gains(evidence.joints).get(name, 1.0) for name in evidence.joints])
        far = np.abs(np.log(gains)) > np.log(linear)
        if not far.any():
            break
        factors *= np.where(far | (ranking[0].kind == "common gain"), gains, 1.0)
    else:
        return _ranked(evidence, joints)  # gains that never settle explain nothing
    if not ranking or np.all(factors == 1):
        return ranking
    best, kind = ranking[0], "common gain" if len(set(factors.tolist())) == 1 else "gain"
    if best.kind == kind and (kind == "common gain" or rivals(ranking)):
        factors[list(best.places)] *= 1 + best.values
    changed = np.flatnonzero(factors != 1)
    return [replace(best, kind=kind, places=tuple(changed.tolist()), values=factors[changed] - 1)]


def _ranked(evidence: AuditData, joints: Sequence[int]) -> list[Hypothesis]:
    """Fit all causes as small changes, and sort them by cost."""
    robot, position = evidence.robot, evidence.prepared.log.position
    others = np.delete(position, robot.torque_controlled, axis=1)  # their velocities are not among the evidence
    if robot.base != "fixed" or robot.loops or len(evidence.rows) < FEWEST_BINS or np.ptp(others, axis=0).any():
        return []
    parameters = inertial_parameters_of(robot)
    slopes = bodies_of(parameters, robot.settings.priors).slopes(np.zeros_like(parameters))
    joints, gram, samples = _gram(evidence, joints, slopes)
    if len(joints) < min(2, len(evidence.joints)):
        return []
    first = 1 + len(joints) + 3
    mass, reach = 0.2, 0.2  # prior standard deviation of a body's mass relative to the robot's [1], and its center [m]
    scales = mass * parameters[:, 0].sum() * reach ** np.array([0, *3 * [1], *6 * [2]])
    causes: dict[tuple[str, tuple[int, ...]], Hypothesis] = {}
    for spread in (1.0, 2.0, 4.0):  # errors of bodies relative to their priors; each cause has the most likely of them
        of_bodies = gram[first:, first:] + np.eye(len(gram) - first) / spread**2
        marginal = gram - gram[:, first:] @ np.linalg.solve(of_bodies, gram[first:])
        volume = np.linalg.slogdet(spread**2 * of_bodies)[1]
        for kind, places, columns, size in _causes(joints, slopes, scales):
            if kind == "body" and spread > 1:
                continue
            directions = columns * size
            inner = directions.T @ marginal[1:, 1:] @ directions + np.eye(directions.shape[1])
            along = directions.T @ marginal[1:, 0]
            fitted = np.linalg.solve(inner, along)
            cost = 0.5 * float(marginal[0, 0] - along @ fitted + np.linalg.slogdet(inner)[1] + volume)
            if (kind, places) not in causes or cost < causes[kind, places].cost:
                squares = float(marginal[0, 0]), float(marginal[0, 0] - along @ fitted)
                # a cause explains all torques, or half of the squares that usual errors of bodies leave
                explains = squares[1] < max(samples, 0.5 * squares[0])
                values = np.resize(size * fitted, len(places)) if "gain" in kind else np.asarray(size * fitted)
                causes[kind, places] = Hypothesis(kind, places, cost, values, explains)
    return sorted((cause for cause in causes.values() if _possible(evidence, cause)), key=lambda cause: cause.cost)


def rivals(causes: Sequence[Hypothesis]) -> list[Hypothesis]:
    """List the best cause of each kind that is not clearly worse than the best.

    The list is empty if the model is about as good, or if the best cause leaves most of the disagreement.
    """
    clearly = 6.0  # difference of the logarithms of marginal likelihoods from which a cause is clearly better [1]
    best: dict[str, Hypothesis] = {}
    for cause in causes:
        if cause.cost < causes[0].cost + clearly:
            best.setdefault(cause.kind, cause)
    return [] if "none" in best or not (causes and causes[0].explains) else list(best.values())


def _gram(evidence: AuditData, among: Sequence[int], slopes: Array) -> tuple[list[int], Array, float]:
    """Compute the joints and the weighted Gram matrix of all columns without friction.

    The first column is the torque minus the model's; then the model's torque of each joint, gravity's three directions,
    and the bodies, in units of their priors. Weights are independent samples divided by the unexplained variance.
    """
    robot, count = evidence.robot, len(evidence.rows)
    rows = np.unique(np.linspace(0, count - 1, min(count, 1500)).astype(int))
    rows = rows[np.isfinite(evidence.model[rows]).all(axis=1)]
    if len(rows) < FEWEST_BINS:
        return [], np.zeros((0, 0)), 0.0
    known, log = robot.torque_controlled, evidence.prepared.log
    position = log.position[evidence.rows[rows]]
    motion = np.zeros((2, *position.shape))
    motion[:, :, known] = evidence.velocity[rows], evidence.acceleration[rows]
    columns = np.argsort(robot.tree.columns)[known]
    of_bodies = inertia_regressors(robot, robot.tree, columns, State(position, *motion), None)
    gravity = gravity_torques(evidence, robot, np.eye(3))[rows]
    joints, parts, samples = [], [], 0.0
    for k in among:
        slow = 0.1  # speed relative to the top speed [1], below which friction changes too quickly with velocity
        sliding = np.abs(evidence.velocity[rows, k]) > slow * evidence.top_speed[k]
        at, torque = rows[sliding], evidence.torque[rows[sliding], k]
        if not evidence.moves(k) or len(at) < FEWEST_BINS or torque.std() == 0:
            continue
        bodies = np.einsum("rbp,bpc->rbc", of_bodies[sliding, k].reshape(len(at), -1, SIZE), slopes)
        model = evidence.model[at, k]
        design = np.column_stack([torque - model, model, gravity[sliding, k], bodies.reshape(len(at), -1)])
        design, load = without(friction_shapes(evidence, k, at), design, torque)
        error = design[:, 0] - design[:, 1:] @ np.linalg.lstsq(design[:, 1:], design[:, 0], rcond=1e-6)[0]
        if float(load @ load) <= max(1e-6 * float(torque @ torque), 2 * float(error @ error)):
            continue  # friction hides the model, or no cause explains half of the torque without friction
        variance = max(float(error @ error) / len(at), FLOOR * float(torque.var()))
        joints.append(k)
        share = effective_share(design[:, 1], error, evidence.run[at])
        samples += share * len(at)
        parts.append(design * np.sqrt(share / variance))
    if not joints:
        return [], np.zeros((0, 0)), 0.0
    gram = np.zeros((1 + len(joints) + parts[0].shape[1] - 2,) * 2)
    for place, design in enumerate(parts):
        at = np.r_[0, 1 + place, 1 + len(joints) : len(gram)]
        gram[np.ix_(at, at)] += design.T @ design
    return joints, gram, samples


def _causes(
    joints: list[int], slopes: Array, scales: Array
) -> Iterator[tuple[str, tuple[int, ...], Array, Array | float]]:
    """Yield kind, places, columns per unit, shape (columns, parameters), and prior standard deviation of each cause."""
    count, unit = len(joints), np.eye(len(joints) + 3 + SIZE * len(slopes))
    yield "none", (), unit[:, :0], 1.0
    of_gain, of_gravity = 0.5, 3.0  # prior standard deviations [1], [m/s^2]
    most_joints = 8  # number of joints up to which gains of two and three of them are tried [1]
    for size in sorted({*range(1, min(count, 3 if count <= most_joints else 1) + 1), count}):
        for some in combinations(range(count), size):
            yield "gain", tuple(joints[place] for place in some), unit[:, list(some)], of_gain
    if count > 1:
        yield "common gain", tuple(joints), unit[:, :count].sum(axis=1, keepdims=True), of_gain
    yield "gravity", (), unit[:, count : count + 3], of_gravity
    for body in range(len(slopes)):
        first = count + 3 + SIZE * body
        yield "body", (body,), unit[:, first : first + SIZE] @ np.linalg.inv(slopes[body]), scales


def _possible(evidence: AuditData, cause: Hypothesis) -> bool:
    """Whether a cause is physically possible: positive gains, gravity of the given size, a positive mass."""
    if cause.kind == "gravity":
        size = np.linalg.norm(evidence.robot.gravity)
        return bool(abs(np.linalg.norm(evidence.robot.gravity + cause.values) - size) < 0.1 * size)
    if cause.kind == "body":
        masses = [inertia.mass for inertia in list(evidence.robot.tree.model.inertias)[1:]]
        return bool(-masses[cause.places[0]] < cause.values[0] < sum(masses))
    return bool(np.all(cause.values > -1))
