"""What a result says of each joint, in a format's own words, and what the format cannot say."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from stribeck.errors import SettingsError, did_you_mean
from stribeck.export.forms import Form, nearest, top_speed
from stribeck.friction import get_law
from stribeck.friction.terms import PRESLIDING, SLOW
from stribeck.result import JointResult, Result
from stribeck.result.joint import law_values

BRISTLES = {"bristle_travel": "bristle_stiffness", "bristle_damping": "bristle_damping"}
"""Parameter of LuGre -> number of a form that says it."""

ALONE = (
    "offset",
    "armature",
    PRESLIDING.name,
    *BRISTLES,
    *(parameter.name for terms in SLOW.values() for parameter in terms),
)
"""Parameters that no form of friction contains: what pulls by itself, rotors, reversals, what changes slowly."""

WITHOUT_PLACE = ("armature", PRESLIDING.name, *BRISTLES, *(parameter.name for parameter in SLOW["drift"]))
"""Parameters that steady friction has no place for: rotors, reversals, and what changed in the course of a log."""

SIGNIFICANT = 2
"""Digits of a standard error that a number is rounded to [1]."""

Quantity = tuple[float, str]
"""Value and unit."""


@dataclass(frozen=True, kw_only=True)
class JointTerms:
    """What a format says of a joint.

    Attributes
    ----------
    stated
        By the format's own word.
    projected
        Parameters that its form of friction lacks: it is the nearest to the friction with them.
    remains, of
        Root mean square of what it cannot say, and of the friction found; None of a joint whose friction it says not.
    left_out
        Parameters that it has no place for.
    note
        On a joint without friction.
    """

    stated: dict[str, Quantity]
    projected: dict[str, Quantity] = field(default_factory=dict)
    remains: Quantity | None = None
    of: Quantity | None = None
    left_out: dict[str, Quantity] = field(default_factory=dict)
    note: str = ""

    def __str__(self) -> str:
        """Return all of it in words."""
        text = listed(self.stated) + f" ({self.note})" * bool(self.note)
        if self.projected:
            text += f"; the nearest to what was found with {listed(self.projected)}"
            if self.remains is not None:
                share = f"{100 * self.share:.0f}" if self.share > 0.1 else f"{100 * self.share:.1f}"
                text += f", off by {self.remains[0]:.2g} {self.remains[1]}, {share} % of the friction"
        return text + (f"; no place here for {listed(self.left_out)}" if self.left_out else "")

    @property
    def share(self) -> float:
        """What remains over the friction found [1]."""
        return 0.0 if self.remains is None or not self.of or not self.of[0] else self.remains[0] / self.of[0]


def joint_terms(
    result: Result,
    form: Form | None,
    joints: Collection[str] | None = None,
    include_weak: bool = False,
) -> dict[str, JointTerms]:
    """Return the terms of the joints that the log identified.

    Friction is stated as a whole if it is identified, or Coulomb or viscous friction is, of any direction: the two make
    up for each other's errors. Where none was detectable it is zero. A rotor inertia stands by itself.

    Parameters
    ----------
    result
        What was found.
    form
        Of the format's friction; None if it says all of it.
    joints
        Those that are asked for; all if None.
    include_weak
        Whether weak friction and rotor inertias are stated too.

    Raises
    ------
    SettingsError
        If a joint is asked for that the result has not.
    """
    unknown = [name for name in joints or () if name not in result.joints]
    if unknown:
        raise SettingsError(
            f"export: the result has no joint '{unknown[0]}'; it has {', '.join(result.joints)}"
            f"{did_you_mean(unknown[0], result.joints)}"
        )
    own = {name: joint for name, joint in result.joints.items() if joints is None or name in joints}
    terms = {name: _terms(joint, form, include_weak) for name, joint in own.items()}
    return {name: found for name, found in terms.items() if found.stated}


def _terms(joint: JointResult, form: Form | None, include_weak: bool) -> JointTerms:
    if form is None:
        return _all_terms(joint, include_weak)
    there, stated, words = joint.parameters, {}, form.words
    good = ("identified", "weak") if include_weak else ("identified",)
    if "armature" in there and "armature" in words and there["armature"].verdict in good:
        stated[words["armature"]] = _rounded(there["armature"].value, there["armature"].standard_error), "kg m^2"
    left_out = {
        name: (found.value, found.unit)
        for name, found in there.items()
        if name in ALONE and words.get(name) not in stated and (name != "armature" or "armature" not in words)
    }
    if joint.verdict == "no friction" and joint.curve:
        units = _units(joint.curve[0].unit)
        zero = {words[name]: (0.0, units[name]) for name in words if name in units and name != "stribeck_velocity"}
        return JointTerms(stated=zero | stated, left_out=left_out, note=joint.reason)
    if not _has_friction(joint, good):
        return JointTerms(stated=stated, left_out=left_out)
    unit = joint.curve[0].unit if joint.curve else _unit_of(joint)
    found, units, errors = nearest(joint, form), _units(unit), _errors(joint)
    friction = {
        words[name]: (_rounded(value, errors.get(name, 0.0)), units[name])
        for name, value in found.numbers.items()
        if name in words
    }
    left_out = {name: own for name, own in left_out.items() if words.get(BRISTLES.get(name, name)) not in friction}
    projected = {
        name: (own.value, own.unit) for name, own in there.items() if name not in ALONE and name not in form.of_law
    }
    return JointTerms(
        stated=friction | stated,
        projected=projected,
        remains=(found.remains, unit),
        of=(found.of, unit),
        left_out=left_out,
    )


def _all_terms(joint: JointResult, include_weak: bool) -> JointTerms:
    """Return all that was found of a joint, rotor and drift apart."""
    quantities = {name: (found.value, found.unit) for name, found in joint.parameters.items()}
    left_out = {name: own for name, own in quantities.items() if name in WITHOUT_PLACE}
    if joint.verdict == "no friction":
        return JointTerms(stated={"friction": (0.0, "N m")}, left_out=left_out, note=joint.reason)
    if not _has_friction(joint, ("identified", "weak") if include_weak else ("identified",)):
        return JointTerms(stated={})
    return JointTerms(stated={n: own for n, own in quantities.items() if n not in WITHOUT_PLACE}, left_out=left_out)


def _has_friction(joint: JointResult, good: Collection[str]) -> bool:
    """Return whether a joint's friction is known, as well as asked for."""
    names = [name for name in joint.parameters if name.startswith(("coulomb", "viscous"))]
    values = {name: parameter.value for name, parameter in joint.parameters.items()}
    known = bool(names) and law_values(get_law(joint.law), values) is not None
    return known and (joint.verdict in good or any(joint.parameters[name].verdict in good for name in names))


