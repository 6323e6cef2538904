"""Registration of user-defined friction laws, with a check of each law's mandatory properties."""

import inspect
import re

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.friction.catalogue import AUTO, LAWS, LAWS_WITH_STATE
from stribeck.core.friction.law import FrictionLaw, Parameter
from stribeck.core.friction.terms import BEYOND_VELOCITY

VELOCITY = np.linspace(-3.0, 3.0, 61)
"""Velocities [rad/s] at which a law is checked, including zero."""


def register_law(law: type[FrictionLaw]) -> type[FrictionLaw]:
    """Check a friction law and make it available to `identify` by name; also a class decorator.

    The checks cover names, units and bounds. At random parameters within the bounds, the torque must be finite and
    dissipate (v R(v) >= 0 without `offset`), `jacobian` must match its derivatives, and `basis` and `from_linear` must
    give the same law.

    Parameters
    ----------
    law
        Subclass of `FrictionLaw` whose constructor needs no arguments.

    Returns
    -------
    law
        The registered class, unchanged.

    Raises
    ------
    SettingsError
        If the name exists already, or the law fails a check; the message names the place.

    Examples
    --------
    >>> import numpy as np
    >>> from stribeck import FrictionLaw, register_law
    >>> from stribeck.core.friction import Parameter
    >>> @register_law
    ... class Coulomb(FrictionLaw):
    ...     name, title, jumps = "coulomb", "Only Coulomb", True
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
    if complaint := _check_declaration(law):
        raise SettingsError(f"register_law: {complaint}")
    try:
        made = law()
    except TypeError as error:
        raise SettingsError(f"register_law: law '{law.name}' cannot be made without arguments ({error})") from error
    generator = np.random.default_rng(0)
    for _ in range(20):
        values = np.array([_draw(parameter, generator) for parameter in law.parameters])
        try:
            complaint = _check_torque(made, values) or _check_linear_form(made, values, generator)
        except Exception as error:  # whatever the user's code raises
            complaint = f"raises {type(error).__name__} ({error})"
        if complaint:
            at = ", ".join(f"{p.name} = {value:.4g}" for p, value in zip(law.parameters, values, strict=True))
            raise SettingsError(f"register_law: law '{law.name}' at {at}: {complaint}")
    LAWS[law.name] = law
    return law


def _check_declaration(law: type[FrictionLaw]) -> str:
    """Describe errors of a law's names, units and bounds; "" if there are none."""
    name, parameters = getattr(law, "name", None), getattr(law, "parameters", None)
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        return f"{law.__name__}.name is {name!r}; expected lower-case words and hyphens"
    if name in (taken := sorted([*LAWS, *LAWS_WITH_STATE, AUTO])):
        return f"the name '{name}' is taken; there are {', '.join(taken)}"
    if not isinstance(getattr(law, "title", None), str):
        return f"law '{name}' has no title; expected a few words"
    if not isinstance(parameters, tuple) or not parameters or not all(isinstance(p, Parameter) for p in parameters):
        return f"law '{name}' has parameters {parameters!r}; expected a tuple of Parameter"
    names, reserved = [p.name for p in parameters], {"armature", *(p.name for p in BEYOND_VELOCITY)}
    if wrong := [label for label in names if not label.isidentifier() or label in reserved or names.count(label) > 1]:
        expected = f"identifiers, each once, and none of {', '.join(sorted(reserved))}"
        return f"law '{name}' has a parameter '{wrong[0]}'; expected {expected}"
    for entry in parameters:
        if not entry.lower < entry.upper or (entry.logarithmic and entry.lower <= 0):
            expected = "a lower bound below the upper one, and above 0 where it is logarithmic"
            return f"law '{name}': {entry.name} lies from {entry.lower:g} to {entry.upper:g}; expected {expected}"
        if not all(entry.lower <= start <= entry.upper for start in entry.starts):
            return f"law '{name}': {entry.name} starts outside of its bounds"
    return ""


