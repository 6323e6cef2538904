"""Fig. 7.7 and 7.8: the paper's experiment, whose data are not public, repeated on a simulated walk with bad sensors.

Friction of forty steps with sensors of the profile `harsh` is estimated with the exact model, and with models in which
every body has errors.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.friction import get_law
from stribeck.judgement.curve_fit.fit import fit_joint
from stribeck.judgement.curve_fit.problem import joint_problem
from stribeck.settings import FilterSettings, SupportSettings
from studies.markdown import markdown_table
from studies.paper.estimate import Estimate, estimate
from studies.paper.inexact import drawn, with_bodies
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, OTHER_SIDE, SIDE, feeding, split, swinging
from studies.paper.walks import get_walk

WALKS = ("harsh", "legs-contact")
SEEDS = (1, 2, 3, 4)
"""Seeds of models with errors in every body."""
SETTINGS = Settings(
    filter=FilterSettings(kind="savitzky-golay", window=151),  # the paper's
    averaged_law=True,  # the torque goes through it, too
    support=SupportSettings(trim_start=0.1, trim_end=0.1),
)
ENOUGH = 4000
"""Maximum number of samples in a fit."""
KEYS = ("feeding", "feeding_levelled", "split")


def run(quick: bool) -> Numbers:
    walks = {name: get_walk(name, quick) for name in WALKS}
    seeds = SEEDS[2:3] if quick else SEEDS
    found: dict[str, dict[str, list[Estimate]]] = {}
    for name, walk in walks.items():
        wrong = [replace(walk, robot=with_bodies(walk.robot, drawn(seed))) for seed in seeds]
        found[name] = {"exact": [estimate(walk, SETTINGS)], "drawn": [estimate(each, SETTINGS) for each in wrong]}
    harsh = found["harsh"]
    return {
        name: {
            model: {joint: _mean([_measures(each, joint) for each in several]) for joint in JOINTS}
            for model, several in models.items()
        }
        for name, models in found.items()
    } | {"sides": {joint: _between_sides(harsh["exact"][0], joint) for joint in JOINTS}}


def _measures(found: Estimate, joint: str) -> dict[str, float]:
    """Compute shares with positive power, with and without the fitted offset [1], and the error's split [N m]."""
    curve, law = swinging(found, joint), get_law("stribeck")
    problem = joint_problem(found.samples, f"{SIDE}_{joint}", law, SETTINGS)
    fit = fit_joint(problem.take(slice(None, None, -(-len(problem.velocity) // ENOUGH))))
    offset = fit.values[fit.names.index("offset")]
    return {
        "feeding": feeding(curve.velocity, curve.torque),
        "feeding_levelled": feeding(curve.velocity, curve.torque - offset),
        "split": split(curve.velocity, curve.acceleration, curve.torque - curve.truth),
    }


def _mean(rows: list[dict[str, float]]) -> dict[str, float]:
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def _between_sides(found: Estimate, joint: str) -> float:
    """Compute the difference between the mean errors of the right and the left joint [N m]."""
    right, left = (swinging(found, joint, side) for side in (SIDE, OTHER_SIDE))
    return abs(float(np.mean(right.torque - right.truth) - np.mean(left.torque - left.truth)))


def texts(numbers: Numbers) -> dict[str, str]:
    """Format shares and splits by log, model and joint."""
    cases = [(name, model) for name in ("legs-contact", "harsh") for model in ("exact", "drawn")]
    label = {"legs-contact": "exact log", "harsh": "harsh log", "exact": "exact model", "drawn": "inexact model"}
    head = ("joint", *(f"{label[name]}, {label[model]}" for name, model in cases))
    tables = {}
    for key in KEYS:
        rows = [
            (joint.replace("_", " "), *(_text(numbers[name][model][joint][key], key) for name, model in cases))
            for joint in JOINTS
        ]
        tables[key.replace("_", "-")] = markdown_table(head, rows)
    exact, wrong = numbers["harsh"]["exact"], numbers["harsh"]["drawn"]
    return tables | {
        "knee-exact": _text(exact["knee"]["feeding"], "feeding"),
        "knee-wrong": _text(wrong["knee"]["feeding"], "feeding"),
        "split-exact": f"{exact['knee']['split']:.2f} N m",
        "split-wrong": f"{wrong['knee']['split']:.2f} N m",
        "sides": f"{numbers['sides']['hip_pitch']:.1f} N m",
    }


def _text(value: float, key: str) -> str:
    return f"{value:.2g}" if key == "split" else f"{100 * value:.0f} %"
