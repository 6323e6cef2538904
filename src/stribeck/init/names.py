"""Matching of joints and feet in a log with the model, by name."""

import re
from collections.abc import Sequence
from difflib import SequenceMatcher

import numpy as np
from scipy.optimize import linear_sum_assignment

EMPTY = {"joint", "j", "jnt", "link", "motor", "mot", "act", "actuator", "op", "pos", "position", "q", "tau", "torque"}
EMPTY |= {"encoder", "encoders", "effort", "moment", "current", "actual", "meas", "ist", "deg", "rad", "nm", "ma"}
EMPTY |= {"observation", "present", "state", "states", "feedback", "velocity", "vel", "speed"}
"""Words that do not help to identify a joint."""
MEANINGS = {
    **dict.fromkeys(("l", "left"), ("left",)),
    **dict.fromkeys(("r", "right"), ("right",)),
    **dict.fromkeys(("f", "front", "fore"), ("front",)),
    **dict.fromkeys(("h", "hind", "rear", "back"), ("rear",)),
    **dict.fromkeys(("lf", "fl"), ("left", "front")),
    **dict.fromkeys(("rf", "fr"), ("right", "front")),
    **dict.fromkeys(("lh", "hl", "rl", "bl"), ("left", "rear")),
    **dict.fromkeys(("rh", "hr", "rr", "br"), ("right", "rear")),
    **dict.fromkeys(("haa", "abad", "abduction"), ("hip", "roll")),
    **dict.fromkeys(("hfe", "thigh"), ("hip", "pitch")),
    **dict.fromkeys(("kfe", "calf", "shank"), ("knee",)),
}
"""Meanings of words for joints and legs."""


def words(name: str) -> list[str]:
    """Split a name into words and numbers, with sides and legs normalized."""
    found = [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)]
    meant = [word for part in found for word in MEANINGS.get(part, (part,))]
    return [word for word in meant if word not in EMPTY] or meant


def likeness(one: str, other: str) -> float:
    """Compute the similarity of two names, from 0 to 1; 0 if their sides or numbers differ."""
    a, b = words(one), words(other)
    numbers = [{int(word) for word in each if word.isdigit()} for each in (a, b)]
    if any(set(a) & side != set(b) & side for side in ({"left", "right"}, {"front", "rear"})) or (
        all(numbers) and numbers[0] != numbers[1]
    ):
        return 0.0
    shared = len(set(a) & set(b)) / len(set(a) | set(b))
    return 0.5 * shared + 0.5 * SequenceMatcher(None, " ".join(sorted(a)), " ".join(sorted(b))).ratio()


def match(of_log: Sequence[str], of_model: Sequence[str]) -> dict[str, str]:
    """Match each name of a log with the same or a clearly similar name of the model; others are omitted."""
    pairs = {name: name for name in of_log if name in of_model}
    log = [name for name in of_log if name not in pairs]
    model = [name for name in of_model if name not in pairs]
    if log and model:
        like = np.array([[likeness(one, other) for other in model] for one in log])
        for row, column in zip(*linear_sum_assignment(-like), strict=True):
            others = np.append(np.delete(like[row], column), np.delete(like[:, column], row))
            if like[row, column] >= max(0.55, 0.05 + float(others.max(initial=0.0))):
                pairs[log[row]] = model[column]
    return pairs
