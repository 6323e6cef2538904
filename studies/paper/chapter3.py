"""Chapter 3: all friction laws, and errors near standstill of a smoothed sign."""

from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq, minimize_scalar

from studies.paper import law_figures
from studies.paper.laws import KNEE, SLOPE, STATIC, curve
from studies.paper.study import Numbers

WALKS = ()
SLOPES = (10.0, 20.0, 40.0, 100.0, 300.0, 1000.0)
"""Slopes of the smooth law [s/rad]."""
TOLERANCE = 0.05
"""Tolerated difference between the smooth law and the jump, relative to Coulomb friction [1]."""


def smoothing(slope: float) -> dict[str, float]:
    """Compare the law of a slope [s/rad] with the law that jumps, both without viscous friction.

    Below the speed `band` [rad/s], the smooth law deviates from the jump by more than `TOLERANCE` times Fc. `kept` is
    the share of the Stribeck excess S Fc that remains at the smooth law's peak.
    """

    def smooth(v: float) -> float:
        return float(curve("stribeck", np.array([v]), slope=slope, viscous=0.0)[0])

    def missing(v: float) -> float:
        return float(curve("stribeck-exponent", np.array([v]), viscous=0.0)[0]) - smooth(v)

    Fc, vs = KNEE["coulomb"], KNEE["stribeck_velocity"]
    peak = minimize_scalar(lambda v: -smooth(v), bounds=(0.0, 3 * vs), method="bounded", options={"xatol": 1e-9})
    return {
        "band": float(brentq(lambda v: missing(v) - TOLERANCE * Fc, 1e-6, 1e2)),
        "kept": max(-float(peak.fun) - Fc, 0.0) / (STATIC - Fc),
    }


def run(quick: bool) -> Numbers:  # noqa: ARG001 - it takes seconds
    return {"smoothing": {f"{slope:g}": smoothing(slope) for slope in SLOPES}}


def drawings(_: Numbers) -> dict[str, Callable[[Figure], None]]:
    """Draw the laws."""
    return {
        **{f"law-{law}": partial(law_figures.draw_curves, law=law) for law in law_figures.CURVES},
        "laws": law_figures.overview,
        "law-lugre": law_figures.lugre_loops,
    }


def texts(numbers: Numbers) -> dict[str, str]:
    found = numbers["smoothing"]
    return {
        "band": f"{found[f'{SLOPE:g}']['band']:.3f} rad/s",
        "kept": f"{100 * found[f'{SLOPE:g}']['kept']:.0f} %",
        "kept-least": f"{100 * found['10']['kept']:.0f} %",
    }
