"""The head of the report: which robot and log, and the finding in a few numbers."""

from __future__ import annotations

from pathlib import PurePath
from statistics import median

from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.report.page import render
from stribeck.report.verdict_table import explained
from stribeck.result import JointResult, Result, Verdict

VERDICTS: tuple[Verdict, ...] = ("identified", "weak", "no friction", "not excited")


def heading(result: Result, law: FrictionLaw) -> Markup:
    """Return the lead of the page: log, law, and how many joints have which verdict."""
    paths = [result.log.path] if isinstance(result.log.path, str) else result.log.path
    verdicts = [joint.verdict for joint in result.joints.values()]
    rubbing = [joint for joint in result.joints.values() if _rubs(joint)]
    shares = [share for joint in rubbing if (share := explained(joint)) is not None]
    return render(
        "heading.html.j2",
        result=result,
        law=law,
        logs=[PurePath(path).name or "log made in memory" for path in paths],
        counts=[(verdict, verdicts.count(verdict)) for verdict in VERDICTS],
        explained=median(shares) if shares else None,
    )


def _rubs(joint: JointResult) -> bool:
    """Return whether friction of a joint is significant: of one without any there is nothing to explain."""
    found = joint.parameters
    return any(found[name].interval_95[0] > 0 for name in ("viscous", "coulomb") if name in found)
