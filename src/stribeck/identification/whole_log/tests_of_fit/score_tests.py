"""Score tests of alternative terms, friction that no law of velocity describes (docs/estimator.md, equations 33 to 36).

A law that is fitted to friction that it cannot describe gives an average, and its intervals do not show it. With e the
whitened residual of a sample of the log, T the columns of `AlternativeTerms`, J those of all that is fitted, H their
curvature on this sample, and Z the columns of the random effects, of variances Q,

    score        s = T^T e - T^T J H^-1 (J^T e)
    information  N = T^T T - T^T J H^-1 (J^T T)
    covariance   V = N + B Q B^T,   B = T^T Z - T^T J H^-1 (J^T Z)

and with z = N^-1 s, z^T (N^-1 V N^-1)^-1 z is chi^2 distributed if there is no such friction (Rao 1948). A term is
flagged if this is improbable, and the term is no small part of the friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import chdtrc  # the tail of chi square

from stribeck.identification.whole_log.constants import LEAST_FRICTION, LEAST_MINUS_LOG10_P, LEAST_SHARE
from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.identification.whole_log.model.model_corrections import ModelCorrections
from stribeck.identification.whole_log.model.parametrisation import Parametrisation
from stribeck.identification.whole_log.solver.normal_equations import NormalEquations
from stribeck.identification.whole_log.solver.solve import Solution, curvature
from stribeck.identification.whole_log.tests_of_fit.alternative_terms import COLUMNS, GAIN_COLUMN, KINDS, NO_TORQUE
from stribeck.typing import Array

LEAST_INFORMATION = 1e-6
"""Information [1/(N m)^2] below which a term is not tested: the law contains it."""


SENTENCES = {
    "load": "friction changes with the torque that the joint carries",
    "drift": "friction drifts in the course of the log",
    "presliding": "friction builds up over some way after a reversal, as bristles deflect or a gear winds up",
    "play": "torque is lost where it changes its sign, as in a play",
}
"""The warning of each kind."""


@dataclass(frozen=True)
class ScoreTest:
    """The test of one kind of alternative terms in one joint.

    Attributes
    ----------
    kind
        Of `KINDS`.
    size, share
        Of its largest column [N m], and that over the joint's friction [1].
    minus_log10_p
        Minus log10 of the probability that chance alone does as much [1].
    flagged
        Whether that exceeds `LEAST_MINUS_LOG10_P`, and the share `LEAST_SHARE`.
    """

    kind: str
    size: float
    share: float
    minus_log10_p: float
    flagged: bool


def run_score_tests(
    normal_equations: NormalEquations,
    total: int,
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
    effect_std: Array,
    effect_covariance: Array | None = None,
) -> tuple[tuple[ScoreTest, ...], ...]:
    """Return the tests of each joint, one a kind.

    Parameters
    ----------
    normal_equations
        Of a sample of the log, with columns of random effects and of alternative terms.
    total
        Number of equations of the whole log, which solution and chi^2 are of.
    curves, model, solution
        Of the whole log.
    effect_std
        Standard deviations of the random effects: of each joint's torque [N m] and the root's turns, shape (n + 3,) or
        (n,).
    """
    own = normal_equations.alternatives
    assert own is not None
    parameters, layout = Parametrisation(curves, model), normal_equations.layout
    effects, tested = layout.part("random_effects"), layout.part("alternatives")
    plain = normal_equations.without("gaits", "alternatives")
    fitted = plain.layout.part("friction", "rotors")
    residual_sums = normal_equations.right_hand_side - normal_equations.information[:, fitted] @ parameters.values(
        solution.x
    )

    def mixed(rows: Array) -> Array:
        return parameters.times_jacobian(rows, solution.x)

    lost = cho_solve(  # T^T J H^-1
        cho_factor(curvature(plain, curves, model, solution)), mixed(normal_equations.information[tested, fitted]).T
    ).T
    score = residual_sums[tested] - lost @ mixed(residual_sums[None, fitted])[0]
    bias = normal_equations.information[tested, effects] - lost @ mixed(normal_equations.information[effects, fitted]).T
    bias *= np.resize(effect_std, bias.shape[1])
    information = (
        normal_equations.information[tested, tested] - lost @ mixed(normal_equations.information[tested, fitted]).T
    )
    scale = max(1.0, solution.chi_square / max(total - solution.internal.size, 1))
    level = np.maximum(_friction(curves, solution), LEAST_FRICTION * own.torque)
    RAW.clear()
    pull = curve_pull(curves, parameters, solution, lost, effect_covariance)
    found: list[tuple[ScoreTest, ...]] = []
    for joint in range(layout.joints):
        if own.torque[joint] <= NO_TORQUE:
            found.append(())
            continue
        place = slice(joint * COLUMNS, (joint + 1) * COLUMNS)
        variance = scale * information[place, place] + bias[place] @ bias[place].T
        RAW[joint] = dict(score=score[place], information=information[place, place], variance=variance, bias=bias[place] @ bias[place].T, level=float(level[joint]), torque=float(own.torque[joint]), ripples=int(own.ripples[joint]), unexplained=float(own.unexplained[joint]), pull=pull[joint][0][:, place], std=pull[joint][1], values=pull[joint][2], scale=scale)
        found.append(_test(score[place], information[place, place], variance, float(level[joint])))
    return tuple(found)


RAW={}

def curve_pull(curves, parameters, solution, lost, covariance):
    out=[]
    J=len(curves.top_speed)
    R=curves.basis.functions.shape[1]
    coef=curves.coefficients(solution.internal).reshape(J,-1)
    for joint in range(J):
        rows=np.zeros((3, coef.size))
        v=curves.basis.velocity[joint]
        for k,sp in enumerate((0.1,0.5,1.0)):
            both=[np.array([np.interp(d*sp*curves.top_speed[joint], v, f) for f in curves.basis.functions.T]) for d in (1,-1)]
            rows[k, joint*coef.shape[1]:joint*coef.shape[1]+R]=(both[0]-both[1])/2
        full=np.hstack([rows, np.zeros((3, parameters.values(solution.x).size-coef.size))])
        g=parameters.times_jacobian(full, solution.x)
        C=solution.covariance if covariance is None else covariance
        out.append((-(g@lost.T), np.sqrt(np.einsum("sp,pq,sq->s",g,C,g)), rows[:, :]@coef.ravel()))
    return out


def _test(score: Array, information: Array, variance: Array, level: float) -> tuple[ScoreTest, ...]:
    """Return one joint's tests, one a kind; the sensor's gain may be wrong beside each of them."""
    found = []
    for kind, columns in KINDS.items():
        which = np.array([*columns, GAIN_COLUMN])
        grid = np.ix_(which, which)
        prior = np.diag(which == GAIN_COLUMN).astype(float)
        own = slice(len(columns))
        if np.linalg.eigvalsh(information[grid][own, own])[0] <= LEAST_INFORMATION:
            continue  # the law contains it
        inverse = np.linalg.inv(information[grid] + prior)
        size, covariance = (inverse @ score[which])[own], (inverse @ (variance[grid] + prior) @ inverse)[own, own]
        squares = float(size @ np.linalg.solve(covariance, size))
        with np.errstate(divide="ignore"):  # beyond what a number can hold: infinite
            minus_log10_p = float(-np.log10(chdtrc(len(columns), squares)))
        largest = float(np.abs(size).max())
        share = largest / max(level, 1e-12)
        found.append(
            ScoreTest(kind, largest, share, minus_log10_p, minus_log10_p > LEAST_MINUS_LOG10_P and share > LEAST_SHARE)
        )
    return tuple(found)


def score_test_warnings(score_tests: Sequence[Sequence[ScoreTest]], names: Sequence[str]) -> list[str]:
    """Return a sentence for each kind that joints have, by name; of a joint that shows several, the least probable."""
    found: dict[str, list[str]] = {}
    for name, own in zip(names, score_tests, strict=True):
        flagged = [test for test in own if test.flagged]
        if flagged:
            clearest = max(flagged, key=lambda test: test.minus_log10_p)
            found.setdefault(clearest.kind, []).append(f"{name} ({100 * clearest.share:.0f} %)")
    return [
        f"{sentence}: {', '.join(found[kind])} of its friction; the law's parameters are an average over this log, and "
        "their intervals do not know"
        for kind, sentence in SENTENCES.items()
        if kind in found
    ]


def _friction(curves: Curves, solution: Solution) -> Array:
    """Return how large each joint's friction is at half its top speed, without the offset [N m], shape (n,)."""
    basis, joints = curves.basis, len(curves.top_speed)
    functions = basis.functions.shape[1]
    own = curves.coefficients(solution.internal).reshape(joints, -1)[:, :functions]
    both = [
        np.interp(0.5 * top * np.array([-1.0, 1.0]), velocity, basis.functions @ each)
        for top, velocity, each in zip(curves.top_speed, basis.velocity, own, strict=True)
    ]
    return np.asarray(np.abs(np.diff(both, axis=1)[:, 0]) / 2)
