"""The power check: friction takes energy away, so that its power should be positive nearly always (7.9)."""

from __future__ import annotations

from stribeck.report.page import Section, render
from stribeck.result import Result

SUSPICIOUS = 0.8
"""Share of positive power below which the model, the torque's sign or a delay is worth a look."""


def power(result: Result) -> Section | None:
    """Return the section with a bar a joint, or None where no joint has the number."""
    rows = [
        {"name": name, "share": joint.positive_power_fraction, "low": joint.positive_power_fraction < SUSPICIOUS}
        for name, joint in result.joints.items()
        if joint.positive_power_fraction is not None
    ]
    if not rows:
        return None
    return Section(anchor="power", title="Power check", body=render("power.html.j2", rows=rows, suspicious=SUSPICIOUS))
