"""The report as a whole: its sections in reading order, in one file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from stribeck.errors import SettingsError
from stribeck.friction import get_law
from stribeck.outputs import whole_or_not_at_all
from stribeck.report.corrections import corrections
from stribeck.report.figure import house_style
from stribeck.report.first_screen import first_screen
from stribeck.report.heading import heading
from stribeck.report.held_out import held_out
from stribeck.report.joint_panels import joint_panels
from stribeck.report.page import Section, render, render_page
from stribeck.report.reference import NO_REFERENCE, Reference
from stribeck.report.sides import sides
from stribeck.report.timeline import timeline
from stribeck.report.torque_meaning import torque_meaning
from stribeck.report.verdict_table import terms, verdict_table
from stribeck.result import Evidence, Result
from stribeck.samples import Samples

SUSPICIOUS = 0.2
"""Share of positive power above which the model, the torque's sign or a delay is worth a look."""

CHANCE = 0.5
"""Share that a torque without any relation to the velocity has; the bars end there."""


def write_report(
    result: Result, path: str | Path, *, reference: Reference = NO_REFERENCE, further: Sequence[Section] = ()
) -> None:
    """Write one self-contained HTML file: no network, the same bytes for the same result.

    Parameters
    ----------
    result
        With its evidence, as `identify` returns it.
    path
        The file to write; whole or not at all.
    reference
        Known friction that is shown beside what was found.
    further
        More sections, folded like all that stands behind the warnings.

    Raises
    ------
    SettingsError
        If the result has no evidence (one read from a result.json has none), or its law is unknown.

    Examples
    --------
    >>> write_report(result, "report.html")
    """
    evidence = result.evidence
    if evidence is None:
        raise SettingsError(
            f"{path}: this result has no samples to draw (read from a result.json?); expected one from `identify`"
        )
    law = get_law(result.law)
    shown = replace(result, joints=result.all_friction, couplings={})
    with house_style():
        on_demand = [
            joint_panels(shown, evidence, law, reference),
            verdict_table(shown, evidence, law, reference),
            terms(shown),
            *further,
            sides(result, evidence, law),
            held_out(result),
            corrections(result),
            torque_meaning(evidence.torque_source),
            power(shown),
            timeline(evidence.phases, _start(evidence.close_up)),
            provenance(result, evidence),
        ]
        page = render_page(
            f"Joint friction of {result.robot}",
            [first_screen(shown, evidence, law)],
            folded=[section for section in on_demand if section is not None],
            lead=heading(shown, law),
            plots=True,
        )
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _start(close_up: Samples | None) -> float | None:
    return float(close_up.time[0]) if close_up is not None and len(close_up.time) else None


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


def provenance(result: Result, evidence: Evidence) -> Section:
    """Return the section with logs and their hashes, versions, settings, and what was done to the log on the way."""
    paths = [result.log.path] if isinstance(result.log.path, str) else result.log.path
    hashes = [result.log.sha256] if isinstance(result.log.sha256, str) else result.log.sha256
    return Section(
        anchor="provenance",
        title="Settings and provenance",
        body=render(
            "provenance.html.j2",
            logs=list(zip(paths, hashes, strict=True)),
            rows=evidence.provenance,
            notes=evidence.notes,
        ),
    )
