"""Friction of each joint in the terms of a target format, the parts that it cannot store, and a table of both."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from stribeck.app.exporters.beyond import Beyond, friction_beyond, top_speed
from stribeck.app.exporters.forms import ROUNDING, Form, Nearest, nearest
from stribeck.core.base.text_table import aligned
from stribeck.core.errors import RobotFileError
from stribeck.core.friction import get_law
from stribeck.core.friction.terms import parameters_over
from stribeck.core.result import JointResult, Result
from stribeck.core.result.law_values import law_values
from stribeck.core.result.tables import bound_text
from stribeck.core.robot import Robot
from stribeck.design import read_friction

BRISTLES = {"bristle_travel": "bristle_stiffness", "bristle_damping": "bristle_damping"}
"""Number of a friction model by the LuGre parameter that it represents."""

UNSTEADY = ("armature", *BRISTLES, *parameters_over("travel", "time"))
"""Parameters beyond steady friction: rotor inertia, presliding, bristles and drift."""

FORMLESS = ("offset", *UNSTEADY, *parameters_over("temperature"))
"""Parameters that no friction model of a target contains."""

LEGEND = "Coulomb friction at mean load + viscous friction times the speed v, in N m and rad/s, or N and m/s:"

Quantity = tuple[float, str]
"""Type of a value with its unit."""

Names = Collection[str] | None
"""Names of joints to export; all if None."""


@dataclass(frozen=True, kw_only=True)
class WrittenJoint:
    """The friction and rotor inertia of a joint in a target's file.

    Attributes
    ----------
    stated
        Quantities by the name in the target format.
    projected
        Parameters missing in the target's friction model; its numbers are fitted to the friction with them.
    fit, units
        Fit of the target's friction model, and the units of velocity and friction; None and "" without a fit.
    left_out
        Parameters that the target cannot store.
    note
        Note on a joint without friction.
    beyond
        Friction beyond the log's speeds; None if the log covers them or no friction is stated.
    plain
        Stated Coulomb and viscous friction, and whether there is more; None if no friction is stated, or all of it.
    """

    stated: dict[str, Quantity]
    projected: dict[str, Quantity] = field(default_factory=dict)
    fit: Nearest | None = None
    units: tuple[str, str] = ("", "")
    left_out: dict[str, Quantity] = field(default_factory=dict)
    note: str = ""
    beyond: Beyond | None = None
    plain: tuple[float, float, bool] | None = None

    def __str__(self) -> str:
        """Describe the stated quantities, the approximation error and the parameters left out."""
        text = listed(self.stated) + f" ({self.note})" * bool(self.note)
        if self.projected:
            error = ""
            if fit := self.fit:
                share = f"{100 * fit.share:.0f}" if fit.share > 0.1 else f"{100 * fit.share:.1f}"
                error = f", error {fit.remains:.2g} {self.units[1]}, {share} %"
                error += f", at most {self.difference}" * bool(self.difference)
            text += f" (approximates {listed(self.projected)}{error})"
        if self.beyond:
            text += f". {self.beyond}"
        return text + (f". Cannot store: {listed(self.left_out)}" if self.left_out else "")

    @property
    def numbers(self) -> dict[str, float]:
        """Stated values by the name in the target format."""
        return {word: value for word, (value, _) in self.stated.items()}

    @property
    def difference(self) -> str:
        """Largest difference from the identified curve, with its speed; "" without a difference."""
        if self.fit is None or self.fit.largest[0] <= 10 * ROUNDING * self.fit.of:
            return ""
        return f"{self.fit.largest[0]:.2g} {self.units[1]} at {self.fit.largest[1]:.2g} {self.units[0]}"


def joint_terms(
    result: Result, form: Form | None, joints: Names = None, include_weak: bool = False, *, any_unit: bool = False
) -> dict[str, WrittenJoint]:
    """Select the exported terms of each joint.

    All of a joint's friction is stated if its curve, or its Coulomb or viscous friction in any direction, is
    identified, because Coulomb and viscous friction compensate for each other's errors. It is zero for the verdict
    "no friction". A rotor inertia is stated if its interval excludes zero, whatever the friction's verdict, because a
    model has a guess or none.

    Parameters
    ----------
    result
        The result of an identification.
    form
        Friction model of the target; None if the target stores all steady friction.
    joints
        Joints to select; all if None.
    include_weak
        Whether to state weak friction and rotor inertias, too.
    any_unit
        Whether the target can state units other than N m and N, for joints with an unknown torque constant or kp.

    Raises
    ------
    UnknownJointError
        If the result lacks one of `joints`.
    """
    chosen = {name: result[name] for name in (result.joints if joints is None else joints)}
    good = ("identified", "weak") if include_weak else ("identified",)
    known = {name: joint for name, joint in result.joints.items() if _has_friction(joint, ("identified", "weak"))}
    beyond = friction_beyond(known)
    terms = {
        name: _terms(joint, form, good, beyond.get(name))
        for name, joint in result.joints.items()
        if name in chosen and (any_unit or joint.torque_unit is None)
    }
    return {name: joint for name, joint in terms.items() if joint.stated}


def coupling_terms(
    result: Result, robot: Robot, form: Form, joints: Names, include_weak: bool
) -> dict[str, WrittenJoint]:
    """Select the terms of couplings whose joints are all exported, and zeros for joints without own friction."""
    terms = joint_terms(
        replace(result, joints=dict[str, JointResult](result.couplings), couplings={}), form, None, include_weak
    )
    exported = set(result.joints if joints is None else joints)
    lost = {name for name, parts in robot.couplings.items() if name not in terms or not exported.issuperset(parts)}
    needed = {joint: {name for name, parts in robot.couplings.items() if joint in parts} for joint in robot.bare}
    lost |= {name for together in needed.values() if together & lost for name in together}
    bare = {joint: result.joints[joint] for joint, together in needed.items() if not together & lost}
    words = {name: word for name, word in form.words.items() if name != "armature"}
    zeros = {
        name: {word: (0.0, _units(joint)[term]) for term, word in words.items()} for name, joint in sorted(bare.items())
    }
    no_friction = {name: WrittenJoint(stated=zero, note=bare[name].reason) for name, zero in zeros.items()}
    return no_friction | {name: term for name, term in terms.items() if name not in lost}


def _terms(joint: JointResult, form: Form | None, good: Collection[str], beyond: Beyond | None) -> WrittenJoint:
    estimates = joint.parameters
    quantities = {name: (estimate.value, estimate.unit) for name, estimate in estimates.items()}
    if form is None:
        left_out = {name: pair for name, pair in quantities.items() if name in UNSTEADY}
        if joint.verdict == "no friction":
            return WrittenJoint(stated={"friction": (0.0, joint.units()[1])}, left_out=left_out, note=joint.reason)
        steady = {name: pair for name, pair in quantities.items() if name not in UNSTEADY}
        return WrittenJoint(stated=steady if _has_friction(joint, good) else {}, left_out=left_out, beyond=beyond)
    words, rotor, units = form.words, {}, _units(joint)
    inertia = estimates.get("armature") if "armature" in words else None
    if inertia and (inertia.verdict in good or inertia.interval_95[0] > 0):
        rotor[words["armature"]] = _rounded(inertia.value, inertia.standard_error), "kg m^2"
    formless = set(FORMLESS) - ({"armature"} & words.keys())
    left_out = {name: pair for name, pair in quantities.items() if name in formless and pair[0]}
    if joint.verdict == "no friction" and joint.curve:
        zero = {words[name]: (0.0, units[name]) for name in words if name in units and name != "stribeck_velocity"}
        return WrittenJoint(stated=zero | rotor, left_out=left_out, note=joint.reason, plain=(0.0, 0.0, False))
    if not _has_friction(joint, good):
        return WrittenJoint(stated=rotor, left_out=left_out)
    fit, errors = nearest(joint, form, beyond), _errors(joint)
    rounded = {name: _rounded(value, errors.get(name, 0.0)) for name, value in fit.numbers.items()}
    friction = {words[name]: (value, units[name]) for name, value in rounded.items() if name in words}
    return WrittenJoint(
        stated=friction | rotor,
        projected={name: pair for name, pair in quantities.items() if name not in FORMLESS and name not in form.of_law},
        fit=fit,
        units=joint.units(),
        beyond=beyond and replace(beyond, friction=fit.far),
        plain=(rounded.get("coulomb", 0.0), rounded["viscous"], any(map(rounded.get, ("stribeck", "gear_load")))),
        left_out={name: pair for name, pair in left_out.items() if words.get(BRISTLES.get(name, name)) not in friction},
    )


def _has_friction(joint: JointResult, good: Collection[str]) -> bool:
    """Check that a joint has friction with one of the accepted verdicts."""
    names = [name for name in joint.parameters if name.startswith(("coulomb", "viscous"))]
    known = bool(names) and law_values(get_law(joint.law), joint.values) is not None
    return known and (joint.verdict in good or any(joint.parameters[name].verdict in good for name in names))


def _units(joint: JointResult) -> dict[str, str]:
    """Find the units of a friction model's numbers."""
    speed, unit = joint.units()
    length = speed.removesuffix("/s")
    units = dict.fromkeys(("coulomb", "static", "stribeck"), unit) | {"gear_load": "1", "stribeck_velocity": speed}
    units |= dict.fromkeys(("viscous", "bristle_damping"), f"{unit} s/{length}")
    return units | {"bristle_stiffness": f"{unit}/{length}"}


