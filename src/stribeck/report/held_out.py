"""How well logs that no fit has seen are explained."""

from stribeck.report.page import Section, render
from stribeck.result import Result


def held_out(result: Result) -> Section | None:
    """Return the section with a table a log, or None where no log was held out."""
    if not result.held_out:
        return None
    units = {name: joint.curve[0].unit for name, joint in result.joints.items() if joint.curve}
    body = render("held_out.html.j2", logs=result.held_out, units=units)
    return Section(anchor="held-out", title="Logs that no fit has seen", body=body)
