"""Names of mirrored joints."""

import re
from collections.abc import Iterable

RIGHT = {"left": "right", "l": "r", "lf": "rf", "lh": "rh", "fl": "fr", "rl": "rr", "hl": "hr"}
"""Words for left -> words for right in joint names; two letters name a leg, with fore (f), hind (h) or rear (r)."""

PARTS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[^A-Za-z]+")
"""Pattern of the words of a name: `LHipPitch` is L, Hip, Pitch; `leg_left_1_joint` is leg, _, left, _1_, joint."""


def mirror_name(name: str, names: Iterable[str]) -> str | None:
    """Find the partner of a joint among `names` by exchanging left and right; None without a partner.

    >>> mirror_name("leg_left_1_joint", ["leg_left_1_joint", "leg_right_1_joint"])
    'leg_right_1_joint'
    >>> mirror_name("FL_hip_joint", ["FL_hip_joint", "FR_hip_joint", "RL_hip_joint"])
    'FR_hip_joint'
    """
    known = set(names)
    for partner in _mirrored(name):
        if partner in known and partner != name:
            return partner
    return None


def mirrored_pairs(names: Iterable[str]) -> list[tuple[str, str]]:
    """List the pairs (left, right) among `names`, in the order of their first joint."""
    listed = list(names)
    pairs, seen = [], set()
    for name in listed:
        partner = mirror_name(name, listed)
        if partner is None or name in seen:
            continue
        seen |= {name, partner}
        pairs.append((name, partner) if _is_left(name, partner) else (partner, name))
    return pairs


def _mirrored(name: str) -> list[str]:
    """List the names with one word exchanged, longest words first, then the name with all words exchanged."""
    parts = PARTS.findall(name)
    swapped = {index: other for index, part in enumerate(parts) if (other := _other_side(part))}
    by_length = sorted(swapped, key=lambda index: -len(parts[index]))
    single = ["".join([*parts[:index], swapped[index], *parts[index + 1 :]]) for index in by_length]
    everything = "".join(swapped.get(index, part) for index, part in enumerate(parts))
    return [*single, everything]


def _other_side(word: str) -> str | None:
    """Translate a word to the other side, in the same case; None for words without a side."""
    left = {right: left for left, right in RIGHT.items()}
    other = (RIGHT | left).get(word.lower())
    if other is None or word.islower():
        return other
    return other.upper() if word.isupper() else other.capitalize()


def _is_left(name: str, partner: str) -> bool:
    """Check that the first word in which two names differ means left."""
    words = zip(PARTS.findall(name), PARTS.findall(partner), strict=True)
    word = next(a.lower() for a, b in words if a != b)
    return word in RIGHT
