"""Misfits: friction outside the law, and errors that look like friction (docs/estimator-fit.md, equation 33).

A law that cannot describe a joint's friction yields an average, with intervals that do not show the misfit. Each joint
is therefore tried with each kind of column that its law does not contain (`terms/trials.py`). A kind is flagged under
three conditions: it improves held-out folds beyond heterogeneity and random effects, it is a substantial part of the
friction, and without it the friction curve is outside its interval. The finding names the kind unless other kinds
explain nearly as much.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.base.finding import FRICTION, Finding
from stribeck.base.typing import Array
from stribeck.friction.terms import LADDER
from stribeck.whole_log.constants import LEAST_FRICTION
from stribeck.whole_log.model.terms import DELAY, PLAY
from stribeck.whole_log.solver.elimination import Fit
from stribeck.whole_log.solver.statistics import Statistics
from stribeck.whole_log.terms.trials import Trials

OF_TERMS = {term.misfit: [each for each in LADDER if each.misfit == term.misfit] for term in LADDER if term.misfit}
"""Terms of each kind of misfit."""

KINDS = {kind: tuple(name for term in terms for name in term.names) for kind, terms in OF_TERMS.items()} | {
    "play": tuple(parameter.name for parameter in PLAY),
    "delay": (DELAY.name,),
}
"""Parameters of each kind of misfit. The name of a check is the prefix `FRICTION` and the kind."""

WORDS = {kind: terms[0].words for kind, terms in OF_TERMS.items()}
WORDS |= {"play": "play", "delay": "a delay of this torque only"}
UNCLEAR = FRICTION + "unclear"
LEAST_EVIDENCE = 33.0
"""Decrease of the held-out chi^2 above which a kind is flagged [1]; chance reaches it once in 1e8 times."""

CURVE_SPEEDS = np.array([0.1, 0.5, 1.0])
"""Shares of the top speed at which the shift of the curve is evaluated [1], as for the verdicts."""


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """Test of one kind of column for a residual that a joint's law does not explain.

    Attributes
    ----------
    kind
        Key of `KINDS`.
    evidence
        Decrease of the held-out chi^2, discounted by heterogeneity and random effects [1].
    size, share
        Size of the term [N m] or of a delay [s], and size relative to the joint's friction [1], NaN for a delay.
    shift
        Largest shift of the friction curve due to fitting the term, in standard errors [1].
    """

    kind: str
    evidence: float
    size: float
    share: float
    shift: float

    @property
    def matters(self) -> bool:
        """Whether the term is at least a twentieth of the friction, and the friction curve is wrong without it.

        A term cannot be much larger than the friction that it changes, unless it depends on position. A delay matters
        from one cycle of a 1 kHz bus.
        """
        large = self.size > 1e-3 if self.kind == "delay" else self.share > 0.05
        of_terms = OF_TERMS.get(self.kind, ())
        possible = self.share < 2.0 or not of_terms or any(term.over == "position" for term in of_terms)
        return large and possible and self.shift > 2.0


def find_misfits(
    trials: Trials,
    kept: Sequence[frozenset[str]],
    decided: Sequence[frozenset[str]],
    fit: Fit,
    covariance: Array,
    known: Statistics,
    sample: Statistics,
    effect_std: Array,
    heterogeneity: float,
    units: Array,
) -> tuple[tuple[Misfit, ...], ...]:
    """Find the kind of misfit that best explains each joint's residual, and kinds that explain nearly as much.

    A kind that moves the curve by less than its interval is removed, and the rest of the residual is examined again.
    With the columns T of the terms, Z of the random effects and J of all fitted parameters (covariance C), the part of
    T outside the fit has the information N, and the part of Z outside the fit projects onto T by B:

        N = T^T T - T^T J C J^T T,    B = T^T Z - T^T J C J^T Z

    Parameters
    ----------
    trials, kept, decided
        Trials of all joints, each joint's terms, and parameters that the selection of terms has decided.
    fit
        Fit with the covariance that the intervals use.
    known, covariance
        Normal equations without the held-out segments, as in the trials, and C.
    sample, effect_std
        Sample of the log with random effects, and their standard deviations.
    heterogeneity
        Heterogeneity of the model over folds [1].
    units
        Effect of a unit coefficient of each column, shape (n, T): its largest torque [N m], for load the mean [N m],
        for delays [s].
    """
    across = [own[0] for own in sample.effects.values()]
    Z = np.hstack(across) if across else np.zeros((len(fit.values), 0))
    Z = Z * np.resize(effect_std, Z.shape[1]) * (known.count / sample.count)
    joints, count = units.shape
    terms = np.arange(known.friction).reshape(joints, -1)[:, -count:].ravel()
    fitted = fit.pulled(np.hstack([known.information[:, terms], Z]))
    lost = fitted[:, : len(terms)].T @ covariance
    N = known.information[np.ix_(terms, terms)] - lost @ fitted[:, : len(terms)]
    B = Z[terms] - lost @ fitted[:, len(terms) :]
    found: list[tuple[Misfit, ...]] = []
    for joint in range(joints):
        own = slice(joint * count, (joint + 1) * count)
        curve = _Curve(fit, joint, trials.scale * fit.covariance)
        pull = curve.gradient @ lost[own, fit.layout.joint(joint)].T / curve.errors[:, None]
        each = _Joint(trials, joint, kept[joint], decided[joint], N[own, own], B[own], pull, curve.level, units[joint])
        found.append(each.explanation(max(1.0, heterogeneity)))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Curve:
    """The resisting torque of a joint at `CURVE_SPEEDS`, by the covariance of all coordinates."""

    fit: Fit
    joint: int
    covariance: Array

    @property
    def _odd(self) -> Array:
        """Derivatives by the coefficients of the basis, shape (3, R)."""
        basis, speeds = self.fit.laws.basis, self.fit.laws.top_speed[self.joint] * CURVE_SPEEDS
        v = basis.velocity[self.joint]
        both = [np.interp(speeds, v, each) - np.interp(-speeds, v, each) for each in basis.functions.T]
        return np.stack(both, axis=1) / 2

    @property
    def gradient(self) -> Array:
        """Derivatives by the joint's coordinates, shape (3, w)."""
        jacobian = self.fit.laws.of([self.joint]).jacobians(self.fit.internal[[self.joint]])[0]
        return np.asarray(self._odd @ jacobian[: self._odd.shape[1]])

    @property
    def errors(self) -> Array:
        """Standard errors [N m], shape (3,)."""
        own = self.fit.layout.joint(self.joint)
        variance = np.einsum("sp,pq,sq->s", self.gradient, self.covariance[own, own], self.gradient)
        return np.asarray(np.sqrt(np.maximum(variance, 1e-300)))

    @property
    def level(self) -> float:
        """Size of the friction, but at least a hundredth of the torque [N m]."""
        theta = self.fit.laws.coefficients(self.fit.internal)[self.joint]
        least = LEAST_FRICTION * float(self.fit.laws.torque[self.joint])
        return max(float(np.abs(self._odd @ theta[: self._odd.shape[1]]).max()), least)


