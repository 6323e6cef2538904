"""The power check: friction takes energy away; the paper's power v tau_f, with tau_f = -R, is never positive (7.9)."""

from __future__ import annotations

from stribeck.report.page import Section, render
from stribeck.result import Result

SUSPICIOUS = 0.2
"""Share of positive power above which the model, the torque's sign or a delay is worth a look."""

CHANCE = 0.5
"""Share that a torque without any relation to the velocity has; the bars end there."""


def power(result: Result) -> Section | None:
    """Return the section with a bar a joint, or None where no joint has the number."""
    rows = [
        {"name": name, "share": share, "length": min(share / CHANCE, 1.0), "high": share > SUSPICIOUS}
        for name, joint in result.joints.items()
        if (share := joint.positive_power_fraction) is not None
    ]
    if not rows:
        return None
    return Section(anchor="power", title="Power check", body=render("power.html.j2", rows=rows, suspicious=SUSPICIOUS))
