"""Forms of friction that simulators know, and the nearest of a form to the friction that was found.

With R the friction found, without its offset, at speeds, loads and positions x_k of the log, and B(x) the columns of a
form, its numbers c are those of

    min sum (R(x_k) - B(x_k) c)^2,    c >= 0        (Lawson and Hanson 1974)

What remains is a loss that is stated, and no term is dropped.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from stribeck.errors import SettingsError
from stribeck.result import JointResult
from stribeck.typing import Array

SPEEDS, POSITIONS = 40, 64
"""Speeds in each direction up to the top speed, and positions of the log, that friction is compared at [1]."""

SLOWEST, SLOW_SPEEDS = 1e-3, 100
"""Slowest speed over the top speed [1], and speeds in each direction [1], that the torque at rest is sought at."""

GOLDEN = 0.5 * (5**0.5 - 1)
"""Multiples of it, less whole numbers, fill a range evenly, however often a ripple repeats in it (Weyl 1916)."""

OF_POSITION = ("coulomb_cosine", "coulomb_sine", "ripple_cosine", "ripple_sine")


@dataclass(frozen=True, eq=False)
class Form:
    """Friction as a sum of functions of velocity and load, whose coefficients are not negative.

    Attributes
    ----------
    words
        Number -> the target's own word, of what it has a place for: coefficients, "static", the torque that holds at
        rest, "stribeck_velocity", "bristle_stiffness", "bristle_damping", and "armature".
    numbers
        Names of the coefficients.
    columns
        The functions, shape (N, k), from velocities and loads, shape (N,), and the parameters found by name.
    of_law
        Parameters of laws that the form has too: no others are projected.
    """

    words: Mapping[str, str]
    numbers: tuple[str, ...]
    columns: Callable[[Array, Array, Mapping[str, float]], Array]
    of_law: frozenset[str]


def _viscous(velocity: Array, load: Array, found: Mapping[str, float]) -> Array:  # noqa: ARG001 - the same for all forms
    return velocity[:, None]


def _plain(velocity: Array, load: Array, found: Mapping[str, float]) -> Array:  # noqa: ARG001 - the same for all forms
    return np.column_stack([np.sign(velocity), velocity])


def _stribeck(velocity: Array, load: Array, found: Mapping[str, float]) -> Array:
    rise = np.exp(-((velocity / found.get("stribeck_velocity", 1.0)) ** 2)) * ("stribeck_velocity" in found)
    return np.column_stack([_plain(velocity, load, found), np.sign(velocity) * rise])


def _loaded(velocity: Array, load: Array, found: Mapping[str, float]) -> Array:
    return np.column_stack([_plain(velocity, load, found), np.sign(velocity) * np.abs(load)])


def viscous(**words: str) -> Form:
    """Return the form Fv v."""
    return Form(words, ("viscous",), _viscous, frozenset({"viscous"}))


def plain(**words: str) -> Form:
    """Return the form Fc sign(v) + Fv v."""
    return Form(words, ("coulomb", "viscous"), _plain, frozenset({"coulomb", "viscous"}))


def stribeck(**words: str) -> Form:
    """Return the form Fc sign(v) + Fv v + Fs exp(-(v / vs)^2) sign(v), with Fs = Fc S."""
    of_law = frozenset({"coulomb", "viscous", "stribeck_gain", "stribeck_velocity"})
    return Form(words, ("coulomb", "viscous", "stribeck"), _stribeck, of_law)


def loaded(**words: str) -> Form:
    """Return the form (Fc + mu |load|) sign(v) + Fv v."""
    return Form(words, ("coulomb", "viscous", "load"), _loaded, frozenset({"coulomb", "viscous", "load"}))


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """The nearest friction of a form.

    Attributes
    ----------
    numbers
        Its coefficients, "static", the torque that holds at rest, "stribeck_velocity", and, where they are identified,
        "bristle_stiffness" and "bristle_damping", by name.
    remains, of
        Root mean square of what the form cannot say, and of the friction found [N m], [N].
    """

    numbers: dict[str, float]
    remains: float
    of: float

    @property
    def share(self) -> float:
        """What remains over the friction found [1]."""
        return self.remains / self.of if self.of else 0.0


def nearest(joint: JointResult, form: Form) -> Nearest:
    """Return the friction of a form that is nearest to what was found of a joint.

    Compared are speeds up to the curve's top speed in both directions, the loads of the log by their mean and standard
    deviation, and its positions, where friction depends on these.

    Raises
    ------
    SettingsError
        If the friction is not finite there.
    """
    with np.errstate(all="ignore"):  # numbers that no joint has are refused in the end
        found = {name: parameter.value for name, parameter in joint.parameters.items()}
        velocity, load, position = _visited(joint, found, np.arange(1, SPEEDS + 1) / SPEEDS)
        friction = joint.friction(velocity, load, position=position) - found.get("offset", 0.0)
        columns = form.columns(velocity, load, found)
        unit = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        if not np.isfinite(np.append(unit, np.linalg.norm(friction))).all():
            raise SettingsError(f"export: the friction found is {friction.max():g}; expected a finite one")
        coefficients = nnls(columns / unit, friction)[0] / unit
        numbers = dict(zip(form.numbers, coefficients.tolist(), strict=True))
        numbers["static"] = numbers.get("coulomb", 0.0) + numbers.get("stribeck", _stiction(joint, found, numbers))
        numbers["stribeck_velocity"] = found.get("stribeck_velocity", 1.0)
        numbers |= _bristles(joint, found)
        remains = float(np.sqrt(np.mean((friction - columns @ coefficients) ** 2)))
        if not np.isfinite([*numbers.values(), remains]).all():
            raise SettingsError(f"export: the friction at rest is {numbers['static']:g}; expected a finite one")
        return Nearest(numbers=numbers, remains=remains, of=float(np.sqrt(np.mean(friction**2))))


def _bristles(joint: JointResult, found: Mapping[str, float]) -> dict[str, float]:
    """Return stiffness, Coulomb friction over travel [N m/rad], and damping [N m s/rad] of identified bristles."""
    known = [name for name in ("bristle_travel", "bristle_damping") if name in found]
    numbers = {name: found[name] for name in known if joint.parameters[name].verdict == "identified"}
    if "bristle_travel" in numbers:
        numbers["bristle_stiffness"] = found["coulomb"] / numbers.pop("bristle_travel")
    return numbers


def _stiction(joint: JointResult, found: Mapping[str, float], numbers: Mapping[str, float]) -> float:
    """Return by how much the torque that resists slow motion is above Coulomb friction, mean of both directions."""
    velocity, load, position = _visited(joint, found, np.geomspace(SLOWEST, 1.0, SLOW_SPEEDS))
    friction = joint.friction(velocity, load, position=position) - found.get("offset", 0.0)
    resisting = np.sign(velocity) * (friction - numbers["viscous"] * velocity)
    levels = resisting.reshape(2, SLOW_SPEEDS, -1).mean(axis=2)  # from the top speed down, and up again
    return max(float((levels[0, ::-1] + levels[1]).max() / 2) - numbers.get("coulomb", 0.0), 0.0)


def top_speed(joint: JointResult) -> float:
    """Return the speed up to which a joint's friction is known [rad/s], [m/s]."""
    return joint.curve[-1].velocity if joint.curve else max(map(abs, joint.velocity_range))


def _visited(joint: JointResult, found: Mapping[str, float], shares: Array) -> tuple[Array, Array, Array]:
    """Return velocities, at shares of the top speed in both directions, loads and positions, shape (N,) each."""
    positive = shares * top_speed(joint)
    mean, deviation = joint.mean_load or 0.0, joint.load_deviation or 0.0
    loads = np.unique([max(mean - deviation, 0.0), mean + deviation]) if "load" in found else np.array([mean])
    low, high = joint.position_range or (0.0, 2 * np.pi)
    positions = [low]
    if any(name in found for name in OF_POSITION):
        positions = (low + (high - low) * (GOLDEN * np.arange(POSITIONS) % 1)).tolist()
    grid = np.meshgrid(np.concatenate([-positive[::-1], positive]), loads, positions, indexing="ij")
    velocity, load, position = (axis.ravel() for axis in grid)
    return velocity, load, position
