"""Section 5.3 and 6.1.2: M_mod is invertible on one foot but not on two, and standing legs amplify errors.

The diagonal of M_mod is the inertia that a joint's torque accelerates: of a swinging leg, or of the whole robot if the
leg stands.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck import Settings
from stribeck.base.typing import Array
from stribeck.dynamics.rooted import joint_inertia
from stribeck.dynamics.state import State
from stribeck_simulation.run import Simulated
from studies.dense import constrained_sample
from studies.markdown import markdown_table, short
from studies.paper.estimate import EXACT, Differences, estimate, rms
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS
from studies.paper.walks import get_walk

WALKS = ("right-knee-ideal",)
SIDES = ("left", "right")
STRIDE = 25
"""Stride between the samples whose matrices are computed."""
SINGULAR = 1e-9
"""Singular values below this share of the largest count as zero."""
ERRORS = {"acceleration": "δa", "own": "diagonal × δa", "whole": "M_mod δa", "error": "error"}
"""Labels in the table, by key of the numbers."""
BACKWARD = Differences(scheme="backward")


def run(quick: bool) -> Numbers:
    walk = get_walk("right-knee-ideal", quick)
    legs = _legs(walk)
    joints = {}
    for joint in JOINTS:
        stance, swing = legs[joint, "stance"], legs[joint, "swing"]
        joints[joint] = {
            "stance": stance.numbers(),
            "swing": swing.numbers(),
            "inertia_ratio": np.mean(stance.inertia) / np.mean(swing.inertia),
            "largest_ratio": np.max(stance.inertia) / np.min(swing.inertia),
        }

    return {"joints": joints, "ranks": _ranks(walk)}


@dataclass(frozen=True, eq=False)
class _Leg:
    """Errors of one joint while its leg stands or swings, over the samples of both sides, shape (N,) each."""

    inertia: Array  # diagonal of M_mod [kg m^2]
    acceleration: Array  # error of the backward difference [rad/s^2]
    own: Array  # friction error predicted from this by the diagonal of M_mod [N m]
    whole: Array  # friction error predicted by the joint's entire row of M_mod [N m]
    error: Array  # error of the estimated friction [N m]

    def numbers(self) -> dict[str, float]:
        return {"inertia": float(np.mean(self.inertia))} | {
            name: rms(getattr(self, name)) for name in ("acceleration", "own", "whole", "error")
        }


def _legs(walk: Simulated) -> dict[tuple[str, str], _Leg]:
    """Compute the friction errors from backward differences, by joint and phase of its leg."""
    exact, late = (estimate(walk, Settings(filter=each, standing_legs=True)) for each in (EXACT, BACKWARD))
    _, ours, theirs = np.intersect1d(exact.samples.time, late.samples.time, return_indices=True)
    ours, theirs = ours[::STRIDE], theirs[::STRIDE]
    rows = np.searchsorted(walk.log.time, exact.samples.time[ours] - exact.samples.period / 2)
    change = late.samples.acceleration[theirs] - exact.samples.acceleration[ours]
    parts: dict[tuple[str, str], list[_Leg]] = {(joint, phase): [] for joint in JOINTS for phase in ("stance", "swing")}
    for foot in walk.robot.contacts:
        here = exact.standing_on(foot)[ours]
        inertia = _controlled(walk, joint_inertia(walk.robot.rooted_at(foot), walk.log.position[rows[here]]))
        whole = -np.einsum("tij,tj->ti", inertia, change[here])
        for side in SIDES:
            for joint in JOINTS:
                k = exact.column(f"{side}_{joint}")
                own = inertia[:, k, k]
                part = _Leg(own, change[here, k], -own * change[here, k], whole[:, k], late.error[theirs[here], k])
                parts[joint, "stance" if foot.startswith(side) else "swing"].append(part)
    names = _Leg.__dataclass_fields__
    return {key: _Leg(*(np.concatenate([getattr(p, n) for p in each]) for n in names)) for key, each in parts.items()}


def _controlled(walk: Simulated, matrix: Array) -> Array:
    """Select the rows and columns of the torque-controlled joints from matrices, shape (T, k, k)."""
    known = walk.robot.torque_controlled
    return np.asarray(matrix[:, known[:, None], known])


def _ranks(walk: Simulated) -> dict[str, dict[str, float]]:
    """Compute the ranks of M_mod^-1 and the condition numbers of A and M_mod^-1, by the number of standing feet."""
    log = walk.log
    assert log.contact is not None
    assert log.velocity is not None
    assert log.acceleration is not None
    state = State(log.position, log.velocity, log.acceleration)
    found: dict[str, dict[str, float]] = {}
    for count in (1, 2):
        rows: NDArray[np.int64] = np.flatnonzero(log.contact.sum(axis=1) == count)[:: 4 * STRIDE]
        ranks, conditions = [], []
        for k in rows:
            feet = tuple(foot for foot, stands in zip(log.foot_names, log.contact[k], strict=True) if stands)
            sample = constrained_sample(walk.robot, feet, state, log.torque, int(k))
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
    inertias, errors = [], []
    for joint, row in numbers["joints"].items():
        name, phases = joint.replace("_", " "), (row["stance"], row["swing"])
        sizes = (*(phase["inertia"] for phase in phases), row["inertia_ratio"], row["largest_ratio"])
        inertias.append((name, *(short(value, 3) for value in sizes)))
        errors.append((name, *(f"{phase[key]:.2g}" for key in ERRORS for phase in phases)))
    ranks = [
        (
            f"{'one foot' if count == '1' else 'two feet'}",
            row["joints"],
            row["lowest_rank"],
            row["highest_rank"],
            f"{row['largest_condition_of_A']:.2g}",
        )
        for count, row in numbers["ranks"].items()
    ]
    ratios = {joint: row["inertia_ratio"] for joint, row in numbers["joints"].items()}
    return {
        "inertias": markdown_table(("joint", "stands [kg m²]", "swings [kg m²]", "ratio", "largest ratio"), inertias),
        "errors": markdown_table(
            ("joint", *(f"{label}, {phase}" for label in ERRORS.values() for phase in ("stands", "swings"))), errors
        ),
        "ranks": markdown_table(
            ("standing on", "joints", "lowest rank", "highest rank", "largest condition of A"), ranks
        ),
        "knee": f"{ratios['knee']:.0f}",
        "knee-diagonal": f"{numbers['joints']['knee']['stance']['own']:.2g} N m",
        "knee-error": f"{numbers['joints']['knee']['stance']['error']:.2g} N m",
        "rank-two-feet": f"{numbers['ranks']['2']['highest_rank']}",
        "condition": short(max(row["largest_condition_of_A"] for row in numbers["ranks"].values())),
        "most": f"{short(max(ratios.values()))} ({max(ratios, key=ratios.__getitem__).replace('_', ' ')})",
        "least": f"{min(ratios.values()):.0f} ({min(ratios, key=ratios.__getitem__).replace('_', ' ')})",
    }
