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

from stribeck.core.base.finding import FRICTION, Finding
from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import LEAST_FRICTION
from stribeck.core.estimator.model.terms import ERRORS
from stribeck.core.estimator.reading import Reading
from stribeck.core.estimator.solver.fit import Fit
from stribeck.core.estimator.terms.term_selection import Choice
from stribeck.core.estimator.terms.trials import Trials
from stribeck.core.estimator.uncertainty.resisting import Resisting
from stribeck.core.friction.terms import LADDER

_TERMS = [term for term in (*LADDER, *ERRORS) if term.misfit]
KINDS = {term.misfit: [other for other in _TERMS if other.misfit == term.misfit] for term in _TERMS}
"""Terms of each kind of misfit. The name of a check is the prefix `FRICTION` and the kind."""

LEAST_EVIDENCE = 33.0
"""Decrease of the held-out chi^2 above which a kind is flagged [1]; chance reaches it once in 1e8 times."""


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
        possible = self.share < 2.0 or any(term.over in ("", "position") for term in KINDS[self.kind])
        return large and possible and self.shift > 2.0


def find_misfits(
    choice: Choice, fit: Fit, covariance: Array, read: Reading, effect_std: Array, heterogeneity: float
) -> tuple[tuple[Misfit, ...], ...]:
    """Find the kind of misfit that best explains each joint's residual, and kinds that explain nearly as much.

    A kind that moves the curve by less than its interval is removed, and the rest of the residual is examined again.
    With the columns T of the terms, Z of the random effects and J of all fitted parameters (covariance C), the part of
    T outside the fit has the information N, and the part of Z outside the fit projects onto T by B:

        N = T^T T - T^T J C J^T T,    B = T^T Z - T^T J C J^T Z

    Parameters
    ----------
    choice
        Each joint's terms, and the trials of all terms.
    fit, covariance
        Fit with the covariance of the intervals except heterogeneity, and C without the held-out segments, as in the
        trials.
    read
        The log as it was read.
    effect_std
        Standard deviations of the random effects.
    heterogeneity
        Heterogeneity of the model over folds [1].
    """
    known, sample, units = read.known, read.sample, _units(read, choice.trials)
    across = [effect[0] for effect in sample.effects.values()]
    Z = np.hstack(across) if across else np.zeros((len(fit.values), 0))
    Z = Z * np.resize(effect_std, Z.shape[1]) * (known.count / sample.count)
    joints, count = units.shape
    terms = np.arange(known.friction).reshape(joints, -1)[:, -count:].ravel()
    fitted = fit.pulled(np.hstack([known.information[:, terms], Z]))
    lost = fitted[:, : len(terms)].T @ covariance
    N = known.information[np.ix_(terms, terms)] - lost @ fitted[:, : len(terms)]
    B = Z[terms] - lost @ fitted[:, len(terms) :]
    misfits: list[tuple[Misfit, ...]] = []
    for joint, (kept, decided) in enumerate(zip(choice.kept, choice.decided, strict=True)):
        rows = slice(joint * count, (joint + 1) * count)
        curve = Resisting(fit, joint)
        errors = np.sqrt(np.maximum(curve.variance(choice.trials.scale * fit.covariance), 1e-300))
        pull = curve.slopes @ lost[rows, fit.layout.joint(joint)].T / errors[:, None]
        level = max(curve.size, LEAST_FRICTION * float(fit.laws.torque[joint]))
        test = _Joint(choice.trials, joint, kept, decided, N[rows, rows], B[rows], pull, level, units[joint])
        misfits.append(test.explanation(max(1.0, heterogeneity)))
    return tuple(misfits)


