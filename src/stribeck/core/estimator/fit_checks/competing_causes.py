"""Competing causes: single errors of sensors or model that explain what the priors do not allow (equation 34).

One fault, such as an encoder zero that is off by 5 degrees, strains many corrections. Each cause is therefore tried as
additional columns without a prior. With the corrections u, their prior's precision P and mean m, the covariance C of
the fit, and a direction D of u, chi^2 and the prior's share decrease by Rao's score statistic

    w^T N^-1 w,    w = D^T P (u - m),    N = D^T (P - P C P) D

For columns A_E of the normal equations that the fit does not contain, with the residual r of the equations and the
derivatives J by all coordinates, w = r_E and N = A_EE - A_E^T J C J^T A_E. The largest decrease names the cause, unless
others explain nearly as much. Large errors are not linear, so that no second cause is sought in the rest, except
other gains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.equations.whole_log.corrections import CORRECTIONS
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.solver.elimination import solve
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.solver.statistics import Statistics
from stribeck.core.robot.inertial_parameters import SIZE

LEAST = 60.0
"""Smallest decrease of chi^2 for a cause [1]; errors that no cause describes stay below 40 on sound walks."""

SHARE = 0.4
"""Smallest share of the prior's part of chi^2 that the cause must explain [1]."""

ROUNDING = 1e-5
"""Information on a direction relative to its information without a fit, below which it is rounding error [1]."""

RIVAL = 0.7
"""Decrease of chi^2 relative to the best cause from which another one is listed as well [1]."""

FAR, SURE = 5.0, 4.0
"""Smallest size of a cause in prior standard deviations of the same error [1], and of the first wrong gain in standard
errors [1], so that its interval is half as wide as its size."""

HEAVIEST = 5.0
"""Largest factor between the mass of a body, or all torques, and the model's [1]."""


@dataclass(frozen=True, eq=False)
class Cause:
    """A single error of sensors or model.

    Attributes
    ----------
    kind
        "scale", "gain", "body", "rotor", "delay", or the kind of a correction.
    places
        Numbers of the joints, encoders or bodies.
    evidence
        Decrease of chi^2 and the prior's share, discounted by overdispersion [1].
    values, errors
        Size of the error and its standard errors: logarithm of the factor, share of the torque, angles [rad], delay
        [s], mass [1] and center, rotor inertia [kg m^2].
    """

    kind: str
    places: tuple[int, ...]
    evidence: float
    values: Array
    errors: Array


@dataclass(frozen=True, eq=False)
class Causes:
    """Causes of a log's errors.

    Attributes
    ----------
    rivals
        The cause, or several that explain the residual about equally well.
    more_gains
        Other wrong gains, if the cause is a gain.
    leading
        Kind of the cause with the largest evidence, also if that is too small; "" without any.
    scale_error
        Standard error of the scale of all torques [1]; zero without corrections of the masses, which it rests on.
    bodies
        Coordinates of the bodies' corrections with their first priors, shape (L, 10).
    """

    rivals: list[Cause]
    more_gains: list[Cause]
    leading: str
    scale_error: float
    bodies: Array


Columns = tuple[str, tuple[int, ...], Array, float]
"""Kind, places, columns in the coordinates of `_Score`, shape (size, k), and smallest size of one value."""


@dataclass(frozen=True, eq=False)
class _Score:
    """Score w and information N of all single columns: coordinates of corrections, then columns outside of the fit.

    `scale` is the information without a fit, shape (size,), against which rounding errors are measured.
    """

    score: Array
    information: Array
    scale: Array

    def test(self, columns: Array) -> tuple[float, Array, Array]:
        """Compute the decrease of chi^2, and the values of some columns with their standard errors.

        Directions that the fit contains already are left out.
        """
        unit = 1 / np.sqrt(np.maximum(self.scale @ columns**2, 1e-30))
        share, vectors = np.linalg.eigh(unit[:, None] * (columns.T @ self.information @ columns) * unit)
        vectors = unit[:, None] * vectors[:, share > ROUNDING] / np.sqrt(share[share > ROUNDING])
        along = vectors.T @ (columns.T @ self.score)
        return float(along @ along), vectors @ along, np.linalg.norm(vectors, axis=1)