def _errors(joint: JointResult) -> dict[str, float]:
    """Estimate standard errors of a friction model's numbers, from the curve where available."""
    errors = {name: parameter.standard_error for name, parameter in joint.parameters.items()}
    if not joint.curve:
        return errors | {"static": errors.get("coulomb", 0.0)}
    slow, top = joint.curve[0].standard_error, joint.curve[-1].standard_error
    return errors | {"coulomb": slow, "static": slow, "viscous": top / max(top_speed(joint), 1e-9)}


def _rounded(value: float, error: float) -> float:
    """Round a value to two digits of its standard error, or to six digits if that is unknown."""
    if not np.isfinite(error) or error <= 0:
        return float(f"{value:.6g}")
    return round(value, 1 - int(np.floor(np.log10(error))))


def listed(quantities: Mapping[str, Quantity]) -> str:
    """Format quantities as "name value unit", separated by commas."""
    return ", ".join(f"{name} {value:.4g}" + f" {unit}" * (unit != "1") for name, (value, unit) in quantities.items())


def table_of_joints(result: Result, robot: Robot, joints: Mapping[str, WrittenJoint]) -> list[str]:
    """Format one line per joint with Coulomb friction Fc and viscous friction Fv as "Fc + Fv v", and rotor inertia.

    The difference between written and identified friction is the largest from the slow to the top speed of the log,
    at the mean load and over its positions. Empty for targets that store all of the law.
    """
    try:
        stated = read_friction(robot.model_file)[0]
    except RobotFileError:  # no file, or one that has gone
        stated = {}
    model = {name: (own.coulomb, own.viscous, own.rise > 0) for name, own in stated.items()}
    rows = [
        (
            name,
            _sum(model.get(name)),
            _identified(result[name]),
            _sum(terms.plain),
            terms.difference or (_shift(result[name], terms) if terms.plain else "-"),
            next((f"{value:.4g}" for value, unit in terms.stated.values() if unit == "kg m^2"), "-"),
        )
        for name, terms in joints.items()
        if any(each.plain for each in joints.values())
    ]
    head = ("joint", "in the model", "identified", "written", "largest difference", "rotor [kg m^2]")
    return [LEGEND, *aligned([head, *rows])] if rows else []


