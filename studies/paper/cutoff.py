"""Compare cutoffs for the friction of the swinging leg: the paper's 10 Hz, the choice of `auto`, and others."""

import numpy as np

from stribeck import Settings
from stribeck.core.friction import get_law
from stribeck.core.settings import FilterSettings
from stribeck.simulation.run import Simulated
from studies.markdown import percent
from studies.paper.estimate import estimate, fit_law, rms
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, SIDE
from studies.paper.walks import legs_by_sensors

WALKS = ("legs-contact", "harsh")
CUTOFFS = (5, 10, 20, 30, 45, 65, 90)
"""Cutoffs of a Savitzky-Golay filter of order 4 [Hz]."""
PAPER = 10
ENOUGH = 4000
"""Maximum number of samples in a fit."""


def run(quick: bool) -> Numbers:
    walks, cutoffs = legs_by_sensors(quick), (PAPER, 45) if quick else CUTOFFS
    kinds = [FilterSettings(kind="savitzky-golay", cutoff=float(cutoff)) for cutoff in cutoffs]
    return {
        "cutoffs": cutoffs,
        "curves": {name: [_curve_error(walk, kind) for kind in kinds] for name, walk in walks.items()},
        "auto": {name: _curve_error(walk, FilterSettings()) for name, walk in walks.items()},
    }


def _curve_error(walk: Simulated, kind: FilterSettings) -> float:
    """Compute the RMS difference between fitted and true law without offset over all joints, relative to Fc [1]."""
    law, settings = get_law("stribeck"), Settings(filter=kind)
    found, errors = estimate(walk, settings), []
    for joint in JOINTS:
        true = walk.truth.parameters[f"{SIDE}_{joint}"]
        fitted, velocity = fit_law(found, f"{SIDE}_{joint}", settings, ENOUGH)
        mine, known = (
            law.torque(velocity, np.array([each[parameter.name] for parameter in law.parameters]))
            for each in (fitted, true)
        )
        errors.append(rms(mine - known - (mine - known).mean()) / true["coulomb"])
    return rms(np.array(errors))


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the errors by cutoff."""
    cutoffs, curves = numbers["cutoffs"], numbers["curves"]
    best, cutoff = min(zip(curves["realistic"], cutoffs, strict=True))
    return {
        "paper-realistic": percent(curves["realistic"][cutoffs.index(PAPER)]),
        "best-realistic": f"{100 * best:.2g} % at {cutoff} Hz",
    }