def _units(read: Reading, trials: Trials) -> Array:
    """Compute the effect of a unit coefficient of each column, shape (n, T): its largest torque [N m].

    For load, the mean replaces it [N m]; for delays, their unit [s].
    """
    first = read.columns.basis.functions.shape[1]
    largest = np.max([np.abs(by_joint[:, :, first:]).max(axis=0) for by_joint in read.pilot.by_joint], axis=0)
    names = trials.names[len(trials.laws.law.parameters) :]
    largest[:, names.index("load")] = read.whole.mean_load
    largest[:, names.index("delay")] = read.terms.delay
    return np.asarray(largest)


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
        other_kinds: list[str] = []
        kinds = [kind for kind in KINDS if not self.decided.intersection(_parameters(kind))]
        while True:
            tests = [self._test(kind, other_kinds, heterogeneity) for kind in kinds if kind not in other_kinds]
            clear = sorted((t for t in tests if t and t.evidence > LEAST_EVIDENCE), key=lambda t: -t.evidence)
            rivals = tuple(test for test in clear if test.evidence > 0.5 * clear[0].evidence)
            if not clear or any(test.matters for test in rivals):
                return rivals
            other_kinds.append(clear[0].kind)

    def _test(self, kind: str, other_kinds: Sequence[str], heterogeneity: float) -> Misfit | None:
        """Test a kind in addition to others; None if the law contains the kind, or if it has no columns."""
        law, trials = len(self.trials.laws.law.parameters), self.trials
        names = [name for name in _parameters(kind) if name in trials.names]
        others = [name for other in other_kinds for name in _parameters(other) if name in trials.names]
        terms = np.array([trials.names.index(name) for name in (*names, *others)], dtype=np.int64) - law
        without, places = [*self.kept, *others], terms[: len(names)]
        if not names or trials.having(without)[places + law].any() or trials.held_right.shape[1] < 2:
            return None
        prior = trials.laws.prior[1][self.joint, terms + law]
        covariance = np.linalg.inv(self.information[np.ix_(terms, terms)] + np.diag(prior**-2.0))[: len(names)]
        noise = np.diag(covariance)
        if np.any(noise > 0.9 * prior[: len(names)] ** 2):
            return None
        before, after = (trials.try_terms(self.joint, selection) for selection in (without, [*without, *names]))
        falls, values = before.scores - after.scores, after.internal[places + law]
        repeated = np.sum((covariance @ self.bias[terms]) ** 2, axis=1)
        gain = float(falls.sum() * np.min(noise / (noise * heterogeneity + repeated)))
        sure = falls.sum() > 2 * np.std(falls, ddof=1) * np.sqrt(len(falls))
        size = float(np.linalg.norm(values * self.units[places]))
        return Misfit(
            kind=kind,
            evidence=gain if sure else 0.0,
            size=size,
            share=0.0 if kind == "delay" else size / self.level,
            shift=float(np.max(np.abs(self.pull[:, places] @ values))),
        )


def _parameters(kind: str) -> list[str]:
    return [name for term in KINDS[kind] for name in term.names]


def misfit_findings(
    misfits: Sequence[tuple[Misfit, ...]], names: Sequence[str], settings: Mapping[str, Array]
) -> list[Finding]:
    """Report each kind of misfit with its joints, and the joints for which several kinds explain as much.

    `settings` are those of the terms by name, shape (n,) each.
    """
    reasons: dict[str, dict[str, str]] = {kind: {} for kind in (*KINDS, "unclear")}
    for joint, (name, rivals) in enumerate(zip(names, misfits, strict=True)):
        if len(rivals) == 1:
            reasons[rivals[0].kind][name] = _evidence(rivals[0], settings, joint)
        elif rivals:
            reasons["unclear"][name] = " or ".join(KINDS[misfit.kind][0].words for misfit in rivals)
    return [
        Finding.of(
            FRICTION + kind, tuple(joints), evidence=", ".join(f"{name} ({why})" for name, why in joints.items())
        )
        for kind, joints in reasons.items()
        if joints
    ]


def _evidence(misfit: Misfit, settings: Mapping[str, Array], joint: int) -> str:
    if misfit.kind == "delay":
        return f"{1e3 * misfit.size:.2g} ms"
    terms = [term for term in KINDS[misfit.kind] if term.shown]
    shown = (term.shown.format(*(settings[name][joint] for name in term.settings)) for term in terms)
    return f"{100 * misfit.share:.0f} % of its friction" + "".join(shown)
