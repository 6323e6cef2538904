"""Ranges of friction parameters for domain randomization.

Each range contains 95 % of the draws of `stribeck.exporters.samples`. Coulomb and viscous friction compensate for each
other, so that independent draws from the ranges vary more than the log allows.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.base.typing import Array
from stribeck.exporters.beyond import top_speed
from stribeck.exporters.forms import Form
from stribeck.exporters.joints import JointTerms, joint_terms
from stribeck.exporters.samples import drawn
from stribeck.result import JointResult, Result

Range = tuple[float, float]
"""Lowest and highest value."""


@dataclass(frozen=True, kw_only=True)
class JointRanges:
    """Ranges of a joint.

    Attributes
    ----------
    numbers, units
        Ranges and units by the name in the target format.
    friction
        Range of the whole friction divided by its estimate [1], from rest to top speed; None without friction.
    weak
        Whether the friction is weak.
    """

    numbers: dict[str, Range]
    units: dict[str, str]
    friction: Range | None
    weak: bool

    def __str__(self) -> str:
        """Format the ranges as a sentence."""
        spans = [
            f"{word} {low:.3g} to {high:.3g}" + f" {self.units[word]}" * (self.units[word] != "1")
            for word, (low, high) in self.numbers.items()
        ]
        return ", ".join(spans) + "; wide, as its friction is weak" * self.weak


def joint_ranges(
    result: Result, form: Form, joints: Collection[str] | None = None, include_weak: bool = False
) -> dict[str, JointRanges]:
    """Compute the ranges of the terms that `stribeck.exporters.joints.joint_terms` selects for each joint.

    Raises
    ------
    SettingsError
        If the result lacks one of `joints`.
    """
    found = joint_terms(result, form, joints, include_weak)
    draws = [joint_terms(each, form, found, include_weak) for each in drawn(result, 200)]
    return {
        name: _ranges(result.joints[name], terms, [each[name] for each in draws], form) for name, terms in found.items()
    }


def _ranges(joint: JointResult, found: JointTerms, draws: Sequence[JointTerms], form: Form) -> JointRanges:
    values = {word: np.array([each.stated[word][0] for each in draws]) for word in found.stated}
    numbers = {word: _range(own) for word, own in values.items()}
    if joint.verdict == "no friction" and form.words.get("coulomb") in numbers:  # up to the bound
        most = max((point.interval_95[1] for point in joint.curve), default=0.0)
        numbers |= {form.words[name]: (0.0, most) for name in ("coulomb", "static") if name in form.words}
    return JointRanges(
        numbers=numbers,
        units={word: unit for word, (_, unit) in found.stated.items()},
        friction=_of_friction(joint, found, values, form.words),
        weak=joint.verdict == "weak",
    )


def _of_friction(
    joint: JointResult, found: JointTerms, draws: Mapping[str, Array], words: Mapping[str, str]
) -> Range | None:
    """Compute the range of friction divided by its estimate: the widest of rest, slow motion and top speed."""

    def number(name: str) -> tuple[float, Array | float]:
        word = words.get(name, "")
        return found.stated[word][0] if word in draws else 0.0, draws.get(word, 0.0)

    viscous = number("viscous")
    shares = []
    for name, speed in (("static", 0.0), ("coulomb", 0.0), ("coulomb", top_speed(joint))):
        whole, of_draws = (dry + speed * slope for dry, slope in zip(number(name), viscous, strict=True))
        if whole > 0:
            shares.append(_range(np.asarray(of_draws / whole)))
    return (min(low for low, _ in shares), max(high for _, high in shares)) if shares else None


def _range(values: Array) -> Range:
    low, high = np.quantile(values, (0.025, 0.975))
    return float(f"{low:.4g}"), float(f"{high:.4g}")
