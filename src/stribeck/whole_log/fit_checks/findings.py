"""Findings of the score tests: what a joint's law does not describe, and a law or a log that would."""

from collections.abc import Sequence

from stribeck.base.finding import FRICTION, Finding
from stribeck.whole_log.fit_checks.alternative_terms import DELAY, RIPPLE
from stribeck.whole_log.fit_checks.score_tests import Misfit

WORDS = {
    "load": "load",
    "drift": "drift",
    "presliding": "presliding",
    "play": "play",
    DELAY: "a delay of this torque only",
    RIPPLE: "ripple over position",
}
"""Kind of misfit -> words for it; its check has the kind's name with the prefix `FRICTION`."""

UNCLEAR = FRICTION + "unclear"


def misfit_findings(misfits: Sequence[Misfit | None], names: Sequence[str]) -> list[Finding]:
    """Report each kind of misfit with its joints, and the joints for which several kinds explain as much."""
    found: dict[str, dict[str, str]] = {kind: {} for kind in (*WORDS, "unclear")}
    for name, misfit in zip(names, misfits, strict=True):
        if misfit and len(misfit.tests) == 1:
            found[misfit.tests[0].kind][name] = _evidence(misfit)
        elif misfit:
            found["unclear"][name] = " or ".join(WORDS[test.kind] for test in misfit.tests)
    return [
        Finding.of(
            FRICTION + kind, tuple(joints), evidence=", ".join(f"{name} ({why})" for name, why in joints.items())
        )
        for kind, joints in found.items()
        if joints
    ]


def _evidence(misfit: Misfit) -> str:
    test = misfit.tests[0]
    if test.kind == DELAY:
        return f"{1e3 * test.size:.2g} ms"
    share = f"{100 * test.share:.0f} % of its friction"
    return f"{share}, {misfit.per_turn:.3g} periods a turn" if test.kind == RIPPLE else share
