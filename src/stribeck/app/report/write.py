"""Report of a result, and its folded sections: verdicts, terms, correlations, validation, corrections, provenance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePath

import numpy as np
from markupsafe import Markup

from stribeck.app.report.charts import Chart, axis, image, line, robust_limits, velocity_axes
from stribeck.app.report.curves import sides
from stribeck.app.report.inspection import timeline
from stribeck.app.report.joints import joint_panels, joint_samples, replayed_torques, running_mean
from stribeck.app.report.overview import first_screen, heading, robot_picture
from stribeck.app.report.page import Section, parameter_names, section, short_names, symbols, write_page
from stribeck.core.base.typing import Array
from stribeck.core.errors import RobotFileError
from stribeck.core.friction import get_law
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.result import BodyCorrection, Evidence, Result, read_result
from stribeck.core.result.reference import NO_REFERENCE, Reference
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.result.saved import saved_evidence
from stribeck.core.robot import Robot
from stribeck.design import read_friction


def write_report(result: Result | str | Path, path: str | Path, *, reference: Reference = NO_REFERENCE) -> None:
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
    law, source = get_law(result.law), evidence.torque_source
    reference = stated_friction(evidence.robot, result) if reference is NO_REFERENCE else reference
    shown = replace(result, joints=result.all_friction, couplings={})
    with np.errstate(all="ignore"):
        on_demand = [
            joint_panels(shown, evidence, law, reference),
            replayed_torques(shown, evidence.samples),
            verdict_table(shown, law, reference),
            terms(shown),
            correlations(shown),
            sides(result, evidence.prismatic),
            held_out(result),
            corrections(result),
            section("torque-source", "Which friction is measured", "torque_meaning", source=source) if source else None,
            timeline(evidence.phases, result.log.usage),
            provenance(result, evidence),
        ]
        write_page(
            path,
            f"Joint friction of {result.robot}",
            [first_screen(shown, evidence, reference)],
            folded=on_demand,
            lead=(robot_picture(evidence.robot, shown) if evidence.robot else Markup())
            + heading(shown, law, reference),
        )


def stated_friction(robot: Robot | None, result: Result) -> Reference:
    """Read friction and rotor inertia that the robot's model states; empty without any, or without its file."""
    try:
        stated = read_friction(robot.model_file)[0] if robot else {}
    except (RobotFileError, ImportError):  # a Pinocchio model, a file that has gone, or an MJCF without MuJoCo
        return NO_REFERENCE
    if robot is None or not any(stated.values()):
        return NO_REFERENCE
    curves, parameters = {}, {}
    for name, joint in result.joints.items():
        if (friction := stated.get(name)) and joint.torque_unit is None and joint.parameters:
            velocity = np.linspace(*joint.velocity_range, 101)
            curves[name] = velocity, friction.coulomb * np.sign(velocity) + friction.viscous * velocity
            rotor = float(robot.armature[robot.joint_names.index(name)])
            parameters[name] = {"coulomb": friction.coulomb, "viscous": friction.viscous}
            parameters[name] |= {"armature": rotor} if rotor else {}
    return Reference(name="the model", curves=curves, parameters=parameters)


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
    order = list(result.joints)
    return section("terms", "Terms of the law", "terms", order=order, rows=chosen, columns=shown, common=common)


def held_out(result: Result) -> Section | None:
    """Render one table per validation log; None without validation logs."""
    if not result.held_out:
        return None
    return section("held-out", "Validation logs", "held_out", logs=result.held_out, joints=result.joints)


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


def provenance(result: Result, evidence: Evidence) -> Section:
    """Render logs with hashes, versions, settings, and notes on the preparation of the log."""
    hashes = [result.log.sha256] if isinstance(result.log.sha256, str) else result.log.sha256
    logs = list(zip(result.log.paths, hashes, strict=True))
    return section("provenance", "Settings and provenance", "provenance", logs=logs, evidence=evidence)


def correlations(result: Result) -> Section | None:
    """Draw the matrix of correlations, and list the strongest; None with fewer than two known parameters."""
    joints = {name: joint for name, joint in result.joints.items() if joint.parameters}
    posterior, short = result.posterior, short_names(result.joints)
    count = sum(len(joint.parameters) for joint in joints.values())  # bodies follow
    error = np.sqrt(np.diag(posterior.covariance)[:count])
    if count < 2 or not error.any():
        return None
    matrix = posterior.covariance[:count, :count] / np.maximum(np.outer(error, error), 1e-300)
    pixels = np.zeros((count, count, 4), dtype=np.uint8)
    pixels[..., :3] = np.where(matrix[..., None] < 0, (64, 133, 224), (209, 72, 10))  # blue, orange
    pixels[..., 3] = 15 * np.round(17 * np.minimum(np.abs(matrix), 1.0))
    ends = np.cumsum([0, *(len(joint.parameters) for joint in joints.values())])
    middles, names = (ends[:-1] + ends[1:]) / 2, [short[name] for name in joints]
    chart: Chart = {
        "x": axis("", (0.0, count), at=middles.tolist(), names=names),
        "y": axis("", (0.0, count), at=(count - middles).tolist(), names=names),
        "lines": [],
        "images": [image(pixels, (0.0, count), (0.0, count))],
        "equal": True,
        "height": 560,
    }
    rows, columns = np.triu_indices(count, 1)
    strongest = np.argsort(-np.abs(matrix[rows, columns]))[:8]
    pairs = [
        (*(posterior.names[k] for k in (rows[n], columns[n])), float(matrix[rows[n], columns[n]])) for n in strongest
    ]
    caption = "Each square is a pair of parameters, in the order of the table of verdicts"
    return section(
        "correlations", "Correlations of the parameters", "correlations", {"m": (chart, caption)}, pairs=pairs
    )
