"""Fig. 6.2 and 6.3: accelerations by backward and by central differences, and what a delay of a sample costs.

Friction in the right knee alone, five steps in the ideal simulators; nothing is noisy, so all error is the scheme's.
"""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from stribeck import Settings
from stribeck.log import RobotLog
from stribeck.settings import FilterSettings
from stribeck.typing import Array
from stribeck_simulation.run import Simulated
from studies.paper import figures
from studies.paper.estimate import EXACT, Estimate, estimate, rms
from studies.paper.markdown import markdown_table
from studies.paper.study import Numbers, Study
from studies.paper.walks import get_walk

WALKS = ("right-knee-literal", "right-knee-ideal")
NAMES = {"right-knee-literal": "Euler forward", "right-knee-ideal": "positions by the new velocity"}
KNEE = "right_knee"
SWINGS, STANDS = "left_foot", "right_foot"
"""Support on which the right leg swings, and stands."""
SCHEMES = {
    "exact": EXACT,
    "central": FilterSettings(kind="central"),
    "backward": FilterSettings(kind="backward", compensate_delay=False),
    "backward, compensated": FilterSettings(kind="backward", compensate_delay=True),
}
DELAYS = (0, 1, 2, 3)
"""Of all other signals against the backward difference [samples]."""
EULER = 2
"""Delay of the backward difference where positions move by the old velocity [samples]."""
QUOTED = (("central", "stance"), ("backward", "stance"), ("backward", "swing"))
"""Errors that pages quote in their sentences."""


def run(quick: bool) -> Study:
    walks = {name: get_walk(name, quick) for name in WALKS}
    found = {name: {scheme: _estimate(walk, each) for scheme, each in SCHEMES.items()} for name, walk in walks.items()}
    numbers = {
        "schemes": {name: {scheme: _errors(each) for scheme, each in rows.items()} for name, rows in found.items()},
        "delays": {
            name: {str(delay): _errors(_estimate(_delayed(walk, delay), EXACT)) for delay in DELAYS}
            for name, walk in walks.items()
        },
    }
    schemes = found["right-knee-literal"]
    late = _estimate(_delayed(walks["right-knee-literal"], EULER), EXACT)
    shown = {"backward": schemes["backward"], "central": schemes["central"], "backward, others delayed": late}

    def over_time(figure: Figure) -> None:
        figure.set_size_inches(6.5, 4.6)
        panels = figure.subplots(2, 1)
        for axes, support in zip(panels, (SWINGS, STANDS), strict=True):
            for k, (scheme, each) in enumerate(shown.items()):
                time, _, torque, _ = _last_step(each, support)
                axes.plot(time, torque, f"C{k}", label=scheme)
            time, _, _, truth = _last_step(schemes["exact"], support)
            axes.plot(time, truth, color=figures.ink(), ls="--", lw=0.9, label="truth")
            axes.set(ylabel="friction torque [N m]", title=f"right leg {'swings' if support == SWINGS else 'stands'}")
        panels[1].set_xlabel("time [s]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)

    def over_velocity(figure: Figure) -> None:
        figure.set_size_inches(6.5, 2.9)
        panels = figure.subplots(1, 3, sharex=True, sharey=True)
        for axes, (scheme, each) in zip(panels, shown.items(), strict=True):
            for k, support in enumerate((STANDS, SWINGS)):
                time, velocity, torque, _ = _knee(each, support)
                label = "right leg stands" if support == STANDS else "right leg swings"
                figures.plot_runs(axes, time, velocity, torque, f"C{1 - k}", label=label)
            _, velocity, _, truth = _knee(schemes["exact"], None)
            order = np.argsort(velocity)
            axes.plot(velocity[order], truth[order], color=figures.ink(), ls="--", lw=0.9, label="truth")
            axes.set(xlabel="velocity [rad/s]", title=scheme)
        panels[0].set_ylabel("friction torque [N m]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)

    return Study(numbers, {"derivatives-time": over_time, "derivatives-velocity": over_velocity})


def _estimate(walk: Simulated, scheme: FilterSettings) -> Estimate:
    return estimate(walk, Settings(filter=scheme, standing_legs=True))


def _errors(found: Estimate) -> dict[str, float]:
    """Return the RMS error of the right knee while its leg swings and stands, and of all joints [N m]."""
    knee = found.column(KNEE)
    return {
        "swing": rms(found.error[found.standing_on(SWINGS), knee]),
        "stance": rms(found.error[found.standing_on(STANDS), knee]),
        "all": rms(found.error),
    }


def _delayed(walk: Simulated, delay: int) -> Simulated:
    """Return the walk with its acceleration a backward difference, and every other signal this many samples late."""
    log = walk.log
    period = float(log.time[1] - log.time[0])
    rows = np.arange(max(DELAYS), len(log.time))
    late: RobotLog = replace(log.take(rows - delay), acceleration=_backward(log.position, period)[rows])
    truth = replace(walk.truth, friction_torque=walk.truth.friction_torque[rows - delay])
    return replace(walk, log=late, truth=truth)


def _backward(position: Array, period: float) -> Array:
    """Return the second derivative by (6.3) twice, of the same shape; its first two rows are zero."""
    return np.concatenate([np.zeros((2, position.shape[1])), np.diff(position, n=2, axis=0)]) / period**2


def _knee(found: Estimate, support: str | None) -> tuple[Array, Array, Array, Array]:
    """Return time, velocity, estimate and truth of the right knee, on one support or on any."""
    rows = slice(None) if support is None else found.standing_on(support)
    column, samples = found.column(KNEE), found.samples
    return (
        samples.time[rows],
        samples.velocity[rows, column],
        samples.friction_torque[rows, column],
        found.truth[rows, column],
    )


def _last_step(found: Estimate, support: str) -> tuple[Array, Array, Array, Array]:
    """Return the same over the last step on a support."""
    values = _knee(found, support)
    begin = np.flatnonzero(np.diff(values[0]) > 1.5 * found.samples.period)
    return tuple(each[begin[-1] + 1 if len(begin) else 0 :] for each in values)  # type: ignore[return-value]


def texts(numbers: Numbers) -> dict[str, str]:
    """Return the errors by scheme and by delay."""
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
