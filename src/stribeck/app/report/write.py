"""Report of a result: its sections in reading order, in one file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from markupsafe import Markup

from stribeck.app.report import details
from stribeck.app.report.comparison import sides
from stribeck.app.report.correlations import correlations
from stribeck.app.report.joints import joint_panels
from stribeck.app.report.overview import first_screen, heading
from stribeck.app.report.page import write_page
from stribeck.app.report.robot import robot_picture, stated_friction
from stribeck.app.report.timeline import timeline
from stribeck.app.report.torques import replayed_torques
from stribeck.core.friction import get_law
from stribeck.core.result import Result, read_result
from stribeck.core.result.reference import NO_REFERENCE, Reference
from stribeck.core.result.saved import saved_evidence


def write_report(
    result: Result | str | Path,
    path: str | Path,
    *,
    reference: Reference = NO_REFERENCE,
) -> None:
    """Write the report as one self-contained HTML file, identical for identical results.

    Parameters
    ----------
    result
        Result, or the path of a result.json with its friction_torque.parquet in the same folder.
    path
        File to write, completely or not at all.
    reference
        Known friction to show next to the result, by default the friction that the robot's model states.

    Raises
    ------
    SettingsError
        If the result has neither samples nor a friction_torque.parquet beside its file, or its law is unknown.

    Examples
    --------
    >>> write_report(result, "report.html")
    """
    result = result if isinstance(result, Result) else read_result(result)
    evidence = result.evidence or saved_evidence(result)
    law = get_law(result.law)
    reference = stated_friction(evidence.robot, result) if reference is NO_REFERENCE else reference
    shown = replace(result, joints=result.all_friction, couplings={})
    with np.errstate(all="ignore"):
        on_demand = [
            joint_panels(shown, evidence, law, reference),
            replayed_torques(shown, evidence.samples),
            details.verdict_table(shown, law, reference),
            details.terms(shown),
            correlations(shown),
            sides(result, evidence.prismatic),
            details.held_out(result),
            details.corrections(result),
            details.torque_meaning(evidence.torque_source) if evidence.torque_source else None,
            timeline(evidence.phases, result.log.usage),
            details.provenance(result, evidence),
        ]
        write_page(
            path,
            f"Joint friction of {result.robot}",
            [first_screen(shown, evidence, reference)],
            folded=on_demand,
            lead=(robot_picture(evidence.robot, shown) if evidence.robot else Markup())
            + heading(shown, law, reference),
        )
