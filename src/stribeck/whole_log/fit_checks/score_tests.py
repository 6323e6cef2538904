"""Score tests of alternative terms, friction that no law of velocity describes (docs/estimator.md, equations 33 to 37).

A law that is fitted to friction that it cannot describe gives an average, and its intervals do not show it. With e the
whitened residual of a sample of the log, T the columns of `AlternativeTerms`, J those of all that is fitted, H their
curvature on this sample, and Z the columns of the random effects, of variances Q,

    score        s = T^T e - T^T J H^-1 (J^T e)
    information  N = T^T T - T^T J H^-1 (J^T T)
    covariance   V = N + B Q B^T,   B = T^T Z - T^T J H^-1 (J^T Z)

and with z = N^-1 s, z^T (N^-1 V N^-1)^-1 z is chi^2 distributed if there is no such friction (Rao 1948). Where several
terms are improbable by chance, the one that explains most is taken, and the others are tested again beside it. A term
is flagged if it moves the friction curve out of its interval, and is named unless others explain nearly as much.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc  # the tail of chi square

from stribeck.base.typing import Array
from stribeck.whole_log.constants import (
    CURVE_SPEEDS,
    EQUALLY_GOOD,
    LEAST_DELAY,
    LEAST_FRICTION,
    LEAST_MINUS_LOG10_P,
    LEAST_SHARE,
    LEAST_SHIFT,
    MOST_PER_TURN,
    MOST_SHARE,
)
from stribeck.whole_log.fit_checks.alternative_terms import (
    COLUMNS,
    DELAY,
    GAIN_COLUMN,
    KINDS,
    NO_TORQUE,
    RIPPLE,
)
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.model.parametrisation import Parametrisation
from stribeck.whole_log.solver.normal_equations import NormalEquations
from stribeck.whole_log.solver.solve import Solution, curvature, inverse_of

LEAST_INFORMATION = 1e-6
"""Information [1/(N m)^2] below which a term is not tested: the law contains it."""

OF_FRICTION = ("load", "drift", "presliding")
"""Kinds that change the friction there is, and are not much larger than it."""


@dataclass(frozen=True, kw_only=True)
class ScoreTest:
    """The test of one kind of alternative terms in one joint.

    Attributes
    ----------
    kind
        Of `KINDS`.
    size, share
        Of the term [N m], of a delay [s], and that over the joint's friction [1], of a delay none.
    chi_square, minus_log10_p
        By how much it lowers chi^2 [1], and minus log10 of the probability that chance alone does as much [1].
    shift
        Of the friction curve, if the term were fitted as well, in standard errors [1], where that is most.
    """

    kind: str
    size: float
    share: float
    chi_square: float
    minus_log10_p: float
    shift: float

    @property
    def significant(self) -> bool:
        """Whether chance alone does not explain it."""
        return self.minus_log10_p > LEAST_MINUS_LOG10_P

    @property
    def matters(self) -> bool:
        """Whether it is no small part of the friction, and the friction curve is wrong without it."""
        large = self.size > LEAST_DELAY if self.kind == DELAY else self.share > LEAST_SHARE
        possible = self.kind not in OF_FRICTION or self.share < MOST_SHARE
        return large and possible and self.shift > LEAST_SHIFT


@dataclass(frozen=True)
class Misfit:
    """What the law of a joint does not describe: kinds of alternative terms that explain it, the best one first.

    `per_turn` are the periods a turn of the ripple that was looked for.
    """

    tests: tuple[ScoreTest, ...]
    per_turn: float = 0.0


def run_score_tests(
    normal_equations: NormalEquations,
    total: int,
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
    effect_std: Array,
    covariance: Array,
    heterogeneity: float,
) -> tuple[Misfit | None, ...]:
    """Return what the law of each joint does not describe, and what does; None of a joint that it describes.

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
    covariance
        Of all coordinates, by the covariance budget, shape (m, m).
    heterogeneity
        Over folds [1]: what parts of the log do not agree on is no evidence.
    """
    own = normal_equations.alternatives
    assert own is not None
    parameters, layout = Parametrisation(curves, model), normal_equations.layout
    effects, tested = layout.part("random_effects"), layout.part("alternatives")
    plain = normal_equations.without("gaits", "alternatives")
    fitted = plain.layout.part("friction", "log_offsets")
    residual_sums = normal_equations.right_hand_side - normal_equations.information[:, fitted] @ parameters.values(
        solution.x
    )

    def mixed(rows: Array) -> Array:
        return parameters.times_jacobian(rows, parameters.blocks(solution.x))

    hessian = curvature(plain, curves, model, solution)
    lost = mixed(normal_equations.information[tested, fitted]) @ inverse_of(hessian)  # T^T J H^-1
    score = residual_sums[tested] - lost @ mixed(residual_sums[None, fitted])[0]
    bias = normal_equations.information[tested, effects] - lost @ mixed(normal_equations.information[effects, fitted]).T
    bias *= np.resize(effect_std, bias.shape[1])
    information = (
        normal_equations.information[tested, tested] - lost @ mixed(normal_equations.information[tested, fitted]).T
    )
    scale = max(1.0, solution.chi_square / max(total - solution.internal.size, 1))
    level = np.maximum(_friction(curves, solution), LEAST_FRICTION * own.torque)
    found: list[Misfit | None] = []
    for joint in range(layout.joints):
        if own.torque[joint] <= NO_TORQUE:
            found.append(None)
            continue
        place = slice(joint * COLUMNS, (joint + 1) * COLUMNS)
        gradient = mixed(_curve_rows(normal_equations, curves, joint, fitted.stop))
        errors = np.sqrt(scale * np.einsum("sp,pq,sq->s", gradient, covariance, gradient))
        scores = _Scores(
            score=score[place],
            information=information[place, place],
            variance=scale * max(1.0, heterogeneity) * information[place, place] + bias[place] @ bias[place].T,
            pull=gradient @ lost[place].T / np.maximum(errors, 1e-300)[:, None],
            level=float(level[joint]),
            delay=own.delay,
        )
        tests = scores.explanation()
        found.append(Misfit(tests, float(own.per_turn[joint])) if tests else None)
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Scores:
    """Scores of one joint's alternative terms.

    Attributes
    ----------
    score, information, variance
        s, N, and V with its overdispersion, shape (c,) and (c, c).
    pull
        By how much a unit of each column shifts the friction curve, in standard errors, shape (speeds, c).
    level, delay
        The joint's friction [N m], and the unit of delays [s].
    """

    score: Array
    information: Array
    variance: Array
    pull: Array
    level: float
    delay: float

    def explanation(self) -> tuple[ScoreTest, ...]:
        """Return the kind that explains what the law does not, or several that explain nearly as much; () if none.

        What moves the curve by less than its interval is taken into account, and what is left is looked at again.
        """
        beside: list[str] = []
        while True:
            tests = [self.test(kind, beside) for kind in KINDS if kind not in beside]
            clear = sorted((t for t in tests if t and t.significant), key=lambda t: t.chi_square, reverse=True)
            if not clear:
                return ()
            rivals = tuple(test for test in clear if test.chi_square > EQUALLY_GOOD * clear[0].chi_square)
            if any(test.matters for test in rivals):
                return rivals
            beside.append(clear[0].kind)

    def test(self, kind: str, beside: Sequence[str] = ()) -> ScoreTest | None:
        """Return the test of a kind beside others; the sensor's gain may be wrong too. None if the law contains it."""
        own = list(KINDS[kind])
        others = [column for other in beside for column in KINDS[other]]
        which = np.array([*own, *others, GAIN_COLUMN])
        prior = np.diag((which == GAIN_COLUMN).astype(float))
        grid, first = np.ix_(which, which), slice(len(own))
        information = self.information[grid] + prior
        rest = information[first, len(own) :] @ np.linalg.solve(
            information[len(own) :, len(own) :], information[len(own) :, first]
        )
        if np.linalg.eigvalsh(information[first, first] - rest)[0] <= LEAST_INFORMATION:
            return None
        inverse = np.linalg.inv(information)
        size = (inverse @ self.score[which])[first]
        covariance = (inverse @ (self.variance[grid] + prior) @ inverse)[first, first]
        squares = float(size @ np.linalg.solve(covariance, size))
        with np.errstate(divide="ignore"):  # beyond what a number can hold: infinite
            minus_log10_p = float(-np.log10(chdtrc(len(own), squares)))
        largest = float(np.linalg.norm(size) if kind == RIPPLE else np.abs(size).max())
        return ScoreTest(
            kind=kind,
            size=largest * (self.delay if kind == DELAY else 1.0),
            share=0.0 if kind == DELAY else largest / max(self.level, 1e-12),
            chi_square=squares,
            minus_log10_p=minus_log10_p - (np.log10(MOST_PER_TURN) if kind == RIPPLE else 0.0),
            shift=float(np.abs(self.pull[:, own] @ size).max()),
        )


def _curve_rows(normal_equations: NormalEquations, curves: Curves, joint: int, size: int) -> Array:
    """Return the derivatives by all coefficients of one joint's resisting torque at `CURVE_SPEEDS`, shape (3, D).

    At the mean load of the sample, temperature and time.
    """
    basis, layout = curves.basis, normal_equations.layout
    speeds = curves.top_speed[joint] * np.array(CURVE_SPEEDS)
    velocity = basis.velocity[joint]
    resisting = np.column_stack(
        [np.interp(speeds, velocity, each) - np.interp(-speeds, velocity, each) for each in basis.functions.T]
    )
    rows = np.zeros((len(speeds), size))
    first, functions = layout.joint(joint).start, resisting.shape[1]
    rows[:, first : first + functions] = resisting / 2
    windows, loads = normal_equations.loads[0, joint], normal_equations.loads[1, joint]
    if basis.modulated and windows:
        loaded = resisting / 2 @ basis.modulated[0] * loads / windows
        rows[:, first + functions : first + functions + loaded.shape[1]] = loaded
    return rows


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
