"""Friction models of simulators ("forms"), and their best fit to the identified friction.

R is the identified friction without offset, at speeds, loads and positions x_k of the log. B(x) are the columns of a
form. Its coefficients c solve

    min sum (R(x_k) - B(x_k) c)^2,    c >= 0        (Lawson and Hanson 1974)

The RMS of the residual is reported. Where the form leaves the inner half of the curve's 95 % interval, the weights of
these speeds are raised (Lawson 1961), if that puts the form inside the interval.

A joint with extrapolated friction (`beyond`) has one more residual, whose weight is halved until this residual moves
the form within the log by no more than the room: a quarter of the 95 % interval, minus the error of the form. Forms
without Coulomb friction fit neither, and keep the weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from stribeck.app.exporters.beyond import Beyond, top_speed
from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.friction.terms import parameters_over
from stribeck.core.result import JointResult

SPEEDS = 40
"""Largest number of speeds in each direction, up to the top speed, at which friction is compared."""

HALVINGS = 30
"""Number of times the weight of extrapolated friction is halved before it is dropped, or other weights are raised."""

ROUNDING = 1e-6
"""Error of a form relative to the friction [1] below which the form is exact."""


@dataclass(frozen=True, eq=False)
class Form:
    """Friction as a sum of functions of velocity with nonnegative coefficients.

    Attributes
    ----------
    words
        Name in the target format, by number: coefficients, "static" (holding torque at rest), "stribeck_velocity",
        "bristle_stiffness", "bristle_damping" and "armature".
    """

    words: Mapping[str, str]

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of the coefficients.

        "viscous" of v, "coulomb" of sign(v), "stribeck" of exp(-(v / vs)^2) sign(v) with a Stribeck velocity, and
        "gear_load" of 2 |load| sign(v), because motor and load act on both sides of a gear.
        """
        names = {*self.words, "stribeck" if "stribeck_velocity" in self.words else ""}
        return tuple(name for name in ("coulomb", "viscous", "stribeck", "gear_load") if name in names)

    @property
    def of_law(self) -> set[str]:
        """Parameters of friction laws that the form contains; all others are approximated."""
        height = {"stribeck_gain", "stribeck_velocity"} if "stribeck" in self.numbers else set()
        return {*self.numbers, "load" if "gear_load" in self.numbers else ""} - {"stribeck"} | height

    def columns(self, velocity: Array, load: Array, values: Mapping[str, float]) -> Array:
        """Compute the functions, shape (N, k), for velocities and loads, shape (N,), and the identified parameters."""
        rise = np.exp(-((velocity / values.get("stribeck_velocity", 1.0)) ** 2)) * ("stribeck_velocity" in values)
        sign = np.sign(velocity)
        columns = {"viscous": velocity, "coulomb": sign, "stribeck": sign * rise}
        columns["gear_load"] = 2 * np.abs(load) * sign * ("load" in values)
        return np.column_stack([columns[name] for name in self.numbers])


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """Best fit of a form to the friction.

    Attributes
    ----------
    numbers
        Values by name: coefficients, "static" (holding torque at rest), "stribeck_velocity", and, if identified,
        "bristle_stiffness" and "bristle_damping".
    remains, of
        Root mean square of the residual, and of the identified friction [N m], [N].
    largest
        Largest difference from the identified curve [N m], [N], and its speed [rad/s], [m/s].
    far
        Friction of the form at the speed of `beyond` [N m], [N]; NaN without.
    """

    numbers: dict[str, float]
    remains: float
    of: float
    largest: tuple[float, float]
    far: float

    @property
    def share(self) -> float:
        """Approximation error divided by the friction [1]."""
        return self.remains / self.of if self.of else 0.0


def nearest(joint: JointResult, form: Form, beyond: Beyond | None = None) -> Nearest:
    """Fit a form to the identified friction of a joint.

    The fit covers speeds up to the curve's top speed in both directions and, where friction depends on them, loads
    (mean and standard deviation) and positions of the log, and the extrapolated friction.

    Raises
    ------
    SettingsError
        If the friction is not finite.
    """
    with np.errstate(all="ignore"):  # overflows are refused below
        values = joint.values
        velocity, load, friction = _resistance(joint, values, _speeds(joint, values))
        columns = form.columns(velocity.ravel(), load.ravel(), values).reshape(*velocity.shape, -1)
        if not np.isfinite([np.linalg.norm(columns), np.linalg.norm(friction)]).all():
            raise SettingsError(f"export: the friction of the result is {friction.max():g}; expected a finite value")
        room = _room(joint, velocity[:, 0], friction)
        weights = _weights(columns, friction, room)
        coefficients = _coefficients(columns, friction, weights)
        if beyond:
            far = form.columns(np.array([beyond.speed]), np.array([joint.mean_load or 0.0]), values)
            free = room - abs(np.mean(friction - columns @ coefficients, axis=1)) if "coulomb" in form.numbers else None
            coefficients = _guided(columns, friction, weights, far, beyond.friction, free)
        residual = friction - columns @ coefficients
        off = abs(residual.mean(axis=1))
        numbers = dict(zip(form.numbers, coefficients.tolist(), strict=True))
        numbers["static"] = numbers.get("coulomb", 0.0) + numbers.get("stribeck", _stiction(joint, values, numbers))
        numbers["stribeck_velocity"] = values.get("stribeck_velocity", 1.0)
        numbers |= _bristles(joint, values)
        remains = float(np.sqrt(np.mean(residual**2)))
        if not np.isfinite([*numbers.values(), remains]).all():
            raise SettingsError(f"export: the friction at rest is {numbers['static']:g}; expected a finite value")
        return Nearest(
            numbers=numbers,
            remains=remains,
            of=float(np.sqrt(np.mean(friction**2))),
            largest=(float(off.max()), float(abs(velocity[off.argmax(), 0]))),
            far=float((far @ coefficients)[0]) if beyond else float("nan"),
        )


