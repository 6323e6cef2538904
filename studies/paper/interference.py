"""Fig. 6.5 as a number: the share of one joint's friction that appears in another joint.

All leg joints have friction. The estimate of each joint of the swinging leg is fitted by the truth of all six joints,

    found_i = sum_j G_ij truth_j + constant,

therefore G is the identity matrix if joints do not interfere.
"""

import numpy as np

from stribeck import Settings
from stribeck.base.typing import Array
from studies.markdown import markdown_table, percent
from studies.paper.estimate import estimate
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, LABELS
from studies.paper.walks import get_walk

WALKS = ("legs-contact",)
SWINGS = {"left": "right_foot", "right": "left_foot"}
"""Standing foot while the leg of a side swings."""


def run(quick: bool) -> Numbers:
    found = estimate(get_walk("legs-contact", quick), Settings())
    truths: list[Array] = []
    torques: list[Array] = []
    for side, foot in SWINGS.items():
        rows = found.standing_on(foot)
        columns = [found.column(f"{side}_{joint}") for joint in JOINTS]
        for kept, values in ((truths, found.truth), (torques, found.samples.friction_torque)):
            here = values[rows][:, columns]
            kept.append(here - here.mean(axis=0))
    truth, torque = np.concatenate(truths), np.concatenate(torques)
    gain = np.linalg.lstsq(truth, torque, rcond=None)[0].T
    size = truth.std(axis=0)
    share = gain * size / size[:, None]  # friction variation from joint j in joint i, relative to joint i's
    crossing = np.abs(share - np.diag(np.diag(share)))
    worst = np.unravel_index(np.argmax(crossing), crossing.shape)
    return {
        "share": {joint: dict(zip(JOINTS, row, strict=True)) for joint, row in zip(JOINTS, share, strict=True)},
        "cross_worst": crossing[worst],
        "cross_from": JOINTS[worst[1]],
        "cross_in": JOINTS[worst[0]],
        "cross_mean": crossing.sum() / (crossing.size - len(JOINTS)),
    }


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the matrix of shares and its worst values."""
    shares = zip(LABELS, numbers["share"].values(), strict=True)
    rows = [(label, *(percent(value, 2) for value in row.values())) for label, row in shares]
    return {
        "matrix": markdown_table(("found in", *(f"of {label}" for label in LABELS)), rows),
        "cross": percent(numbers["cross_worst"], 2),
        "cross-mean": percent(numbers["cross_mean"], 2),
        "where": f"{numbers['cross_from']} in {numbers['cross_in']}".replace("_", " "),
    }
