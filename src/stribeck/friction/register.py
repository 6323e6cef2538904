"""A law of the user's own joins those there are, if it keeps what every law promises."""

import inspect
import re

import numpy as np

from stribeck.errors import SettingsError
from stribeck.friction import AUTO, LAWS, LAWS_WITH_STATE
from stribeck.friction.law import FrictionLaw, Parameter
from stribeck.friction.terms import BEYOND_VELOCITY
from stribeck.typing import Array

RESERVED = {"armature", *(parameter.name for parameter in BEYOND_VELOCITY)}
"""Names of parameters that are fitted beside a law."""

DRAWS = 20
"""Random parameter values, within the bounds, at which a law is checked."""

LARGEST = 5.0
"""Size of a drawn parameter that has no bound, in its SI unit."""

VELOCITY = np.linspace(-3.0, 3.0, 61)
"""[rad/s], at which a law is checked; zero is among them."""

SLOPE_TOLERANCE = 2e-5
"""By which a derivative may miss a central difference, relative to the largest one [1]."""

ROUNDING = 1e-9
"""By which two ways to the same torque may differ, relative to the torque [1]."""


def register_law(law: type[FrictionLaw]) -> type[FrictionLaw]:
    """Add a friction law to those that `identify` knows by name, once it is checked; also a class decorator.

    Checked are its names, units and bounds, and, at random parameters within the bounds, that the torque is finite and
    dissipates (v R(v) >= 0 without `offset`), that `jacobian` has its derivatives, and that `basis` and `from_linear`
    are the same law.

    Parameters
    ----------
    law
        A subclass of `FrictionLaw` that is made without arguments.

    Returns
    -------
    law
        The same class.

    Raises
    ------
    SettingsError
        If the name is taken, or the law breaks the contract; the message says where.

    Examples
    --------
    >>> import numpy as np
    >>> from stribeck import FrictionLaw, register_law
    >>> from stribeck.friction import Parameter
    >>> @register_law
    ... class Coulomb(FrictionLaw):
    ...     name, title, jumps = "coulomb", "Coulomb alone", True
    ...     parameters = (Parameter(name="coulomb", symbol="Fc", unit="N m"),)
    ...
    ...     def torque(self, velocity, values):
    ...         return values[0] * np.sign(velocity)
    ...
    ...     def jacobian(self, velocity, values):
    ...         return np.sign(velocity)[:, None]
    ...
    ...     def basis(self, velocity, shape):
    ...         return np.sign(velocity)[:, None]
    ...
    ...     def from_linear(self, coefficients, shape):
    ...         return np.maximum(coefficients, 0.0)
    >>> result = identify(log, robot, Settings(law="coulomb"))
    >>> list(result.joints["elbow"].parameters)
    ['coulomb']
    """
    if not (isinstance(law, type) and issubclass(law, FrictionLaw)) or inspect.isabstract(law):
        raise SettingsError(f"register_law: found {law!r}; expected a subclass of FrictionLaw with all of its methods")
    made = _checked_names(law)
    generator = np.random.default_rng(0)
    for _ in range(DRAWS):
        values = np.array([_drawn(parameter, generator) for parameter in law.parameters])
        try:
            complaint = (
                _shape_complaint(made, values)
                or _power_complaint(made, values)
                or _slope_complaint(made, values)
                or _linear_complaint(made, values, generator)
            )
        except Exception as error:  # whatever the user's code raises
            complaint = f"raises {type(error).__name__} ({error})"
        if complaint:
            at = ", ".join(f"{p.name} = {value:.4g}" for p, value in zip(law.parameters, values, strict=True))
            raise SettingsError(f"register_law: law '{law.name}' at {at}: {complaint}")
    LAWS[law.name] = law
    return law


def _checked_names(law: type[FrictionLaw]) -> FrictionLaw:
    """Return a law's instance, or refuse its names, units and bounds."""
    name, parameters = getattr(law, "name", None), getattr(law, "parameters", None)
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        raise SettingsError(f"register_law: {law.__name__}.name is {name!r}; expected lower-case words and hyphens")
    taken = sorted([*LAWS, *LAWS_WITH_STATE, AUTO])
    if name in taken:
        raise SettingsError(f"register_law: the name '{name}' is taken; there are {', '.join(taken)}")
    if not isinstance(getattr(law, "title", None), str):
        raise SettingsError(f"register_law: law '{name}' has no title; expected a few words")
    if not isinstance(parameters, tuple) or not parameters or not all(isinstance(p, Parameter) for p in parameters):
        raise SettingsError(f"register_law: law '{name}' has parameters {parameters!r}; expected a tuple of Parameter")
    names = [parameter.name for parameter in parameters]
    if wrong := [own for own in names if not own.isidentifier() or own in RESERVED or names.count(own) > 1]:
        raise SettingsError(
            f"register_law: law '{name}' has a parameter '{wrong[0]}'; expected identifiers, each once, and none of "
            f"{', '.join(sorted(RESERVED))}"
        )
    for parameter in parameters:
        if not parameter.lower < parameter.upper or (parameter.logarithmic and parameter.lower <= 0):
            raise SettingsError(
                f"register_law: law '{name}': {parameter.name} lies from {parameter.lower:g} to {parameter.upper:g}; "
                "expected a lower bound below the upper one, and above 0 where it is logarithmic"
            )
        if not all(parameter.lower <= start <= parameter.upper for start in parameter.starts):
            raise SettingsError(f"register_law: law '{name}': {parameter.name} starts outside of its bounds")
    try:
        return law()
    except TypeError as error:
        raise SettingsError(f"register_law: law '{name}' cannot be made without arguments ({error})") from error