def _draw(parameter: Parameter, generator: np.random.Generator) -> float:
    """Draw a value between the starts if there are any, else between the bounds; infinite bounds become 5 SI units."""
    if parameter.starts:
        return float(generator.uniform(min(parameter.starts), max(parameter.starts)))
    low = parameter.lower if np.isfinite(parameter.lower) else min(parameter.upper, 5.0) - 10.0
    high = parameter.upper if np.isfinite(parameter.upper) else max(low + 5.0, 5.0)
    return float(low + (high - low) * generator.uniform(0.05, 0.95))


def _check_torque(law: FrictionLaw, values: Array) -> str:
    """Describe errors of torque and jacobian: shape, passivity, undeclared jump, derivatives; "" if there are none."""
    torque, jacobian = law.torque(VELOCITY, values), law.jacobian(VELOCITY, values)
    for name, array, shape in (("torque", torque, VELOCITY.shape), ("jacobian", jacobian, (61, len(values)))):
        if np.shape(array) != shape:
            return f"{name} has shape {np.shape(array)} for {len(VELOCITY)} velocities; expected {shape}"
        if not np.isfinite(array).all():
            return f"{name} is not finite; expected finite values within the bounds"
    passive = np.where([parameter.name == "offset" for parameter in law.parameters], 0.0, values)
    torque = law.torque(VELOCITY, passive)
    if (wrong := VELOCITY * torque < -1e-9 * (1 + np.abs(torque))).any():
        where = f"R = {torque[wrong][0]:.4g} N m at {VELOCITY[wrong][0]:.4g} rad/s"
        expected = "the sign of the velocity (only a parameter named 'offset' may push)"
        return f"passivity violated, {where}; expected {expected}"
    before, after = law.torque(np.array([-1e-9, 1e-9]), passive)
    if not law.jumps and abs(after - before) > 1e-3 * (1 + np.abs(torque).max()):
        return f"jumps by {after - before:.4g} N m at standstill; expected jumps = True"
    for k, parameter in enumerate(law.parameters):
        step = 1e-6 * max(abs(values[k]), 1e-2) * (np.arange(len(values)) == k)
        slope = (law.torque(VELOCITY, values + step) - law.torque(VELOCITY, values - step)) / (2 * step[k])
        miss = np.abs(jacobian[:, k] - slope)
        worst = int(np.argmax(miss))
        if miss[worst] > 2e-5 * (1 + np.abs(slope).max()):
            where = f"dR/d{parameter.name} = {jacobian[worst, k]:.6g} at {VELOCITY[worst]:.4g} rad/s"
            return f"jacobian has {where}; expected {slope[worst]:.6g}, the difference quotient of the torque"
    return ""


def _check_linear_form(law: FrictionLaw, values: Array, generator: np.random.Generator) -> str:
    """Describe errors of the linear form; "" if there are none."""
    shape = {p.name: float(value) for p, value in zip(law.parameters, values, strict=True) if p.starts}
    basis = law.basis(VELOCITY, shape)
    if basis.ndim != 2 or len(basis) != len(VELOCITY):
        return f"basis has shape {basis.shape}; expected a row for each of {len(VELOCITY)} velocities"
    coefficients = np.asarray(generator.uniform(0.5, 3.0, basis.shape[1]))
    parameters = law.from_linear(coefficients, shape)
    if np.shape(parameters) != values.shape:
        return f"from_linear returns shape {np.shape(parameters)}; expected {values.shape}"
    linear = basis @ coefficients
    if np.abs(law.torque(VELOCITY, parameters) - linear).max() > 1e-9 * (1 + np.abs(linear).max()):
        return "basis and from_linear are not the law: expected torque(v, from_linear(c)) = basis(v) @ c"
    extreme = generator.choice([-1e3, 1e3], basis.shape[1])
    for entry, value in zip(law.parameters, law.from_linear(extreme, shape), strict=True):
        if not entry.lower <= value <= entry.upper:
            return f"from_linear gives {entry.name} = {value:.4g}; expected {entry.lower:g} to {entry.upper:g}"
    return ""
