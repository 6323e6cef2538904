"""The truth of a simulation, put beside what was found, for the report alone."""

import numpy as np

from stribeck.friction import FrictionLaw
from stribeck.report import Reference
from stribeck.result import Result
from stribeck.typing import Array
from stribeck_simulation.friction.parameters import Parameters

NEAR = (1e-4, 0.1)
"""From where to where these lie, as shares of the largest speed."""


def truth_reference(result: Result, law: FrictionLaw, parameters: Parameters) -> Reference:
    """Return the truth as the report shows it beside a result.

    Parameters
    ----------
    result
        Says over which velocities joints moved.
    law, parameters
        The friction that was simulated; its values stand beside the found ones if the same law was fitted.
    """
    curves = {}
    for joint, values in parameters.items():
        if joint in result.joints:
            velocity = _velocities(*result.joints[joint].velocity_range)
            ordered = np.array([values[parameter.name] for parameter in law.parameters])
            curves[joint] = (velocity, law.torque(velocity, ordered))
    known = {joint: dict(values) for joint, values in parameters.items()} if law.name == result.law else {}
    return Reference(name="the simulated truth", curves=curves, parameters=known)


def _velocities(low: float, high: float) -> Array:
    """Return velocities from low to high, dense about zero [rad/s]."""
    reach = max(abs(low), abs(high))
    # of a truth curve on either side of rest, where friction turns
    near = np.geomspace(NEAR[0] * reach, NEAR[1] * reach, 60)
    # of a truth curve over the whole range of velocities
    velocities = np.concatenate([np.linspace(low, high, 201), -near, near, [0.0]])
    return np.unique(velocities[(velocities >= low) & (velocities <= high)])
