"""Folded sections of the report: verdicts, terms, validation, corrections, torque source and provenance."""

from pathlib import PurePath

import numpy as np

from stribeck.app.report.charts import Chart, line, robust_limits, velocity_axes
from stribeck.app.report.joints import joint_samples, running_mean
from stribeck.app.report.page import Section, section
from stribeck.app.report.text import parameter_names, short_names, symbols
from stribeck.core.base.typing import Array, TorqueSource
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.result import BodyCorrection, Evidence, Result
from stribeck.core.result.reference import Reference
from stribeck.core.result.samples import FrictionSamples


def verdict_table(result: Result, law: FrictionLaw, reference: Reference) -> Section:
    """Render the table of verdicts and parameters, with one row per joint."""
    columns = {}
    for name in parameter_names(result, law):
        units = [joint.parameters[name].unit for joint in result.joints.values() if name in joint.parameters]
        units += [parameter.unit for parameter in law.parameters if parameter.name == name] or ["1"]
        columns[name] = max(units, key=units.count)  # cells of other joints state their unit
    return section(
        "verdicts",
        "Verdicts",
        "verdict_table",
        columns=columns,
        symbols=symbols(law),
        joints=result.joints,
        short=short_names(result.joints),
        known=reference,
    )


def terms(result: Result) -> Section | None:
    """Render the table of terms, with one row per joint; None for a given law."""
    chosen = {name: joint.terms for name, joint in result.joints.items() if joint.terms}
    if not chosen:
        return None
    common, shown = {}, []  # terms that no joint tried, for one reason; the others
    for term in dict.fromkeys(term for trials in chosen.values() for term in trials):
        verdicts = [trials[term] for trials in chosen.values() if term in trials]  # files may lack some
        reasons = {verdict.reason for verdict in verdicts}
        if len(reasons) == 1 and all(verdict.gain is None for verdict in verdicts):
            common[term] = reasons.pop()
        else:
            shown.append(term)
    places = {name: index for index, name in enumerate(result.joints)}
    return section("terms", "Terms of the law", "terms", columns=shown, rows=chosen, places=places, common=common)


def held_out(result: Result) -> Section | None:
    """Render one table per validation log; None without validation logs."""
    if not result.held_out:
        return None
    units = {name: joint.curve[0].unit for name, joint in result.joints.items() if joint.curve}
    return section("held-out", "Validation logs", "held_out", logs=result.held_out, units=units)


def corrections(result: Result) -> Section | None:
    """Render the corrections of model and sensors; None without corrections."""
    errors = result.corrections
    if errors is None:
        return None
    ordered = sorted(errors.bodies.items(), key=lambda item: -item[1].known)
    reported = {name for finding in result.findings if finding.check.startswith("bodies-") for name in finding.joints}
    bodies = {name: body for name, body in ordered if name in reported or (body.known >= 0.1 and _differs(body))}
    sensors = [*errors.torque_gain.items(), *errors.encoder_zero.items()]
    wrong = [name for name, (value, error) in sensors if abs(value) > 1.96 * error]
    return section(
        "corrections",
        "Corrections of the model",
        "corrections",
        {f"b{k}": figure for k, figure in enumerate(branch_charts(result))},
        errors=errors,
        bodies=bodies,
        logs=[PurePath(path).name for path in result.log.paths],
        joints=list(dict.fromkeys(wrong)),
    )


def _differs(body: BodyCorrection) -> bool:
    """Check that the mass or the center of mass of a body differs from the model by more than its 95 % interval."""
    before, after = (np.array([body.mass[k], *body.centre_of_mass[k]]) for k in (0, 1))
    return bool((np.abs(after - before) > 1.96 * np.array([body.mass_error, *body.centre_of_mass_error])).any())


def branch_charts(result: Result) -> list[tuple[Chart, str]]:
    """Draw the branches of each joint with parameters before and after the correction; empty without corrections.

    With a correct model, the branches of rising and falling velocity coincide. An error of the inertia splits them, an
    error of the weight shifts both (Fig. 7.5 to 7.7 of Egle 2021).
    """
    evidence = result.evidence
    if evidence is None or evidence.correction is None:
        return []
    figures = []
    for name, joint in result.joints.items():
        if not joint.parameters or not len(joint_samples(evidence.correction[0], name).time):
            continue
        both = [branches(samples, name) for samples in evidence.correction]
        lines = [
            line(centre, branch, colour, f"{when}, {how}", dash=dash)
            for (centre, *pair), colour, when, dash in zip(
                both, ("muted", "law"), ("given", "corrected"), ([3, 2], []), strict=True
            )
            for branch, how in zip(pair, ("rising", "falling"), strict=True)
        ]
        units = joint.units(name in evidence.prismatic)
        torque = robust_limits(np.array([y for trace in lines for y in trace["y"] if y is not None]), share=0.0)
        velocity = robust_limits(both[0][0], share=0.0, margin=0.03)
        splits = [f"{_split(up, down):.2g}" for _, up, down in both]
        caption = f"{name}: distance of the branches {splits[0]} {units[1]} before, {splits[1]} {units[1]} after (RMS)"
        figures.append(({**velocity_axes(units, velocity, torque), "lines": lines}, caption))
    return figures


def branches(samples: FrictionSamples, joint: str) -> tuple[Array, Array, Array]:
    """Compute the mean friction torque versus velocity while the velocity rises and while it falls, shape (K,) each."""
    shown = joint_samples(samples, joint)
    limits = robust_limits(shown.velocity, share=0.0, margin=0.03)
    centre, up = running_mean(shown.velocity[shown.rises], shown.torque[shown.rises], limits, bins=24)
    _, down = running_mean(shown.velocity[~shown.rises], shown.torque[~shown.rises], limits, bins=24)
    return centre, up, down


def _split(up: Array, down: Array) -> float:
    """Compute the RMS distance of the branches where both are known."""
    apart = (up - down)[np.isfinite(up - down)]
    return float(np.sqrt(np.mean(apart**2))) if len(apart) else 0.0


def torque_meaning(source: TorqueSource) -> Section:
    """Render the section on the friction that the torque source includes, and its limits."""
    return section("torque-source", "Which friction is measured", "torque_meaning", source=source)


def provenance(result: Result, evidence: Evidence) -> Section:
    """Render logs with hashes, versions, settings, and notes on the preparation of the log."""
    hashes = [result.log.sha256] if isinstance(result.log.sha256, str) else result.log.sha256
    logs = list(zip(result.log.paths, hashes, strict=True))
    rows, notes = evidence.provenance, evidence.notes
    return section("provenance", "Settings and provenance", "provenance", logs=logs, rows=rows, notes=notes)
