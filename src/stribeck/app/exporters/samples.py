"""Draws from the joint distribution of a result's errors: models that are consistent with the log, and their ranges.

Each range contains 95 % of the draws. Coulomb and viscous friction compensate for each other, so that independent draws
from the ranges vary more than the log allows.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.app.exporters.beyond import top_speed
from stribeck.app.exporters.forms import Form
from stribeck.app.exporters.joints import WrittenJoint, joint_terms
from stribeck.app.exporters.moved import moved
from stribeck.core.base.typing import Array
from stribeck.core.result import JointResult, Result

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


def drawn(result: Result, count: int, seed: int = 0) -> Iterator[Result]:
    """Yield results with parameters and inertias drawn from their uncertainty.

    Friction, rotor inertias and bodies are drawn from the result's posterior. Friction also varies by a factor per
    joint, as between logs of one robot.
    """
    generator, posterior = np.random.default_rng(seed), result.posterior
    for _ in range(count):
        change = posterior.root @ generator.standard_normal(len(posterior.names))
        factors = 1 + generator.standard_normal(len(result.joints)) * [
            max((point.between_logs for point in joint.curve), default=0.0) for joint in result.joints.values()
        ]
        draw = moved(result, dict(zip(posterior.names, change.tolist(), strict=True)))
        joints = {
            name: _scaled(joint, max(factor, 0.0))
            for (name, joint), factor in zip(draw.joints.items(), factors.tolist(), strict=True)
        }
        yield replace(draw, joints=joints)


def _scaled(joint: JointResult, factor: float) -> JointResult:
    """Multiply the friction of a joint; offset, scales and rotor inertia stay."""
    friction = (key for key, estimate in joint.parameters.items() if key != "offset" and estimate.unit.startswith("N"))
    return joint.with_values({name: factor * joint.values[name] for name in friction})


def joint_ranges(
    result: Result, form: Form, joints: Collection[str] | None = None, include_weak: bool = False
) -> dict[str, JointRanges]:
    """Compute the ranges of the terms that `stribeck.app.exporters.joints.joint_terms` selects for each joint.

    Raises
    ------
    SettingsError
        If the result lacks one of `joints`.
    """
    terms = joint_terms(result, form, joints, include_weak)
    draws = [joint_terms(draw, form, terms, include_weak) for draw in drawn(result, 400)]
    return {
        name: _ranges(result.joints[name], joint, [draw[name] for draw in draws], form) for name, joint in terms.items()
    }


def _ranges(joint: JointResult, terms: WrittenJoint, draws: Sequence[WrittenJoint], form: Form) -> JointRanges:
    values = {word: np.array([draw.stated[word][0] for draw in draws]) for word in terms.stated}
    numbers = {word: _range(sample) for word, sample in values.items()}
    if joint.verdict == "no friction" and form.words.get("coulomb") in numbers:  # up to the bound
        most = max((point.interval_95[1] for point in joint.curve), default=0.0)
        numbers |= {form.words[name]: (0.0, most) for name in ("coulomb", "static") if name in form.words}
    return JointRanges(
        numbers=numbers,
        units={word: unit for word, (_, unit) in terms.stated.items()},
        friction=_of_friction(joint, terms, values, form.words),
        weak=joint.verdict == "weak",
    )


def _of_friction(
    joint: JointResult, terms: WrittenJoint, draws: Mapping[str, Array], words: Mapping[str, str]
) -> Range | None:
    """Compute the range of friction divided by its estimate: the widest of rest, slow motion and top speed."""

    def number(name: str) -> tuple[float, Array | float]:
        word = words.get(name, "")
        return terms.stated[word][0] if word in draws else 0.0, draws.get(word, 0.0)

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
