"""The numbers of one function that is the friction of every law here, for targets that evaluate it themselves.

    R = f(v) rise + Fv v + Fv' |v| + offset + tau_c cos(k q) + tau_s sin(k q)
    f(v) rise = (Fc rise + Fc' |rise|) (1 + S exp(-(|v| / vs)^delta))
                + (mu |load| + Fc_T dT + Fc_c (cos q - c) + Fc_s (sin q - s)) rise,   rise = tanh(a v)
    Fv = Fv0 + Fv_T dT

with a load, dT the temperature above its mean, and q the position.
"""

from stribeck.errors import SettingsError
from stribeck.friction.assembled import JUMP
from stribeck.result import JointResult

NAMES = (
    "viscous",
    "viscous_difference",
    "coulomb",
    "coulomb_difference",
    "stribeck_gain",
    "stribeck_velocity",
    "exponent",
    "slope",
    "offset",
    "load",
    "coulomb_per_kelvin",
    "viscous_per_kelvin",
    "coulomb_cosine",
    "coulomb_sine",
    "mean_cosine",
    "mean_sine",
    "ripple_cosine",
    "ripple_sine",
    "ripple_per_turn",
    "lowest",
    "highest",
)
"""Fv0, Fv', Fc, Fc', S, vs, delta, a, offset, mu, Fc_T, Fv_T, Fc_c, Fc_s, c, s, tau_c, tau_s, k, and the positions of
the log, of which the nearest counts beyond them."""

MADE = ("viscous_difference", "coulomb_difference", "mean_cosine", "mean_sine", "ripple_per_turn", "lowest", "highest")
"""Numbers that are no parameters of a law."""

SAME = tuple(name for name in NAMES if name not in MADE)
"""Parameters of laws that are numbers of the function as they are."""

FAR = 1e9
"""Position [rad] that no log reaches."""

FORMULAS = frozenset({"coulomb-viscous", "stribeck", "stribeck-exponent", "asymmetric", "lugre", "auto"})
"""Laws that the function is the friction of; of LuGre's, that of steady sliding."""

DIRECTIONS = ("viscous_positive", "viscous_negative", "coulomb_positive", "coulomb_negative")


def numbers_of(joint: JointResult) -> dict[str, float]:
    """Return the numbers of a joint's friction, by `NAMES`; drift is left out, which is zero in the middle of a log.

    Raises
    ------
    SettingsError
        If its law is not one of the laws here.
    """
    found = {name: parameter.value for name, parameter in joint.parameters.items() if name != "armature"}
    numbers = dict.fromkeys(NAMES, 0.0) | {"stribeck_velocity": 1.0, "exponent": 2.0, "slope": JUMP}
    numbers |= dict(zip(("lowest", "highest"), joint.position_range or (-FAR, FAR), strict=True))
    if joint.verdict == "no friction":
        return numbers | {"offset": found.get("offset", 0.0)}
    if joint.law not in FORMULAS:
        raise SettingsError(
            f"export: there is no formula of law '{joint.law}' here; expected one of {', '.join(sorted(FORMULAS))}"
        )
    numbers |= {name: found[name] for name in SAME if name in found}
    if "viscous_asymmetry" in found:
        numbers["viscous_difference"] = found["viscous"] * found["viscous_asymmetry"]
    if "viscous_positive" in found:
        forward, backward, up, down = (found[name] for name in DIRECTIONS)
        numbers |= {
            "viscous": (forward + backward) / 2,
            "viscous_difference": (forward - backward) / 2,
            "coulomb": (up + down) / 2,
            "coulomb_difference": (up - down) / 2,
        }
    if joint.mean_direction:
        numbers |= {"mean_cosine": joint.mean_direction[0], "mean_sine": joint.mean_direction[1]}
    return numbers | {"ripple_per_turn": joint.ripple_per_turn or 0.0}