def _coefficients(columns: Array, friction: Array, weights: Array, *more: tuple[Array, float]) -> Array:
    """Solve the nonnegative least-squares problem with columns of equal norm, and more rows, shape (k,)."""
    rows = (columns * weights[:, None, None]).reshape(-1, columns.shape[-1])
    values = (friction * weights[:, None]).ravel()
    for row, value in more:
        rows, values = np.vstack([rows, row]), np.append(values, value)
    unit = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    return np.asarray(nnls(rows / unit, values)[0] / unit)


def _weights(columns: Array, friction: Array, room: Array) -> Array:
    """Raise the weights of speeds at which a form is outside the room, shape (V,); equal if it stays too far away."""
    equal = weights = np.ones(len(room))
    for _ in range(HALVINGS):
        residual = friction - columns @ _coefficients(columns, friction, weights)
        ratio = abs(residual.mean(axis=1)) / np.maximum(room, 1e-300)
        if ratio.max() <= 1:
            return weights
        weights = weights * np.sqrt(np.maximum(ratio, 1))
    return weights if ratio.max() <= 2 else equal  # the interval is twice the room


def _guided(columns: Array, friction: Array, weights: Array, far: Array, guess: float, room: Array | None) -> Array:
    """Fit a form to friction of the log and a guess beyond it, which moves the form by at most the room within it."""
    coefficients = _coefficients(columns, friction, weights)
    weight = float(np.linalg.norm(friction * weights[:, None])) / guess
    for _ in range(HALVINGS):
        guided = _coefficients(columns, friction, weights, (weight * far, weight * guess))
        if room is None or np.all(abs(np.mean(columns @ (guided - coefficients), axis=1)) <= room):
            return guided
        weight /= 2
    return coefficients


def _speeds(joint: JointResult, values: Mapping[str, float]) -> Array:
    """Compute the speeds of the fit, shape (V,), without slow ones where the law's smooth sign is below 0.96.

    There, a log does not resolve friction: its curve starts at the slow speed, and the sign of simulators is sharp.
    """
    top = top_speed(joint)
    speeds = top * np.arange(1, SPEEDS + 1) / SPEEDS
    slow = min(joint.curve[0].velocity, top) if joint.curve else 0.0
    return np.asarray(speeds[(speeds >= (1 - 1e-9) * slow) | (values.get("slope", np.inf) * speeds >= 2)])


def _room(joint: JointResult, velocity: Array, friction: Array) -> Array:
    """Compute half of the half-width of the curve's interval at each velocity [N m], [N], shape (V,)."""
    speeds, halves = np.array([(point.velocity, point.half_width) for point in joint.curve] or [(0.0, 0.0)]).T
    rounding = ROUNDING * np.sqrt(np.mean(friction**2))
    return np.asarray(np.maximum(np.interp(abs(velocity), speeds, halves) / 2, rounding))


def _bristles(joint: JointResult, values: Mapping[str, float]) -> dict[str, float]:
    """Compute stiffness (Coulomb friction divided by travel) [N m/rad] and damping [N m s/rad] of bristles."""
    known = [name for name in ("bristle_travel", "bristle_damping") if name in values]
    numbers = {name: values[name] for name in known if joint.parameters[name].verdict == "identified"}
    if "bristle_travel" in numbers:
        numbers["bristle_stiffness"] = values["coulomb"] / numbers.pop("bristle_travel")
    return numbers


def _stiction(joint: JointResult, values: Mapping[str, float], numbers: Mapping[str, float]) -> float:
    """Compute the excess of the torque that resists slow motion over Coulomb friction, mean of both directions."""
    velocity, _, friction = _resistance(joint, values, top_speed(joint) * np.geomspace(1e-3, 1.0, 100))
    levels = np.mean(np.sign(velocity) * (friction - numbers["viscous"] * velocity), axis=1)  # from -top to top
    return max(float((levels + levels[::-1]).max() / 2) - numbers.get("coulomb", 0.0), 0.0)


def _resistance(joint: JointResult, values: Mapping[str, float], speeds: Array) -> tuple[Array, Array, Array]:
    """Compute velocities, at speeds in both directions, loads, and the friction, shape (V, k) each.

    The k columns are loads and positions of the log. Positions are fractional parts of multiples of the golden ratio,
    which fill a range evenly whatever the period of a ripple (Weyl 1916). The mean over the columns is replaced by the
    identified curve, the mean over the log's positions, because a joint is not at all positions for the same time.
    """
    mean, deviation = joint.mean_load or 0.0, joint.load_deviation or 0.0
    deviation = min(deviation, mean) if values.keys() & parameters_over("load") else 0.0
    loads = np.unique([mean - deviation, mean + deviation])
    low, high = joint.position_range or (0.0, 2 * np.pi)
    positions = [low]
    if values.keys() & parameters_over("position"):
        positions = (low + (high - low) * (0.5 * (5**0.5 - 1) * np.arange(64) % 1)).tolist()
    grid = np.meshgrid(np.concatenate([-speeds[::-1], speeds]), loads, positions, indexing="ij")
    velocity, load, position = (axis.reshape(2 * len(speeds), -1) for axis in grid)
    friction = joint.friction(velocity, load, position=position)
    curve = joint.friction(velocity[:, 0])[:, None]
    return velocity, load, friction + curve - friction.mean(axis=1, keepdims=True)
