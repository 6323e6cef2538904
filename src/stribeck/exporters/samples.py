"""Draws from the joint distribution of a result's errors: models that are consistent with the log, and their ranges.

Each range contains 95 % of the draws. Coulomb and viscous friction compensate for each other, so that independent draws
from the ranges vary more than the log allows.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.base.typing import Array
from stribeck.exporters.beyond import top_speed
from stribeck.exporters.forms import Form
from stribeck.exporters.joints import WrittenJoint, joint_terms
from stribeck.friction import get_law
from stribeck.friction.terms import BEYOND_VELOCITY
from stribeck.result import BODY_COORDINATES, BodyCorrection, Corrections, JointResult, ParameterEstimate, Result
from stribeck.robot.inertial_parameters import inertia_of_shape, pseudo_inertia, shape_coordinates

LARGEST = 3.0
"""Largest change of a scale's logarithm [1]; prevents absurd values where the log does not determine a scale."""


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

    Friction, rotor inertias and bodies are drawn from the joint covariance of their errors, within their bounds; scales
    are drawn in their logarithm. Friction also varies by a factor per joint, as between logs of one robot. Bodies are
    drawn in the logarithm of mass, center and shape, so that each stays physically possible. For files of earlier
    versions, joints and bodies are independent, shapes are constant, and logs do not differ.
    """
    generator = np.random.default_rng(seed)
    labels, root = _root(result)
    for _ in range(count):
        off = dict(zip(labels, (root @ generator.standard_normal(len(labels))).tolist(), strict=True))
        factors = generator.standard_normal(len(result.joints))
        joints = {
            name: _drawn_joint(name, joint, off, factor)
            for (name, joint), factor in zip(result.joints.items(), factors.tolist(), strict=True)
        }
        corrections = result.corrections
        if corrections:
            bodies = {name: _drawn_body(name, body, off) for name, body in corrections.bodies.items()}
            corrections = replace(corrections, bodies=bodies)
        yield replace(result, joints=joints, corrections=corrections)


def _root(result: Result) -> tuple[list[str], Array]:
    """List the labels of all parameters and body coordinates, and compute a root of their errors' correlation.

    The rows of the root have length one. Results are rounded and omit small correlations, so the nearest root is used.
    """
    corrections = result.corrections or Corrections(chi_square=0.0)
    labels = [f"{name}.{parameter}" for name, joint in result.joints.items() for parameter in joint.parameters]
    labels += [f"{name}.{coordinate}" for name in corrections.bodies for coordinate in BODY_COORDINATES]
    place = {label: k for k, label in enumerate(labels)}
    correlation = np.eye(len(labels))
    for name, joint in result.joints.items():
        if (of_joint := joint.correlation_matrix()) is not None:
            own = [place[f"{name}.{parameter}"] for parameter in joint.parameters]
            correlation[np.ix_(own, own)] = np.nan_to_num(of_joint)
    for one, other, value in corrections.correlations:
        if one in place and other in place:
            correlation[place[one], place[other]] = correlation[place[other], place[one]] = value
    values, vectors = np.linalg.eigh(np.clip(correlation, -1.0, 1.0))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return labels, root / np.maximum(np.linalg.norm(root, axis=1, keepdims=True), 1e-12)


def _drawn_joint(joint_name: str, joint: JointResult, off: Mapping[str, float], between_logs: float) -> JointResult:
    known = {parameter.name: parameter for parameter in (*get_law(joint.law).parameters, *BEYOND_VELOCITY)}
    parameters: dict[str, ParameterEstimate] = {}
    for name, found in joint.parameters.items():
        change = off[f"{joint_name}.{name}"]
        error = found.standard_error if np.isfinite(found.standard_error) else 0.0
        own = known.get(name)
        if own is not None and own.logarithmic and found.value > 0:
            value = found.value * float(np.exp(np.clip(change * error / found.value, -LARGEST, LARGEST)))
        else:
            value = found.value + change * error
        value *= max(1 + between_logs * joint.between_logs(name), 0.0)
        low, high = (own.lower, own.upper) if own else (0.0, np.inf)  # a rotor inertia
        parameters[name] = replace(found, value=float(np.clip(value, low, high)))
    return replace(joint, parameters=parameters)


def _drawn_body(name: str, body: BodyCorrection, off: Mapping[str, float]) -> BodyCorrection:
    """Draw mass, center and shape of a body; its inertia about the center is proportional to the mass."""
    (before, mass), (lever, centre), (was, inertia) = body.mass, body.centre_of_mass, body.inertia
    normal = np.array([off[f"{name}.{coordinate}"] for coordinate in BODY_COORDINATES])
    share = float(np.exp(np.clip(normal[0] * body.mass_error / mass, -LARGEST, LARGEST))) if mass > 0 else 1.0
    moved = np.array(centre) + normal[1:4] * np.array(body.centre_of_mass_error)
    about_centre = np.array(inertia)
    if body.shape_error is not None and mass > 0:
        shape = shape_coordinates(pseudo_inertia(np.array([mass, 0.0, 0.0, 0.0, *inertia])))
        if np.isfinite(shape).all():  # physically possible
            change = normal[4:] * np.array(body.shape_error)
            change[:3] = np.clip(change[:3], -LARGEST, LARGEST)
            with np.errstate(over="ignore"):  # implausible values are refused on writing
                about_centre = inertia_of_shape(mass, shape + change)
    return replace(
        body,
        mass=(before, share * mass),
        centre_of_mass=(lever, tuple(moved.tolist())),
        inertia=(was, tuple((share * about_centre).tolist())),
    )


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


def _ranges(joint: JointResult, found: WrittenJoint, draws: Sequence[WrittenJoint], form: Form) -> JointRanges:
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
    joint: JointResult, found: WrittenJoint, draws: Mapping[str, Array], words: Mapping[str, str]
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