def find_causes(log: WholeLogFit) -> Causes:
    """Find the cause of a log's errors, with its rivals."""
    model, nominal, statistics = log.fit.model, log.fit.model.prior_std.copy(), log.read.whole
    nominal[model.layout.part("bodies", "tilts")] = 1.0
    fit = solve(statistics, replace(log.fit, model=replace(model, prior_std=nominal, overdispersion=1.0)))
    score, discount = _score(fit, statistics), max(1.0, log.chi_square, log.heterogeneity)
    noise = discount * float(statistics.loads[0].max())  # windows of one joint
    off = fit.corrections - fit.model.prior_mean
    strain = float(off @ fit.model.precision @ off) / discount
    joints = log.read.equations.forms[0].joints  # of each limb, whose torques may share a gain
    limbs = [np.flatnonzero(log.robot.standing((foot,))[joints]) for foot in log.robot.contacts]
    causes, tests, sizes = list(_causes(fit, limbs)), list[Cause](), dict[tuple[str, tuple[int, ...]], float]()
    for kind, places, columns, least in causes:
        evidence, values, errors = score.test(columns)
        if kind == "gain" and errors.all():
            evidence, values, errors = _without_noise(values, errors, len(places) * noise)
        sure = values / np.maximum(errors, 1e-30)
        possible = {
            "rotor": sure.max() > -sure.min(),
            **dict.fromkeys(("body", "scale"), abs(values[0]) < np.log(HEAVIEST)),  # the audit names larger scales
            "gain": values[0] < 1 and abs(sure[0]) > SURE,
        }.get(kind, True)
        if possible and np.abs(values).max() > least:
            gain = evidence / discount - 2 * len(values)
            tests.append(Cause(kind=kind, places=places, evidence=gain, values=values, errors=errors))
            sizes[kind, places] = float(np.abs(values).max()) / least * (len(places) if kind == "gain" else 1)
    tests.sort(key=lambda cause: -cause.evidence)
    leading = tests[0].kind if tests else ""
    rivals = [cause for cause in tests if cause.evidence > RIVAL * tests[0].evidence]
    rivals.sort(key=lambda cause: sizes[cause.kind, cause.places])  # the likeliest first
    if not tests or tests[0].evidence < max(LEAST, SHARE * strain):
        rivals = []
    more = _more_gains(score, causes, rivals[0], discount, noise) if len(rivals) == 1 and leading == "gain" else []
    scale = min((float(score.test(columns)[2][0]) for kind, _, columns, _ in causes if kind == "scale"), default=0.0)
    return Causes(rivals, more, leading, scale, fit.corrections[model.layout.part("bodies")].reshape(-1, SIZE))


def _more_gains(score: _Score, causes: list[Columns], first: Cause, discount: float, noise: float) -> list[Cause]:
    """Add the most evident gain to the first one, and then to both, until the next one is not clear.

    A correction of only the first would move the errors of other gains to more joints.
    """
    gains = {places: columns for kind, places, columns, _ in causes if kind == "gain"}
    along, additions = gains[first.places], list[Cause]()
    taken = set(first.places)
    while True:
        tests = []
        for places, columns in gains.items():
            if len(places) > 1 or taken & set(places):
                continue
            _, values, errors = score.test(np.hstack([along, columns]))
            if errors.all():
                size = _without_noise(values[-1:], errors[-1:], noise)
                tests.append(Cause("gain", places, size[0] / discount, *size[1:]))
        best = max(tests, key=lambda cause: cause.evidence, default=first)
        if not tests or best.evidence < LEAST:
            return additions
        additions.append(best)
        taken |= set(best.places)
        along = np.hstack([along, gains[best.places]])


