"""Plan of a walk: standing feet, target of the swing foot, and DCM at every sample.

The divergent component of motion (DCM) leads the center of mass along a planned zero moment point (ZMP). With the
center of mass c at a constant height z and w = sqrt(g / z), the DCM is xi = c + c' / w and obeys `xi' = w (xi - p)`
for the ZMP p. It is unstable forward and stable backward in time, so a plan is computed from its end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.simulation.walking.footsteps import Footprint, Step, Steps, plan_steps


@dataclass(frozen=True, eq=False)
class Stretch:
    """Motion of the ZMP with minimum jerk between two positions, which may be equal.

    Attributes
    ----------
    duration
        Duration [s].
    start, end
        Positions [m], shape (2,).
    """

    duration: float
    start: Array
    end: Array


def min_jerk(s: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Compute 10 s^3 - 15 s^4 + 6 s^5 and its five derivatives."""
    return (
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2,
        60 * s * (1 - s) * (1 - 2 * s),
        60 - 360 * s + 360 * s**2,
        -360 + 720 * s,
        np.full_like(s, 720.0),
    )


def plan_dcm(stretches: Sequence[Stretch], pulsation: float, period: float) -> tuple[Array, Array]:
    """Compute ZMP and DCM, shape (T, 2) each [m], at every sample, by backward recursion over the stretches.

    The polynomial ZMP p of a stretch has the particular solution `sum p^(k) / w^k`. Its difference from the DCM decays
    backward in time as exp(w (t - t_end)). The DCM ends at rest at the last ZMP.
    """
    ends = np.cumsum([stretch.duration for stretch in stretches])
    starts = ends - [stretch.duration for stretch in stretches]
    time = np.arange(round(ends[-1] / period) + 1) * period
    owner = np.minimum(np.searchsorted(ends, time + period / 2), len(stretches) - 1)
    zmp, dcm = np.empty((2, len(time), 2))
    final = stretches[-1].end
    for k in range(len(stretches) - 1, -1, -1):
        stretch = stretches[k]
        rows = np.flatnonzero(owner == k)
        local = time[rows] - starts[k]
        missing = final - _particular(stretch, np.array([stretch.duration]), pulsation)[0]
        decay = np.exp(pulsation * (local - stretch.duration))[:, None]
        zmp[rows] = _zmp(stretch, local)
        dcm[rows] = _particular(stretch, local, pulsation) + decay * missing
        final = _particular(stretch, np.zeros(1), pulsation)[0] + np.exp(-pulsation * stretch.duration) * missing
    return zmp, dcm


def _zmp(stretch: Stretch, local: Array) -> Array:
    share = min_jerk(local / stretch.duration)[0]
    return np.asarray(stretch.start + share[:, None] * (stretch.end - stretch.start))


def _particular(stretch: Stretch, local: Array, pulsation: float) -> Array:
    """Compute the polynomial solution of `xi' = w (xi - p)`, shape (T, 2)."""
    scale = 1 / (pulsation * stretch.duration)
    share = sum(value * scale**k for k, value in enumerate(min_jerk(local / stretch.duration)))
    return np.asarray(stretch.start + np.asarray(share)[:, None] * (stretch.end - stretch.start))


BOTH = -1
"""Value in `swing` if no foot swings."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A walk, sampled at every period of the log.

    Attributes
    ----------
    period
        Period of the log [s].
    zmp, dcm
        ZMP and DCM [m], shape (T, 2).
    swing
        Index of the foot in the air, or `BOTH`, shape (T,).
    progress
        Progress of the swing, 0 to 1, shape (T,); in double support, progress of the weight to the next stance foot.
    step
        Index of the current or next step, shape (T,); the number of steps at the end.
    share
        Share of the weight on each foot, shape (T, 2).
    heading, heading_rate
        Heading [rad] and yaw rate [rad/s] of the base, continuous, the mean of both feet, shape (T,).
    steps
        Steps of the walk.
    """

    period: float
    zmp: Array
    dcm: Array
    swing: NDArray[np.int64]
    progress: Array
    step: NDArray[np.int64]
    share: Array
    heading: Array
    heading_rate: Array
    steps: list[Step]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.zmp)


