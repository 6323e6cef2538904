"""The divergent component of motion (DCM) that leads the centre of mass along a planned zero moment point (ZMP).

With the centre of mass c at a constant height z and w = sqrt(g / z), the DCM is xi = c + c' / w and obeys
`xi' = w (xi - p)` under the ZMP p. It is unstable forwards and stable backwards in time: a plan follows from its end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stribeck.typing import Array


@dataclass(frozen=True, eq=False)
class Stretch:
    """The ZMP goes from one place to another with minimum jerk, or stays, for a time.

    Attributes
    ----------
    duration
        [s]
    start, end
        [m], shape (2,).
    """

    duration: float
    start: Array
    end: Array


def min_jerk(s: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return 10 s^3 - 15 s^4 + 6 s^5 and its five derivatives."""
    return (
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2,
        60 * s * (1 - s) * (1 - 2 * s),
        60 - 360 * s + 360 * s**2,
        -360 + 720 * s,
        np.full_like(s, 720.0),
    )


def plan_dcm(stretches: Sequence[Stretch], pulsation: float, period: float) -> tuple[Array, Array]:
    """Return ZMP and DCM, shape (T, 2) each [m], at every period, by backward recursion over the stretches.

    The polynomial ZMP p of a stretch has the particular solution `sum p^(k) / w^k`; what is missing to the DCM at its
    end decays backwards as exp(w (t - t_end)). The DCM ends at rest over the last ZMP.
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
    """Return the solution of `xi' = w (xi - p)` that is a polynomial, shape (T, 2)."""
    scale = 1 / (pulsation * stretch.duration)
    share = sum(value * scale**k for k, value in enumerate(min_jerk(local / stretch.duration)))
    return np.asarray(stretch.start + np.asarray(share)[:, None] * (stretch.end - stretch.start))
