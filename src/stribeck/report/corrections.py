"""What the whole log says about the model: the corrections of masses, centres, gains and zeros."""

from __future__ import annotations

import numpy as np

from stribeck.report.branches import branch_figures
from stribeck.report.page import Section, render
from stribeck.result import BodyCorrection, Result

LEAST_KNOWN = 0.1
"""Share [1] of a body's prior variance that the log must remove for the body to be listed."""


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