@dataclass(frozen=True)
class _Phase:
    stretch: Stretch
    swing: int
    step: int
    shares: tuple[float, float]  # share of the weight on foot 0, at start and end
    yaws: tuple[float, float]  # heading of the base at start and end


def plan_walk(walk: Sequence[Steps], feet: tuple[Footprint, Footprint], pulsation: float, period: float = 1e-3) -> Plan:
    """Plan a walk that starts and ends standing.

    Parameters
    ----------
    walk
        Groups of steps in their order.
    feet
        Initial centers of the soles.
    pulsation
        sqrt(g / z) of the center of mass [1/s].
    period
        Period of the log [s].
    """
    steps = plan_steps(walk, feet)
    phases = _phases(walk, steps, feet)
    zmp, dcm = plan_dcm([phase.stretch for phase in phases], pulsation, period)
    ends = np.cumsum([phase.stretch.duration for phase in phases])
    time = np.arange(len(zmp)) * period
    owner = np.minimum(np.searchsorted(ends, time + period / 2), len(phases) - 1)
    duration = np.array([phase.stretch.duration for phase in phases])
    progress = np.clip((time - (ends - duration)[owner]) / duration[owner], 0.0, 1.0)
    shares = np.array([phase.shares for phase in phases])[owner]
    first = shares[:, 0] + progress * (shares[:, 1] - shares[:, 0])
    yaws = np.array([phase.yaws for phase in phases])[owner]
    turned, rate, *_ = min_jerk(progress)
    heading = yaws[:, 0] + turned * (yaws[:, 1] - yaws[:, 0])
    heading_rate = rate / duration[owner] * (yaws[:, 1] - yaws[:, 0])
    return Plan(
        period,
        zmp,
        dcm,
        np.array([phase.swing for phase in phases])[owner],
        progress,
        np.array([phase.step for phase in phases])[owner],
        np.column_stack([first, 1 - first]),
        heading,
        heading_rate,
        steps,
    )


def _phases(walk: Sequence[Steps], steps: list[Step], feet: tuple[Footprint, Footprint]) -> list[_Phase]:
    """Compute standing, then double and single support of each step, then standing."""
    now, share = list(feet), 0.5
    zmp, yaw = _middle(now)
    phases: list[_Phase] = []

    def shift(duration: float, to: Array, carried: float, number: int) -> None:
        nonlocal zmp, share
        phases.append(_Phase(Stretch(duration, zmp, to), BOTH, number, (share, carried), (yaw, yaw)))
        zmp, share = to, carried

    kind: Steps | None = None
    pending = list(walk)
    for number, step in enumerate(steps):
        if step.kind is not kind:
            if kind is not None:
                shift(2 * kind.double_support, _middle(now)[0], 0.5, number)
            while kind is not step.kind:
                kind = pending.pop(0)
                shift(kind.stand, zmp, 0.5, number)
        shift(kind.double_support, step.stance.place, float(step.foot == 1), number)
        now[step.foot] = step.goal
        turned = _middle(now)[1]
        stay = Stretch(kind.single_support, zmp, zmp)
        phases.append(_Phase(stay, step.foot, number, (share, share), (yaw, turned)))
        yaw = turned
    if kind is not None:
        shift(2 * kind.double_support, _middle(now)[0], 0.5, len(steps))
    for kind in pending:
        shift(kind.stand, zmp, 0.5, len(steps))
    shift(1.0, zmp, 0.5, len(steps))  # 1 s on both feet at the end
    return phases


def _middle(feet: list[Footprint]) -> tuple[Array, float]:
    """Compute the point half way between two feet and their mean heading."""
    return (feet[0].place + feet[1].place) / 2, (feet[0].yaw + feet[1].yaw) / 2
