"""What the score tests say to a user: what a joint's law does not describe, and what would."""

from collections.abc import Sequence

from stribeck.finding import FRICTION, Finding
from stribeck.identification.whole_log.tests_of_fit.alternative_terms import DELAY, RIPPLE
from stribeck.identification.whole_log.tests_of_fit.score_tests import Misfit

SENTENCES = {
    "load": "friction changes with the torque that the joint carries",
    "drift": "friction drifts in the course of the log",
    "presliding": "friction builds up over some way after a reversal, as bristles deflect or a gear winds up",
    "play": "torque is lost where it changes its sign, as in a play",
    DELAY: "torques come at another time than those of other joints",
    RIPPLE: "torque comes and goes over position, as teeth or magnets do",
}
"""Of each kind; the name of its check is the kind with `FRICTION`."""

WORDS = {
    "load": "load",
    "drift": "drift",
    "presliding": "presliding",
    "play": "play",
    DELAY: "a delay of this torque alone",
    RIPPLE: "ripple over position",
}

CURES = {
    "load": "log loads as those of its use; the law 'auto' may have a term for it",
    "drift": "warm the robot up first, or log temperature and use the law 'auto'",
    "presliding": "leave slow reversals out, or take the values for sliding alone",
    "play": "keep the torque of one sign, by a payload or a posture, or take the values for a joint without its play",
    DELAY: "log all joints by one clock and one filter",
    RIPPLE: "move it over many of these periods, or calibrate them out of the torque",
}

UNCLEAR = FRICTION + "unclear"

BIASED = "the friction found is off by more than its intervals say"


def misfit_findings(misfits: Sequence[Misfit | None], names: Sequence[str]) -> list[Finding]:
    """Return a finding for each kind that joints have, and one for those in which several kinds explain as much."""
    alone: dict[str, dict[str, str]] = {}
    unclear: dict[str, str] = {}
    for name, misfit in zip(names, misfits, strict=True):
        if misfit and len(misfit.tests) == 1:
            alone.setdefault(misfit.tests[0].kind, {})[name] = _evidence(misfit)
        elif misfit:
            unclear[name] = " or ".join(WORDS[test.kind] for test in misfit.tests)
    found = [
        Finding(
            check=FRICTION + kind,
            text=f"{sentence}: {_listed(alone[kind])}; {BIASED}",
            cure=CURES[kind],
            joints=tuple(alone[kind]),
        )
        for kind, sentence in SENTENCES.items()
        if kind in alone
    ]
    if unclear:
        found.append(
            Finding(
                check=UNCLEAR,
                text=f"the residual is not explained by friction of velocity: {_listed(unclear)}; {BIASED}",
                cure="log a slow and a fast motion of this joint alone, which tell them apart",
                joints=tuple(unclear),
            )
        )
    return found


def _listed(joints: dict[str, str]) -> str:
    return ", ".join(f"{name} ({evidence})" for name, evidence in joints.items())


def _evidence(misfit: Misfit) -> str:
    test = misfit.tests[0]
    if test.kind == DELAY:
        return f"{1e3 * test.size:.2g} ms"
    share = f"{100 * test.share:.0f} % of its friction"
    return f"{share}, {misfit.per_turn:.3g} periods a turn" if test.kind == RIPPLE else share
