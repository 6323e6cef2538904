"""Payloads that explain disturbed spans, and the residual in a span (docs/estimator-fit.md, "Outliers").

The residual of the fit in a span is regressed on the inertial parameters of each body: a payload, here a point mass,
adds to the parameters of the body that carries it. A hand or a table, whose forces do not follow the motion, leaves
most of the residual unexplained.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.payload import MARGIN
from stribeck.core.equations.whole_log.equation_sequence import EquationSequence
from stribeck.core.estimator.reading import Reading
from stribeck.core.robot.inertial_parameters import SIZE, inertial_parameters

EXPLAINED = 0.95
"""Share of a span's residual chi^2 that a payload, a force or a torque must explain [1]."""

SAME = 0.05
"""Largest difference of the masses of one payload in several spans, relative to the mass [1]."""


@dataclass(frozen=True, eq=False)
class Payload:
    """A point mass on a body in spans of logs.

    Attributes
    ----------
    body
        Number of the body.
    mass
        Mass [kg], negative if the fit contains it and it is missing in the spans.
    centre
        Center of mass in the body's frame [m], shape (3,).
    spans
        Number of the log, start and end of each span [s].
    """

    body: int
    mass: float
    centre: Array
    spans: tuple[tuple[int, float, float], ...]


@dataclass(frozen=True, eq=False)
class Residual:
    """Residual of the fit in the windows of a span, without its ends.

    Attributes
    ----------
    time
        Time of the windows' centers [s], shape (K,).
    torque, weight
        Residual [N m], and its inverse standard deviation, shape (K, m) each.
    products
        Products of the columns of each body's parameters and of the residual, shape (bodies, 11, 11).
    """

    time: Array
    torque: Array
    weight: Array
    products: Array


def residual_in(equations: EquationSequence, span: tuple[int, float, float], read: Reading, values: Array) -> Residual:
    """Compute the residual in a span.

    Parameters
    ----------
    equations
        Equations of all segments, with the delay of the fit.
    span
        Number of its log, start and end [s].
    read, values
        The log as it was read, and the values of the fit.
    """
    number, start, end = span
    time, bodies = equations.forms[number].log.time, len(equations.corrections.bodies)
    empty = np.zeros((0, len(equations.forms[number].joints)))
    pieces, products = [(np.zeros(0), empty, empty)], np.zeros((bodies, SIZE + 1, SIZE + 1))
    for place, (log, segment, _) in enumerate(equations.parts):
        if log != number or time[segment.last - 1] < start or time[segment.first] > end:
            continue
        part = equations[place]
        fitted = read.columns.design(part, read.columns.by_joint(part)) @ values
        torque = part.residual - fitted.reshape(part.residual.shape)
        inside = (part.time > start + MARGIN) & (part.time < end - MARGIN)
        torque, weight = torque[inside], 1 / np.sqrt(read.pilot.components.marginal(part)[inside])
        pieces.append((part.time[inside], torque, weight))
        if bodies:
            assert part.regressors is not None
            design = part.regressors[inside][:, :, : SIZE * bodies].reshape(*torque.shape, bodies, SIZE)
            design = np.concatenate([design, np.broadcast_to(torque[:, :, None, None], (*design.shape[:3], 1))], axis=3)
            design *= weight[:, :, None, None]
            products += np.einsum("kmbi,kmbj->bij", design, design, optimize=True)
    times, torques, weights = map(np.concatenate, zip(*pieces, strict=True))
    return Residual(times, torques, weights, products)


def find_payloads(residuals: Mapping[tuple[int, float, float], Residual]) -> list[Payload]:
    """Find the spans that a payload explains, from the residual in each, and merge the spans of equal payloads.

    Different masses on one body, each seen in the torque of only one joint, are not payloads: the joint rubs, or its
    torque is wrong.
    """
    groups: list[tuple[int, float, Array, list[tuple[int, float, float]]]] = []
    for span, residual in residuals.items():
        products = residual.products
        if not len(products):
            continue
        fits = [_point_mass(product) for product in products]
        rests = np.array([1 - explained for _, explained in fits])
        body = int(np.flatnonzero(rests <= 1.5 * rests.min())[-1])  # of bodies that explain as much, the last one
        (mass, *_), explained = fits[body]
        if explained < EXPLAINED:
            continue
        same = next((g for g in groups if g[0] == body and abs(g[1] - mass) < SAME * abs(mass)), None)
        if same:
            same[2][:] += products[body]
            same[3].append(span)
        else:
            groups.append((body, mass, products[body].copy(), [span]))
    missing = max((len(g[3]) for g in groups if g[1] < 0), default=0)  # spans of the one payload that the fit contains
    groups = [g for g in groups if g[1] > 0 or len(g[3]) == missing]
    payloads = []
    single = [all(_of_one_joint(residuals[span]) for span in spans) for *_, spans in groups]
    bodies = [body for (body, *_), alone in zip(groups, single, strict=True) if alone]
    for (body, _, product, spans), alone in zip(groups, single, strict=True):
        if alone and bodies.count(body) > 1:
            continue
        (mass, *centre), _ = _point_mass(product)
        payloads.append(Payload(body, mass, np.array(centre), tuple(spans)))
    return payloads


def _of_one_joint(residual: Residual) -> bool:
    """Whether one joint has most of the residual, although others are measured."""
    squares = ((residual.torque * residual.weight) ** 2).sum(axis=0)
    return len(squares) > 1 and bool(squares.max() > EXPLAINED * squares.sum())


def _point_mass(product: Array) -> tuple[list[float], float]:
    """Fit a point mass: mass [kg], negative if missing, position [m], and the share of chi^2 that it explains [1].

    The fit starts with only mass and first moments; Gauss-Newton steps add the second moments.
    """
    start = np.linalg.lstsq(product[:4, :4], product[:4, -1], rcond=1e-9)[0]
    point = np.append(start[0], start[1:] / start[0]) if start[0] else np.zeros(4)
    for _ in range(10 if start[0] else 0):
        slopes = np.stack([(_parameters(point + step) - _parameters(point - step)) / 2e-4 for step in 1e-4 * np.eye(4)])
        right = slopes @ (product[:-1, -1] - product[:-1, :-1] @ _parameters(point))
        point = point + np.linalg.lstsq(slopes @ product[:-1, :-1] @ slopes.T, right, rcond=1e-9)[0]
    parameters = _parameters(point)
    explained = parameters @ (2 * product[:-1, -1] - product[:-1, :-1] @ parameters) / max(product[-1, -1], 1e-300)
    return point.tolist(), float(explained)


def _parameters(point: Array) -> Array:
    """Compute the inertial parameters of a point mass, shape (10,), from mass and position, shape (4,)."""
    mass, centre = point[0], point[1:]
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[3, 3] = mass * np.outer(centre, centre), mass
    matrix[:3, 3] = matrix[3, :3] = mass * centre
    return inertial_parameters(matrix)
