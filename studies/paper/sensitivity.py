"""Section 5.3 and 6.1.2: M_mod is invertible on one foot but not on two, and standing legs amplify errors.

The diagonal of M_mod is the inertia that a joint's torque accelerates: of a swinging leg, or of the whole robot if the
leg stands.
"""

import numpy as np

from stribeck import Settings
from stribeck.core.base.typing import Array
from stribeck.core.dynamics.rooted import joint_inertia
from stribeck.core.dynamics.state import State
from stribeck.simulation.run import Simulated
from studies.changes import known
from studies.dense import constrained_sample
from studies.markdown import short
from studies.paper.estimate import EXACT, Differences, estimate, rms
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS
from studies.paper.walks import get_walk

WALKS = ("right-knee-ideal",)
STRIDE = 25
"""Stride between the samples whose matrices are computed."""
SINGULAR = 1e-9
"""Singular values below this share of the largest count as zero."""
ERRORS = ("acceleration", "own", "whole", "error")
"""Keys of the errors of the backward difference [rad/s^2], of friction predicted by the diagonal and by the row of
M_mod, and of the estimated friction [N m]."""


def run(quick: bool) -> Numbers:
    walk = get_walk("right-knee-ideal", quick)
    legs, joints = _legs(walk), {}
    for joint in JOINTS:
        stance, swing = legs[joint, "stance"], legs[joint, "swing"]
        joints[joint] = {
            "stance": _numbers(*stance),
            "swing": _numbers(*swing),
            "inertia_ratio": np.mean(stance[0]) / np.mean(swing[0]),
            "largest_ratio": np.max(stance[0]) / np.min(swing[0]),
        }
    return {"joints": joints, "ranks": _ranks(walk)}


def _numbers(inertia: Array, *errors: Array) -> dict[str, float]:
    return {"inertia": float(np.mean(inertia)), **dict(zip(ERRORS, map(rms, errors), strict=True))}


def _legs(walk: Simulated) -> dict[tuple[str, str], Array]:
    """Compute friction errors from backward differences, by joint and by phase of its leg.

    The rows are the diagonal of M_mod [kg m^2], and `ERRORS`; the columns are samples of both sides.
    """
    schemes = (EXACT, Differences(scheme="backward"))
    exact, late = (estimate(walk, Settings(filter=each, standing_legs=True)) for each in schemes)
    _, ours, theirs = np.intersect1d(exact.samples.time, late.samples.time, return_indices=True)
    ours, theirs = ours[::STRIDE], theirs[::STRIDE]
    rows = np.searchsorted(walk.log.time, exact.samples.time[ours] - exact.samples.period / 2)
    change = late.samples.acceleration[theirs] - exact.samples.acceleration[ours]
    parts: dict[tuple[str, str], list[Array]] = {
        (joint, phase): [] for joint in JOINTS for phase in ("stance", "swing")
    }
    controlled = walk.robot.torque_controlled
    for foot in walk.robot.contacts:
        here = exact.standing_on(foot)[ours]
        inertia = joint_inertia(walk.robot.rooted_at(foot), walk.log.position[rows[here]])
        inertia = inertia[:, controlled[:, None], controlled]
        whole = -np.einsum("tij,tj->ti", inertia, change[here])
        for side in ("left", "right"):
            for joint in JOINTS:
                k = exact.column(f"{side}_{joint}")
                own, off = inertia[:, k, k], change[here, k]
                part = np.array([own, off, -own * off, whole[:, k], late.error[theirs[here], k]])
                parts[joint, "stance" if foot.startswith(side) else "swing"].append(part)
    return {key: np.concatenate(each, axis=1) for key, each in parts.items()}


def _ranks(walk: Simulated) -> dict[str, dict[str, float]]:
    """Compute the ranks of M_mod^-1 and the condition numbers of A and M_mod^-1, by the number of standing feet."""
    log, contact = walk.log, known(walk.log.contact)
    state = State(log.position, known(log.velocity), known(log.acceleration))
    found: dict[str, dict[str, float]] = {}
    for count in (1, 2):
        ranks, conditions = [], []
        for k in np.flatnonzero(contact.sum(axis=1) == count)[:: 4 * STRIDE].tolist():
            feet = tuple(foot for foot, stands in zip(log.foot_names, contact[k], strict=True) if stands)
            sample = constrained_sample(walk.robot, feet, state, log.torque, k)
            values = np.linalg.svd(sample.mobility, compute_uv=False)
            ranks.append(int(np.sum(values > SINGULAR * values[0])))
            conditions.append(float(np.linalg.cond(sample.constraint_inertia)))
        found[str(count)] = {
            "joints": len(walk.robot.torque_controlled),
            "lowest_rank": min(ranks),
            "highest_rank": max(ranks),
            "largest_condition_of_A": max(conditions),
        }
    return found


def texts(numbers: Numbers) -> dict[str, str]:
    """Format inertias and errors per joint, and the ranks."""
    joints, ranks = numbers["joints"], numbers["ranks"]
    ratios = {joint.replace("_", " "): row["inertia_ratio"] for joint, row in joints.items()}
    most, least = (choose(ratios, key=ratios.__getitem__) for choose in (max, min))
    return {
        "knee": f"{ratios['knee']:.0f}",
        "knee-diagonal": f"{joints['knee']['stance']['own']:.2g} N m",
        "knee-error": f"{joints['knee']['stance']['error']:.2g} N m",
        "rank-two-feet": f"{ranks['2']['highest_rank']}",
        "condition": short(max(row["largest_condition_of_A"] for row in ranks.values())),
        "most": f"{short(ratios[most])} ({most})",
        "least": f"{ratios[least]:.0f} ({least})",
    }
