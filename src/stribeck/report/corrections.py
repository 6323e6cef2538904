"""What the whole log says about the model: the corrections of masses, centres, gains, zeros and delays."""

import numpy as np
from markupsafe import Markup

from stribeck.report.density import robust_limits
from stribeck.report.figure import COLOURS, inline_svg, new_axes
from stribeck.report.joint_figures import running_mean
from stribeck.report.page import Section, render
from stribeck.result import BodyCorrection, Result
from stribeck.samples import Samples
from stribeck.typing import Array

LEAST_KNOWN = 0.1
"""Share [1] of a body's prior variance that the log must remove for the body to be listed."""

BINS = 24
"""Of the velocity, over which a branch is averaged."""


def corrections(result: Result) -> Section | None:
    """Return the section with the corrections that the log supports, or None where none were asked for."""
    errors = result.corrections
    if errors is None:
        return None
    bodies = [
        _row(name, body)
        for name, body in sorted(errors.bodies.items(), key=lambda item: -item[1].known)
        if body.known >= LEAST_KNOWN
    ]
    calibration = [
        {
            "name": name,
            "gain": [100 * part for part in errors.torque_gain.get(name, ())],
            "zero": [1e3 * part for part in errors.encoder_zero.get(name, ())],
        }
        for name in dict.fromkeys([*errors.torque_gain, *errors.encoder_zero])
    ]
    body = render(
        "corrections.html.j2",
        chi_square=errors.chi_square,
        heterogeneity=errors.disagreement,
        bodies=bodies,
        others=len(errors.bodies) - len(bodies),
        calibration=calibration,
        delays=[
            (what, [1e3 * part for part in delay])
            for what, delay in (("Torques", errors.torque_delay), ("Base orientation", errors.base_delay))
            if delay
        ],
        figures=branch_figures(result),
    )
    return Section(anchor="corrections", title="Corrections of the model", body=body)


def _row(name: str, body: BodyCorrection) -> dict[str, object]:
    centres = 1e3 * np.array(body.centre_of_mass)
    before, after = (np.array(inertia)[[0, 2, 5]] for inertia in body.inertia)
    return {
        "name": name,
        "mass": body.mass,
        "mass_error": body.mass_error,
        "shifts": [
            (float(shift), 1e3 * error)
            for shift, error in zip(centres[1] - centres[0], body.centre_of_mass_error, strict=True)
        ],
        "moments": (100 * (after / np.where(before > 0, before, np.nan) - 1)).tolist(),
        "known": 100 * body.known,
    }


def branch_figures(result: Result) -> list[tuple[Markup, str]]:
    """Return a drawing and a caption for each joint with numbers: none if nothing was corrected.

    The curve of a joint that speeds up and that of one that slows down are one if the model is right: an error of
    inertia splits them, one of weight shifts both (Fig. 7.5 to 7.7 of Egle 2021).
    """
    evidence = result.evidence
    if evidence is None or evidence.correction is None:
        return []
    figures = []
    for index, (name, joint) in enumerate(result.joints.items()):
        if not joint.parameters or not _usable(evidence.correction[0], name).any():
            continue
        before, after = (branches(samples, name) for samples in evidence.correction)
        unit = ("m/s", "N") if name in evidence.prismatic else ("rad/s", "N m")
        axes = new_axes(f"velocity [{unit[0]}]", f"friction [{unit[1]}]")
        for (centre, up, down), colour, dashes in ((before, "muted", (0, (3, 2))), (after, "law", "solid")):
            for branch in (up, down):
                axes.plot(centre, branch, color=COLOURS[colour], linewidth=1.5, linestyle=dashes)
        label = f"{name}: mean friction torque of rising and of falling velocity, before and after the correction"
        splits = [f"{_split(*means):.2g}" for means in (before, after)]
        caption = f"{name}: branches apart by {splits[0]} {unit[1]} before, {splits[1]} {unit[1]} after (RMS)"
        figures.append((inline_svg(axes, label, f"b{index}"), caption))
    return figures


def branches(samples: Samples, joint: str) -> tuple[Array, Array, Array]:
    """Return velocities and the mean friction torques there while a joint's velocity rises and falls, (K,) each."""
    column, keep = samples.joint_names.index(joint), _usable(samples, joint)
    velocity, torque = samples.velocity[keep, column], samples.friction_torque[keep, column]
    rises = samples.acceleration[keep, column] > 0
    limits = robust_limits(velocity, share=0.0, margin=0.03)
    centre, up = running_mean(velocity[rises], torque[rises], limits, BINS)
    _, down = running_mean(velocity[~rises], torque[~rises], limits, BINS)
    return centre, up, down


def _usable(samples: Samples, joint: str) -> Array:
    if joint not in samples.joint_names:
        return np.zeros(len(samples.time), dtype=bool)
    column = samples.joint_names.index(joint)
    return np.asarray(samples.usable[:, column] & np.isfinite(samples.friction_torque[:, column]))


def _split(_: Array, up: Array, down: Array) -> float:
    """Return how far the branches are apart where both are known (RMS)."""
    apart = (up - down)[np.isfinite(up - down)]
    return float(np.sqrt(np.mean(apart**2))) if len(apart) else 0.0
