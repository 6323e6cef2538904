"""Fig. 6.2 and 6.3: accelerations by backward and by central differences, and the error from a delay of one sample.

The ideal simulators walk five steps with friction only in the right knee. Without noise, the difference scheme causes
all errors.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings
from stribeck.simulation.run import Simulated
from studies.paper.estimate import EXACT, Differences, estimate, rms
from studies.paper.study import Numbers
from studies.paper.walks import get_walk

WALKS = ("right-knee-literal", "right-knee-ideal")
KNEE = "right_knee"
SWINGS, STANDS = "left_foot", "right_foot"
"""Support while the right leg swings, and while it stands."""
SCHEMES = {
    "exact": EXACT,
    "central": Differences(scheme="central"),
    "backward": Differences(scheme="backward"),
    "backward, compensated": Differences(scheme="backward, compensated"),
}
DELAYS = (0, 1, 2, 3)
"""Delays of all other signals relative to the backward difference [samples]."""
EULER = 2
"""Delay of the backward difference if the simulator integrates positions by forward Euler [samples]."""
QUOTED = (("central", "stance"), ("backward", "stance"), ("backward", "swing"))
"""Errors quoted in sentences."""


def run(quick: bool) -> Numbers:
    walks = {name: get_walk(name, quick) for name in WALKS}
    return {
        "schemes": {
            name: {scheme: _errors(walk, each) for scheme, each in SCHEMES.items()} for name, walk in walks.items()
        },
        "delays": {
            name: {str(delay): _errors(_delayed(walk, delay), EXACT) for delay in DELAYS}
            for name, walk in walks.items()
        },
    }


def _errors(walk: Simulated, scheme: FilterSettings) -> dict[str, float]:
    """Compute the RMS error of the right knee during swing and stance, and of all joints [N m]."""
    found = estimate(walk, Settings(filter=scheme, standing_legs=True))
    knee = found.column(KNEE)
    return {
        "swing": rms(found.error[found.standing_on(SWINGS), knee]),
        "stance": rms(found.error[found.standing_on(STANDS), knee]),
        "all": rms(found.error),
    }


def _delayed(walk: Simulated, delay: int) -> Simulated:
    """Replace a walk's acceleration by a backward difference, and delay all other signals by `delay` samples."""
    log = walk.log
    period = float(log.time[1] - log.time[0])
    rows = np.arange(max(DELAYS), len(log.time))
    # (6.3) twice; its first two rows are missing
    backward = np.concatenate([np.zeros_like(log.position[:2]), np.diff(log.position, n=2, axis=0)]) / period**2
    late: RobotLog = replace(log.take(rows - delay), acceleration=backward[rows])
    truth = replace(walk.truth, friction_torque=walk.truth.friction_torque[rows - delay])
    return replace(walk, log=late, truth=truth)


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the errors by scheme and by delay."""
    schemes, delays = (numbers[key][WALKS[0]] for key in ("schemes", "delays"))
    return {
        **{f"literal-{scheme}-{phase}": f"{schemes[scheme][phase]:.2g} N m" for scheme, phase in QUOTED},
        "literal-delayed": f"{delays[str(EULER)]['stance']:.2g} N m",
    }