def _without_noise(values: Array, errors: Array, noise: float) -> tuple[float, Array, Array]:
    """Correct a gain and its evidence for the torque's noise, which is in the column of the gain and in the residual.

    It makes smaller torques seem to fit better: it adds between 0 and `noise` to the score, one per window and joint.
    The evidence is the smallest possible one.
    """
    most = errors**2 * noise
    least = np.where(values > 0, np.maximum(values - most, 0.0), values)
    return float(np.sum((least / errors) ** 2)), values - most / 2, np.hypot(errors, most / np.sqrt(12))


def _score(fit: Fit, statistics: Statistics) -> _Score:
    f, c, n = statistics.friction, len(fit.corrections), fit.internal.size
    outside = _outside(fit)
    P, C, A = fit.model.precision, fit.covariance, statistics.information
    pulled = fit.pulled(A[:, outside])  # J^T A_E
    PC = P @ C[n:]
    information = np.zeros((c + len(outside),) * 2)
    information[:c, :c] = P - PC[:, n:] @ P
    information[:c, c:] = PC @ pulled
    information[c:, :c] = information[:c, c:].T
    information[c:, c:] = A[np.ix_(outside, outside)] - pulled.T @ C @ pulled
    residual = (statistics.right - A @ fit.values)[:f]
    score = np.append(P @ (fit.corrections - fit.model.prior_mean), residual[outside])
    return _Score(score, information, np.append(fit.model.prior_std**-2, np.diag(A)[outside]))


def _outside(fit: Fit) -> IntArray:
    """Find the columns of each joint's delay, of its rotor inertia and of its gain, which no fit contains."""
    joints, per_joint = len(fit.internal), fit.laws.jacobians(fit.internal).shape[1]
    terms = [parameter.name for parameter in fit.laws.terms]
    first = per_joint - len(terms)
    places = [first + terms.index(term) for term in ("delay", "rotor", "gain")]
    return np.concatenate([place + per_joint * np.arange(joints) for place in places])


def _causes(fit: Fit, limbs: Sequence[IntArray]) -> Iterator[Columns]:
    """Yield the columns of all causes that the fit does not estimate anyway; values are in the units of `Cause`."""
    model, layout, priors, joints = fit.model, fit.model.layout, fit.model.priors, len(fit.internal)
    c = layout.size
    every = np.eye(c + 3 * joints)
    bodies, gains = layout.places("bodies").reshape(-1, SIZE), layout.places("gains")
    if len(bodies):
        whole = every[:, bodies[:, 0]].sum(axis=1) / priors.mass
        whole = whole + every[:, bodies[:, 4:7].ravel()].sum(axis=1) / (np.sqrt(2) * priors.moments)
        yield "scale", (), whole[:, None], 3 * priors.mass
    loaded = set(model.loaded.tolist()) if len(gains) else set(range(joints))
    places, unit = (gains, priors.torque_gain) if len(gains) else (c + 2 * joints + np.arange(joints), 1.0)
    groups = [*(loaded.intersection(limb.tolist()) for limb in limbs), *({k} for k in loaded)]
    for group in dict.fromkeys(tuple(sorted(members)) for members in groups if members):
        column = every[:, places[list(group)]].sum(axis=1) / unit
        yield "gain", group, column[:, None], FAR * priors.torque_gain
    for correction in (entry for entry in CORRECTIONS if entry.kind):
        indices = layout.places(correction.name)
        for k, some in enumerate(np.split(indices, len(indices) if correction.apart else 1) if len(indices) else []):
            scale = float(model.scales[some[0] - layout.part("bodies").stop])
            yield correction.kind, (k,) * correction.apart, every[:, some] / scale, FAR * scale
    for k, body in enumerate(bodies):
        if layout.inertial_parameters[k, 0] > 0:
            scales = [priors.mass, *3 * [priors.centre_of_mass]]
            yield "body", (k,), every[:, body[:4]] / scales, FAR * min(scales)
    for k in () if layout.command_delays else range(joints):  # found from the motion, before the fit
        yield "delay", (k,), every[:, [c + k]] / priors.torque_delay, FAR * priors.torque_delay
    if not layout.rotors:
        yield "rotor", tuple(range(joints)), every[:, c + joints : c + 2 * joints], 1e-3