@dataclass(frozen=True, eq=False)
class _Joint:
    """A joint under test, with its N and B, shape (T, T) and (T, e).

    `pull` is the shift of the friction curve per unit of each term, in standard errors, shape (3, T).
    """

    trials: Trials
    joint: int
    kept: frozenset[str]
    decided: frozenset[str]
    information: Array
    bias: Array
    pull: Array
    level: float
    units: Array

    def explanation(self, heterogeneity: float) -> tuple[Misfit, ...]:
        """Find the kind that explains the residual, or several that explain nearly as much; () if none."""
        beside: list[str] = []
        kinds = [kind for kind, names in KINDS.items() if not self.decided.intersection(names)]
        while True:
            tests = [self._test(kind, beside, heterogeneity) for kind in kinds if kind not in beside]
            clear = sorted((t for t in tests if t and t.evidence > LEAST_EVIDENCE), key=lambda t: -t.evidence)
            rivals = tuple(test for test in clear if test.evidence > 0.5 * clear[0].evidence)
            if not clear or any(test.matters for test in rivals):
                return rivals
            beside.append(clear[0].kind)

    def _test(self, kind: str, beside: Sequence[str], heterogeneity: float) -> Misfit | None:
        """Test a kind in addition to others; None if the law contains the kind, or if it has no columns."""
        law, trials = len(self.trials.laws.law.parameters), self.trials
        names = [name for name in KINDS[kind] if name in trials.names]
        others = [name for other in beside for name in KINDS[other] if name in trials.names]
        terms = np.array([trials.names.index(name) for name in (*names, *others)], dtype=np.int64) - law
        without, own = [*self.kept, *others], terms[: len(names)]
        if not names or trials.having(without)[own + law].any() or trials.folds.held_right.shape[1] < 2:
            return None
        prior = trials.laws.prior[1][self.joint, terms + law]
        covariance = np.linalg.inv(self.information[np.ix_(terms, terms)] + np.diag(prior**-2.0))[: len(names)]
        noise = np.diag(covariance)
        if np.any(noise > 0.9 * prior[: len(names)] ** 2):
            return None
        before, after = (trials.try_terms(self.joint, each) for each in (without, [*without, *names]))
        falls, values = before.scores - after.scores, after.internal[own + law]
        repeated = np.sum((covariance @ self.bias[terms]) ** 2, axis=1)
        gain = float(falls.sum() * np.min(noise / (noise * heterogeneity + repeated)))
        sure = falls.sum() > 2 * np.std(falls, ddof=1) * np.sqrt(len(falls))
        size = float(np.linalg.norm(values * self.units[own]))
        return Misfit(
            kind=kind,
            evidence=gain if sure else 0.0,
            size=size,
            share=0.0 if kind == "delay" else size / self.level,
            shift=float(np.max(np.abs(self.pull[:, own] @ values))),
        )


def misfit_findings(
    misfits: Sequence[tuple[Misfit, ...]], names: Sequence[str], settings: Mapping[str, Array]
) -> list[Finding]:
    """Report each kind of misfit with its joints, and the joints for which several kinds explain as much.

    `settings` are those of the terms by name, shape (n,) each.
    """
    found: dict[str, dict[str, str]] = {kind: {} for kind in (*KINDS, "unclear")}
    for joint, (name, own) in enumerate(zip(names, misfits, strict=True)):
        if len(own) == 1:
            found[own[0].kind][name] = _evidence(own[0], settings, joint)
        elif own:
            found["unclear"][name] = " or ".join(WORDS[each.kind] for each in own)
    return [
        Finding.of(
            FRICTION + kind, tuple(joints), evidence=", ".join(f"{name} ({why})" for name, why in joints.items())
        )
        for kind, joints in found.items()
        if joints
    ]


def _evidence(misfit: Misfit, settings: Mapping[str, Array], joint: int) -> str:
    if misfit.kind == "delay":
        return f"{1e3 * misfit.size:.2g} ms"
    terms = OF_TERMS.get(misfit.kind, ())
    shown = (term.shown.format(*(settings[name][joint] for name in term.settings)) for term in terms if term.shown)
    return f"{100 * misfit.share:.0f} % of its friction" + "".join(shown)
