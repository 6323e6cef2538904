"""Causes of disturbances: whether a payload explains the spans that are set aside (docs/estimator.md, "Outliers").

The residual of the fit in a span is regressed on the inertial parameters of each body: a payload, here a point mass,
adds to the parameters of the body that carries it. A hand or a table, whose forces do not follow the motion, leaves
most of the residual unexplained.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.robot.inertial_parameters import SIZE, inertial_parameters
from stribeck.whole_log.equations.equation_sequence import EquationSequence
from stribeck.whole_log.model.terms import Columns
from stribeck.whole_log.noise.variance_components import VarianceComponents

EXPLAINED = 0.95
"""Share of a span's residual chi^2 that a payload must explain [1]."""

CHANGE = 0.25
"""Time at both ends of a span in which a payload may change [s]."""

SAME = 0.02
"""Largest difference of the masses of one payload in several spans, relative to the mass [1]."""


@dataclass(frozen=True, eq=False)
class Payload:
    """A point mass on a body in spans of logs.

    Attributes
    ----------
    body
        Number of the body.
    mass
        Mass [kg].
    centre
        Center of mass in the body's frame [m], shape (3,).
    spans
        Number of the log, start and end of each span [s].
    """

    body: int
    mass: float
    centre: Array
    spans: tuple[tuple[int, float, float], ...]


def find_payloads(
    equations: EquationSequence,
    spans: Sequence[tuple[int, float, float]],
    columns: Columns,
    components: VarianceComponents,
    values: Array,
) -> list[Payload]:
    """Find the spans that a payload explains, and merge the spans of equal payloads.

    Parameters
    ----------
    equations
        Equations of all segments, with the delay of the fit.
    spans
        Number of the log, start and end of each span that is set aside [s].
    columns, components, values
        Columns, variance components and values of the fit.
    """
    groups: list[tuple[int, float, Array, list[tuple[int, float, float]]]] = []
    for span in spans if equations.corrections.bodies else ():
        products = _products(equations, span, columns, components, values)
        fits = [_point_mass(product) for product in products]
        left = np.array([1 - explained for _, explained in fits])
        body = int(np.flatnonzero(left <= 1.5 * left.min())[-1])  # of bodies that explain as much, the last one
        (mass, *_), explained = fits[body]
        if explained < EXPLAINED or mass <= 0:
            continue
        same = next((g for g in groups if g[0] == body and abs(g[1] - mass) < SAME * mass), None)
        if same:
            same[2][:] += products[body]
            same[3].append(span)
        else:
            groups.append((body, mass, products[body], [span]))
    found = []
    for body, _, product, own in groups:
        (mass, *centre), _ = _point_mass(product)
        found.append(Payload(body, mass, np.array(centre), tuple(own)))
    return found


def _point_mass(product: Array) -> tuple[list[float], float]:
    """Fit a point mass: mass [kg] and position [m], and the share of chi^2 that it explains [1].

    The fit starts with only mass and first moments; Gauss-Newton steps add the second moments.
    """
    start = np.linalg.lstsq(product[:4, :4], product[:4, -1], rcond=1e-9)[0]
    point = np.append(start[0], start[1:] / start[0]) if start[0] > 0 else np.zeros(4)
    for _ in range(10 if start[0] > 0 else 0):
        slopes = np.stack([(_parameters(point + step) - _parameters(point - step)) / 2e-4 for step in 1e-4 * np.eye(4)])
        right = slopes @ (product[:-1, -1] - product[:-1, :-1] @ _parameters(point))
        point = point + np.linalg.lstsq(slopes @ product[:-1, :-1] @ slopes.T, right, rcond=1e-9)[0]
    own = _parameters(point)
    explained = own @ (2 * product[:-1, -1] - product[:-1, :-1] @ own) / max(product[-1, -1], 1e-300)
    return point.tolist(), float(explained)


def _parameters(point: Array) -> Array:
    """Compute the inertial parameters of a point mass, shape (10,), from mass and position, shape (4,)."""
    mass, centre = point[0], point[1:]
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[3, 3] = mass * np.outer(centre, centre), mass
    matrix[:3, 3] = matrix[3, :3] = mass * centre
    return inertial_parameters(matrix)


def _products(
    equations: EquationSequence,
    span: tuple[int, float, float],
    columns: Columns,
    components: VarianceComponents,
    values: Array,
) -> Array:
    """Sum the products of the columns of each body's parameters and of the residual over a span, shape (L, 11, 11)."""
    number, start, end = span
    bodies = len(equations.corrections.bodies)
    total = np.zeros((bodies, SIZE + 1, SIZE + 1))
    form = equations.forms[number]
    for place, (log, segment, _) in enumerate(equations.parts):
        if log != number or form.log.time[segment.last - 1] < start or form.log.time[segment.first] > end:
            continue
        part = equations[place]
        residual = part.residual.ravel() - columns.design(part, columns.by_joint(part)) @ values
        inside = (part.time > start + CHANGE) & (part.time < end - CHANGE)
        weight = inside[:, None] / np.sqrt(components.marginal(part))
        assert part.regressors is not None
        own = part.regressors[:, :, : SIZE * bodies].reshape(*weight.shape, bodies, SIZE)
        left = np.broadcast_to(residual.reshape(*weight.shape, 1, 1), (*own.shape[:3], 1))
        rows = weight[:, :, None, None] * np.concatenate([own, left], axis=3)
        total += np.einsum("kmbi,kmbj->bij", rows, rows, optimize=True)
    return total
