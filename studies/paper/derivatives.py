"""Fig. 6.2 and 6.3: accelerations by backward and by central differences, and the error from a delay of one sample.

The ideal simulators walk five steps with friction only in the right knee. Without noise, the difference scheme causes
all errors.
"""

from dataclasses import replace

import numpy as np

from stribeck import Settings
from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck.settings import FilterSettings
from stribeck_simulation.run import Simulated
from studies.markdown import markdown_table
from studies.paper.estimate import EXACT, Differences, Estimate, estimate, rms
from studies.paper.study import Numbers
from studies.paper.walks import get_walk

WALKS = ("right-knee-literal", "right-knee-ideal")
NAMES = {"right-knee-literal": "Euler forward", "right-knee-ideal": "positions by the new velocity"}
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
    found = {name: {scheme: _estimate(walk, each) for scheme, each in SCHEMES.items()} for name, walk in walks.items()}
    return {
        "schemes": {name: {scheme: _errors(each) for scheme, each in rows.items()} for name, rows in found.items()},
        "delays": {
            name: {str(delay): _errors(_estimate(_delayed(walk, delay), EXACT)) for delay in DELAYS}
            for name, walk in walks.items()
        },
    }


def _estimate(walk: Simulated, scheme: FilterSettings) -> Estimate:
    return estimate(walk, Settings(filter=scheme, standing_legs=True))


def _errors(found: Estimate) -> dict[str, float]:
    """Compute the RMS error of the right knee during swing and stance, and of all joints [N m]."""
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
    late: RobotLog = replace(log.take(rows - delay), acceleration=_backward(log.position, period)[rows])
    truth = replace(walk.truth, friction_torque=walk.truth.friction_torque[rows - delay])
    return replace(walk, log=late, truth=truth)


def _backward(position: Array, period: float) -> Array:
    """Apply (6.3) twice for a second derivative of the same shape; its first two rows are zero."""
    return np.concatenate([np.zeros((2, position.shape[1])), np.diff(position, n=2, axis=0)]) / period**2


def texts(numbers: Numbers) -> dict[str, str]:
    """Format the errors by scheme and by delay."""
    literal, ideal = (numbers["schemes"][walk] for walk in WALKS)
    rows = [
        (scheme, *(f"{each[scheme][phase]:.2g}" for each in (literal, ideal) for phase in ("swing", "stance")))
        for scheme in SCHEMES
    ]
    late, kept = (numbers["delays"][walk] for walk in WALKS)
    delays = [(d, *(f"{each[d][phase]:.2g}" for each in (late, kept) for phase in ("swing", "stance"))) for d in late]
    head = ("Euler: swings", "Euler: stands", "new velocity: swings", "new velocity: stands")
    return {
        "schemes": markdown_table(("accelerations", *head), rows),
        "delays": markdown_table(("delay of the others", *head), delays),
        **{f"literal-{scheme}-{phase}": f"{literal[scheme][phase]:.2g} N m" for scheme, phase in QUOTED},
        "literal-delayed": f"{late[str(EULER)]['stance']:.2g} N m",
    }
