"""Compare cutoffs for the friction of the swinging leg: the paper's 10 Hz, the choice of `auto`, and others."""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.friction import get_law
from stribeck.judgement.curve_fit.fit import fit_joint
from stribeck.judgement.curve_fit.problem import joint_problem
from stribeck.settings import FilterSettings
from stribeck_simulation.run import Simulated
from stribeck_simulation.sensors.measure import measure, sensors_for
from stribeck_simulation.sensors.profiles import get_profile
from studies.markdown import markdown_table
from studies.paper.estimate import estimate, rms
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, SIDE
from studies.paper.walks import get_walk

WALKS = ("legs-contact", "harsh")
CUTOFFS = (5, 10, 20, 30, 45, 65, 90)
"""Cutoffs of a Savitzky-Golay filter of order 4 [Hz]."""
PAPER = 10
SEED = 1
ENOUGH = 4000
"""Maximum number of samples in a fit."""


def run(quick: bool) -> Numbers:
    exact, harsh = (get_walk(name, quick) for name in WALKS)
    realistic = measure(exact.log, sensors_for(exact.log, get_profile("realistic"), SEED))
    walks = {"exact": exact, "realistic": replace(exact, log=realistic), "harsh": harsh}
    cutoffs = (PAPER, 45) if quick else CUTOFFS
    kinds = [FilterSettings(kind="savitzky-golay", cutoff=float(cutoff)) for cutoff in cutoffs]
    curves = {name: [_curve_errors(walk, kind) for kind in kinds] for name, walk in walks.items()}
    auto = {name: _curve_errors(walk, FilterSettings()) for name, walk in walks.items()}
    return {
        "cutoffs": cutoffs,
        "curves": {name: [_over_joints(row) for row in rows] for name, rows in curves.items()},
        "auto": {name: _over_joints(row) for name, row in auto.items()},
        "joints_at_paper": {name: rows[cutoffs.index(PAPER)] for name, rows in curves.items()},
        "joints_at_auto": auto,
    }


def _curve_errors(walk: Simulated, kind: FilterSettings) -> dict[str, float]:
    """Compute the RMS difference between fitted and true law without offset per joint, relative to Fc [1]."""
    law, settings = get_law("stribeck"), Settings(filter=kind)
    samples = estimate(walk, settings).samples
    errors = {}
    for joint in JOINTS:
        problem = joint_problem(samples, f"{SIDE}_{joint}", law, settings)
        problem = problem.take(slice(None, None, -(-len(problem.velocity) // ENOUGH)))
        named = walk.truth.parameters[f"{SIDE}_{joint}"]
        truth = np.array([named[parameter.name] for parameter in law.parameters])
        fitted = fit_joint(problem).values
        difference = law.torque(problem.velocity, fitted) - law.torque(problem.velocity, truth)
        errors[joint] = rms(difference - difference.mean()) / named["coulomb"]
    return errors


def _over_joints(errors: dict[str, float]) -> float:
    return rms(np.array([*errors.values()]))


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the errors by cutoff and by joint."""
    cutoffs, curves, auto = numbers["cutoffs"], numbers["curves"], numbers["auto"]
    rows = [(f"{f} Hz", *(f"{100 * each[k]:.2g} %" for each in curves.values())) for k, f in enumerate(cutoffs)]
    rows.append(("auto", *(f"{100 * each:.2g} %" for each in auto.values())))
    cases = [(name, key) for name in curves for key in ("joints_at_paper", "joints_at_auto")]
    joints = [
        (joint.replace("_", " "), *(f"{100 * numbers[key][name][joint]:.2g} %" for name, key in cases))
        for joint in JOINTS
    ]
    head = [f"{name}, {'auto' if key == 'joints_at_auto' else '10 Hz'}" for name, key in cases]
    best = {name: min(zip(each, cutoffs, strict=True)) for name, each in curves.items()}
    return {
        "table": markdown_table(("cutoff", *curves), rows),
        "joints": markdown_table(("joint", *head), joints),
        **{f"paper-{name}": f"{100 * each[cutoffs.index(PAPER)]:.0f} %" for name, each in curves.items()},
        **{f"best-{name}": f"{100 * error:.2g} % at {f} Hz" for name, (error, f) in best.items()},
    }
