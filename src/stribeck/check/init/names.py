"""Words in names, and matching of joints and feet in a log with the model by these words."""

import re
import tomllib
from collections.abc import Sequence
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

WORDS: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
"""Words in names of joints and channels, with their meanings."""
QUESTIONS: dict[str, str] = WORDS["questions"]
"""Long questions to the user."""
MEANINGS = {word: meaning.split() for meaning, synonyms in WORDS["joints"]["meanings"].items() for word in synonyms}
"""Meanings of words for joints and legs."""


def split(name: str) -> list[str]:
    """Split a name into words in lower case, and numbers."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)]


def words(name: str) -> list[str]:
    """Split a name into words and numbers, with sides and legs normalized."""
    meant = [word for part in split(name) for word in MEANINGS.get(part, [part])]
    return [word for word in meant if word not in WORDS["joints"]["empty"]] or meant


def likeness(name: str, other: str) -> float:
    """Compute the similarity of two names, from 0 to 1; 0 if their sides or numbers differ."""
    a, b = words(name), words(other)
    numbers = [{int(word) for word in parts if word.isdigit()} for parts in (a, b)]
    if (set(a) ^ set(b)) & {"left", "right", "front", "rear"} or (all(numbers) and numbers[0] != numbers[1]):
        return 0.0
    shared = len(set(a) & set(b)) / len(set(a) | set(b))
    return 0.5 * shared + 0.5 * SequenceMatcher(None, " ".join(sorted(a)), " ".join(sorted(b))).ratio()


def is_prefixed(joint: str, label: str) -> bool:
    """Check that a joint has the name of a label in a namespace, such as `left_joint1` of `left_arm/joint1`."""
    space, _, name = label.rpartition("/")
    return joint.endswith(name) and set(words(joint.removesuffix(name))) <= set(words(space))


def match(of_log: Sequence[str], of_model: Sequence[str]) -> dict[str, str]:
    """Match each name of a log with the same or a clearly similar name of the model; others are omitted."""
    pairs = {name: name for name in of_log if name in of_model}
    log = [name for name in of_log if name not in pairs]
    model = [name for name in of_model if name not in pairs]
    if log and model:
        like = np.array([[likeness(label, other) for other in model] for label in log])
        for row, column in zip(*linear_sum_assignment(-like), strict=True):
            others = np.append(np.delete(like[row], column), np.delete(like[:, column], row))
            if like[row, column] >= max(0.55, 0.05 + float(others.max(initial=0.0))):
                pairs[log[row]] = model[column]
    return pairs
