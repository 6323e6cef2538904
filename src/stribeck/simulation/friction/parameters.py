"""Friction parameters by joint and name, checked and laid out as arrays."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.friction import Parameter

Parameters = Mapping[str, Mapping[str, float]]
"""Joint -> parameter -> value."""


def parameter_table(
    joint_names: Sequence[str], law: str, expected: Sequence[Parameter], parameters: Parameters
) -> tuple[NDArray[np.int64], Array]:
    """Arrange parameters as sorted columns of k joints and values, shape (p, k), in the expected order.

    Raises
    ------
    SettingsError
        If a joint or parameter is unknown or missing, or a value is out of bounds; the message names `law`.
    """
    for joint, named in parameters.items():
        if joint not in joint_names:
            raise SettingsError(f"parameters: robot has no joint '{joint}'; it has {', '.join(joint_names)}")
        if set(named) != {parameter.name for parameter in expected}:
            raise SettingsError(
                f"parameters of joint '{joint}': found {', '.join(sorted(named)) or 'none'}; "
                f"law '{law}' has {', '.join(parameter.name for parameter in expected)}"
            )
        for parameter in expected:
            value = named[parameter.name]
            if not (np.isfinite(value) and parameter.lower <= value <= parameter.upper):
                raise SettingsError(
                    f"parameters of joint '{joint}': {parameter.name} is {value}; "
                    f"expected a number from {parameter.lower:g} to {parameter.upper:g}"
                )
    columns = [column for column, joint in enumerate(joint_names) if joint in parameters]
    values = [[parameters[joint_names[column]][parameter.name] for column in columns] for parameter in expected]
    return np.array(columns, dtype=np.int64), np.array(values, dtype=float)
