"""Models that are consistent with a result's posterior: the most probable one, draws, and their ranges.

A robot model has no torque offsets. The offset of a sensor is not part of the robot. Commands have no sensor: their
offsets are errors of the model, for example of a center of mass. Friction and inertias are then conditioned on zero
offsets. Inertias are written if they lower the torque error of held-out parts of the logs.

Each range contains 95 % of the draws. Coulomb and viscous friction compensate for each other, so that independent draws
from the ranges vary more than the log allows.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.app.exporters.beyond import top_speed
from stribeck.app.exporters.forms import Form
from stribeck.app.exporters.joints import Names, WrittenJoint, joint_terms
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.friction.terms import BEYOND_VELOCITY
from stribeck.core.result import BODY_COORDINATES, BodyCorrection, JointResult, Result
from stribeck.core.result.posterior import coordinates_of
from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import inertia_of_shape

LARGEST = 3.0
"""Largest change of a scale's logarithm [1]; prevents absurd values where the log does not determine a scale."""


def moved(result: Result, change: Mapping[str, float]) -> Result:
    """Move the coordinates of a result's posterior.

    Parameters are clipped at their bounds, and scales change in their logarithm. Bodies change in mass, center and
    shape, so that each stays physically possible.

    Parameters
    ----------
    change
        Changes by the name of the coordinate.
    """
    corrections = result.corrections
    if corrections:
        bodies = {name: _moved_body(name, body, change) for name, body in corrections.bodies.items()}
        corrections = replace(corrections, bodies=bodies)
    joints = {name: _moved_joint(name, joint, change) for name, joint in result.joints.items()}
    return replace(result, joints=joints, corrections=corrections)


def _moved_joint(joint_name: str, joint: JointResult, change: Mapping[str, float]) -> JointResult:
    known = {parameter.name: parameter for parameter in (*get_law(joint.law).parameters, *BEYOND_VELOCITY)}
    values = {}
    for name, estimate in joint.parameters.items():
        parameter, step = known.get(name), change[f"{joint_name}.{name}"]
        value = estimate.value + step
        if parameter is not None and parameter.logarithmic and estimate.value > 0:
            value = estimate.value * float(np.exp(np.clip(step / estimate.value, -LARGEST, LARGEST)))
        low, high = (parameter.lower, parameter.upper) if parameter else (0.0, np.inf)  # a rotor inertia
        values[name] = float(np.clip(value, low, high))
    return joint.with_values(values)


def _moved_body(name: str, body: BodyCorrection, change: Mapping[str, float]) -> BodyCorrection:
    """Move mass, center and shape of a body; its inertia about the center is proportional to the mass."""
    step = np.array([change[f"{name}.{coordinate}"] for coordinate in BODY_COORDINATES])
    (before, mass), (lever, centre), (was, inertia) = body.mass, body.centre_of_mass, body.inertia
    share = float(np.exp(np.clip(step[0], -LARGEST, LARGEST)))
    about_centre = np.array(inertia)
    if np.any(step[4:]):
        step[4:7] = np.clip(step[4:7], -LARGEST, LARGEST)
        with np.errstate(over="ignore"):  # implausible values are refused on writing
            about_centre = inertia_of_shape(mass, np.array(coordinates_of(body)[4:]) + step[4:])
    return replace(
        body,
        mass=(before, share * mass),
        centre_of_mass=(lever, tuple((np.array(centre) + step[1:4]).tolist())),
        inertia=(was, tuple((share * about_centre).tolist())),
    )


def inertias_pay(result: Result) -> tuple[bool, str]:
    """Check whether estimated inertias lower the held-out torque error by 2 % or more, by one standard error.

    With exact models they lower it by up to 1 %. The clause states their effect.
    """
    change = result.corrections and result.corrections.held_out_change
    if not change:
        return False, "their effect on the torque error is unknown"
    mean, error = change
    about = f"the estimates change the held-out torque error by {100 * np.expm1(mean):+.0f} % (± {100 * error:.0f} %)"
    return bool(mean + error < np.log(1 - 0.02)), about


def projected(result: Result, robot: Robot) -> Result:
    """Set the offsets of commanded torques to zero, and friction, rotors and inertias to the most probable values."""
    if robot.torque_source != "command":
        return result
    offsets = {
        f"{name}.offset": 0.0
        for name, joint in result.joints.items()
        if "offset" in joint.parameters and joint.torque_unit is None
    }
    if not offsets:
        return result
    mode = moved(result, result.posterior.shifts(offsets))
    exact = {name: joint.with_values({"offset": 0.0}) for name, joint in mode.joints.items() if not joint.torque_unit}
    return replace(mode, joints={**mode.joints, **exact})


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


def joint_ranges(result: Result, form: Form, joints: Names, include_weak: bool) -> dict[str, JointRanges]:
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