def _shift(joint: JointResult, terms: WrittenJoint) -> str:
    """State how far the written friction is from the identified curve, where other parameters had to change with it."""
    assert terms.plain is not None
    dry, viscous, _ = terms.plain
    sizes = [(abs(dry + viscous * point.velocity - point.value), point) for point in joint.curve]
    size, point = max(sizes, key=lambda pair: pair[0], default=(0.0, None))
    if point is None or joint.verdict == "no friction" or size < 0.05 * point.half_width:  # rounded numbers
        return "none"
    speed, torque = joint.units()
    return f"{size:.2g} {torque} at {point.velocity:.2g} {speed}"


def _identified(joint: JointResult) -> str:
    """Format identified friction, mean of both directions; "..." stands for terms beyond Coulomb and viscous ones."""
    if joint.verdict == "no friction":
        return bound_text(joint) or "none"
    coefficients = {
        key: [joint.values[key + way] for way in ("", "_positive", "_negative") if key + way in joint.values]
        for key in ("coulomb", "viscous")
    }
    means = [sum(values) / len(values) if values else 0.0 for values in coefficients.values()]
    means[0] += joint.values.get("load", 0.0) * (joint.mean_load or 0.0)
    ways = {f"{key}{way}" for key in coefficients for way in ("", "_positive", "_negative")}
    others = joint.values.keys() - {"slope", *FORMLESS, *ways}
    return _sum((means[0], means[1], bool(others)))


def _sum(friction: tuple[float, float, bool] | None) -> str:
    return f"{friction[0]:.3g} + {friction[1]:.3g} v" + " + ..." * friction[2] if friction else "-"