def _unit_of(joint: JointResult) -> str:
    """Return the unit of a joint's friction: "N m" or "N"."""
    return next((own.unit for name, own in joint.parameters.items() if name.startswith("coulomb")), "N m")


def _units(torque: str) -> dict[str, str]:
    """Return the units of a form's numbers, given the one of the joint's friction."""
    viscous, speed = ("N s/m", "m/s") if torque == "N" else ("N m s/rad", "rad/s")
    return {
        "coulomb": torque,
        "static": torque,
        "viscous": viscous,
        "stribeck_velocity": speed,
        "load": "1",
        "bristle_stiffness": "N/m" if torque == "N" else "N m/rad",
        "bristle_damping": viscous,
    }


def _errors(joint: JointResult) -> dict[str, float]:
    """Return standard errors of a form's numbers: the curve's, which is surer than each parameter by itself."""
    own = {name: parameter.standard_error for name, parameter in joint.parameters.items()}
    if not joint.curve:
        return own | {"static": own.get("coulomb", 0.0)}
    slow, top = joint.curve[0].standard_error, joint.curve[-1].standard_error
    return own | {"coulomb": slow, "static": slow, "viscous": top / max(top_speed(joint), 1e-9)}


def _rounded(value: float, error: float) -> float:
    """Return a value with as many digits as its standard error supports."""
    if not np.isfinite(error) or error <= 0:
        return float(f"{value:.6g}")
    return round(value, SIGNIFICANT - 1 - int(np.floor(np.log10(error))))


def listed(quantities: Mapping[str, Quantity]) -> str:
    """Return quantities in words."""
    return ", ".join(f"{name} {value:.4g}" + f" {unit}" * (unit != "1") for name, (value, unit) in quantities.items())
