"""Order of findings and of weak joints on a first screen: causes first, and among them what leaves most unknown."""

from stribeck.core.base.finding import Finding, catalogue
from stribeck.core.result import JointResult, Result

FIRST = 3
"""Findings, and weak joints, that a first screen shows; the others are in the report."""


def by_priority(result: Result) -> list[Finding]:
    """Sort findings: causes, then what may follow from them, such as drifts and bodies that differ, then notes.

    Findings of one kind are sorted by the friction of their joints that is unknown.
    """
    after, friction = catalogue()["after"], result.all_friction

    def rank(finding: Finding) -> tuple[float, ...]:
        follows = finding.on_friction or finding.check.startswith("bodies-") or finding.has("symptom")
        unknown = [unknown_friction(friction[name]) for name in finding.joints or friction if name in friction]
        kind = (not finding.stops, follows, not finding.doubt, not finding.cure, finding.check in after)
        return (finding.note, *kind, -max(unknown, default=0.0))

    return sorted(result.findings, key=rank)


def unknown_friction(joint: JointResult) -> float:
    """Compute half of a joint's widest 95 % interval of friction [N m], [N]; zero without a curve."""
    return max((point.half_width for point in joint.curve), default=0.0)
