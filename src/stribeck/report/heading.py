"""The head of the report: which robot and log, what was found, what to trust, what to do next."""

from collections.abc import Sequence
from pathlib import PurePath
from statistics import median

from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.report.page import render
from stribeck.report.text import brief, number
from stribeck.report.warnings import parted
from stribeck.result import CurvePoint, JointResult, Result, Verdict
from stribeck.result.advice import advice

VERDICTS: tuple[Verdict, ...] = ("identified", "weak", "no friction", "not excited")

NAMED = 3
"""Joints that a sentence names; of more it gives the number."""


MOST_WORSE = 1e3
"""Of a law against none [1]: more is all the same."""


def heading(result: Result, law: FrictionLaw) -> Markup:
    """Return the lead of the page: log and law, how many joints have which verdict, friction, trust and next step."""
    paths = [result.log.path] if isinstance(result.log.path, str) else result.log.path
    verdicts = [joint.verdict for joint in result.joints.values()]
    r2 = [joint.torque_r2.best for joint in result.joints.values() if joint.torque_r2]
    nominal = [joint.torque_r2.nominal for joint in result.joints.values() if joint.torque_r2]
    unseen = [share for joint in result.joints.values() if joint.curve and (share := unseen_r2(joint)) is not None]
    findings, texts = parted(result)
    flagged = {name for finding in findings if finding.on_friction for name in finding.joints}
    identified = _with(result, "identified")
    trusted = [name for name in identified if name not in flagged]
    distrusted = {
        "warned": [name for name in identified if name in flagged],
        "weak": _with(result, "weak"),
        "not excited": _with(result, "not excited"),
    }
    mending = next((found for found in findings if found.cure), None)
    return render(
        "heading.html.j2",
        result=result,
        law=law,
        logs=[PurePath(path).name or "log made in memory" for path in paths],
        counts=[(verdict, count) for verdict in VERDICTS if (count := verdicts.count(verdict))],
        total=len(verdicts),
        range=_friction_range(result),
        bound=_bound(result),
        r2=median(r2) if r2 else None,
        r2_nominal=median(nominal) if nominal else None,
        unseen=median(unseen) if unseen else None,
        trusted=_named(trusted),
        distrusted=[(why, _named(names)) for why, names in distrusted.items() if names],
        mending=mending,
        mended=_named(mending.joints) if mending else "",
        steps=_steps(result),
        warnings=len(findings) + len(texts),
    )


def unseen_r2(joint: JointResult) -> float | None:
    """Return the share of the friction torque's mean square that the law explains on parts that no fit saw [1].

    None of a joint without friction, of which there is nothing to explain.
    """
    found = joint.validation
    if found is None or found.rms_zero_friction <= 0 or joint.verdict == "no friction":
        return None
    return 1 - min(found.rms / found.rms_zero_friction, MOST_WORSE) ** 2


def _friction_range(result: Result) -> list[tuple[str, str]]:
    """Return the least and the most friction at middle speed that was identified, with the joint; fewer if no two."""
    middles = {
        name: joint.curve[len(joint.curve) // 2]
        for name, joint in result.joints.items()
        if joint.verdict == "identified" and joint.curve
    }
    ordered = sorted(middles, key=lambda name: middles[name].value)
    ends = dict.fromkeys([*ordered[:1], *ordered[-1:]])
    return [(_text(middles[name]), name) for name in ends]


def _text(point: CurvePoint) -> str:
    return f"{' ± '.join(brief(point.value, point.half_width))} {point.unit}"


def _bound(result: Result) -> str:
    """Return what friction stays below in the joints that have none, "" if it is not known."""
    points = [point for joint in result.joints.values() if joint.verdict == "no friction" for point in joint.curve]
    most = max(points, key=lambda point: point.interval_95[1], default=None)
    return f"below {number(most.interval_95[1], 2)} {most.unit}" if most else ""


def _with(result: Result, verdict: Verdict) -> list[str]:
    """Return the joints with a verdict."""
    return [name for name, joint in result.joints.items() if joint.verdict == verdict]


def _named(names: Sequence[str]) -> str:
    """Return joints, by name if they are few."""
    return ", ".join(names) if len(names) <= NAMED else f"{len(names)} joints"


def _steps(result: Result) -> list[tuple[str, str]]:
    """Return what to do about joints that cannot be trusted, joints with the same advice together."""
    groups: dict[str, list[str]] = {}
    for name, joint in result.joints.items():
        if joint.verdict in ("weak", "not excited"):
            groups.setdefault(advice(joint), []).append(name)
    return [(_named(names), what) for what, names in groups.items()]