def _drawn(parameter: Parameter, generator: np.random.Generator) -> float:
    """Return a value within the bounds, away from them; of a parameter with starts, one between those."""
    if parameter.starts:
        low, high = min(parameter.starts), max(parameter.starts)
        return float(generator.uniform(low, high))
    low = parameter.lower if np.isfinite(parameter.lower) else min(parameter.upper, LARGEST) - 2 * LARGEST
    high = parameter.upper if np.isfinite(parameter.upper) else max(low + LARGEST, LARGEST)
    return float(low + (high - low) * generator.uniform(0.05, 0.95))


def _shape_complaint(law: FrictionLaw, values: Array) -> str:
    """Return whether torque and jacobian have other shapes or numbers than a law's, "" if all is well."""
    for name, shape in (("torque", VELOCITY.shape), ("jacobian", (len(VELOCITY), len(values)))):
        found = getattr(law, name)(VELOCITY, values)
        if np.shape(found) != shape:
            return f"{name} has shape {np.shape(found)} for {len(VELOCITY)} velocities; expected {shape}"
        if not np.isfinite(found).all():
            return f"{name} is not finite; expected finite values within the bounds"
    return ""


def _power_complaint(law: FrictionLaw, values: Array) -> str:
    """Return whether friction violates passivity, or jumps without saying so."""
    values = np.where([parameter.name == "offset" for parameter in law.parameters], 0.0, values)
    torque = law.torque(VELOCITY, values)
    wrong = VELOCITY * torque < -ROUNDING * (1 + np.abs(torque))
    if wrong.any():
        return (
            f"passivity violated, R = {torque[wrong][0]:.4g} N m at {VELOCITY[wrong][0]:.4g} rad/s; expected the sign "
            "of the velocity (only a parameter named 'offset' may push)"
        )
    before, after = law.torque(np.array([-1e-9, 1e-9]), values)
    if not law.jumps and abs(after - before) > 1e-3 * (1 + np.abs(torque).max()):
        return f"jumps by {after - before:.4g} N m at standstill; expected jumps = True"
    return ""


def _slope_complaint(law: FrictionLaw, values: Array) -> str:
    """Return whether the jacobian is not the derivative of the torque."""
    jacobian = law.jacobian(VELOCITY, values)
    for k, parameter in enumerate(law.parameters):
        step = 1e-6 * max(abs(values[k]), 1e-2) * (np.arange(len(values)) == k)
        slope = (law.torque(VELOCITY, values + step) - law.torque(VELOCITY, values - step)) / (2 * step[k])
        miss = np.abs(jacobian[:, k] - slope)
        worst = int(np.argmax(miss))
        if miss[worst] > SLOPE_TOLERANCE * (1 + np.abs(slope).max()):
            return (
                f"jacobian has dR/d{parameter.name} = {jacobian[worst, k]:.6g} at {VELOCITY[worst]:.4g} rad/s; "
                f"expected {slope[worst]:.6g}, as differences of the torque say"
            )
    return ""


def _linear_complaint(law: FrictionLaw, values: Array, generator: np.random.Generator) -> str:
    """Return what is wrong with a law's linear form, "" if nothing."""
    shape = {p.name: float(value) for p, value in zip(law.parameters, values, strict=True) if p.starts}
    basis = law.basis(VELOCITY, shape)
    if basis.ndim != 2 or len(basis) != len(VELOCITY):
        return f"basis has shape {basis.shape}; expected a row for each of {len(VELOCITY)} velocities"
    coefficients = np.asarray(generator.uniform(0.5, 3.0, basis.shape[1]))
    found = law.from_linear(coefficients, shape)
    if np.shape(found) != values.shape:
        return f"from_linear returns shape {np.shape(found)}; expected {values.shape}"
    linear, torque = basis @ coefficients, law.torque(VELOCITY, found)
    if np.abs(torque - linear).max() > ROUNDING * (1 + np.abs(linear).max()):
        return "basis and from_linear are not the law: expected torque(v, from_linear(c)) = basis(v) @ c"
    extreme = generator.choice([-1e3, 1e3], basis.shape[1])
    for parameter, value in zip(law.parameters, law.from_linear(extreme, shape), strict=True):
        if not parameter.lower <= value <= parameter.upper:
            return (
                f"from_linear gives {parameter.name} = {value:.4g}; expected {parameter.lower:g} to {parameter.upper:g}"
            )
    return ""
