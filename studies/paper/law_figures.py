"""Drawings of the laws of Chapter 3."""

from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stribeck.core.base.typing import Array
from stribeck.core.friction import LAWS
from studies.paper import figures
from studies.paper.laws import SLOPE, STATIC, STEP, curve, lugre, speeds

VELOCITY, TORQUE = "velocity [rad/s]", "friction torque [N m]"
POINTS = 400
"""Number of points of a LuGre curve."""
Curve = tuple[str, str, str, dict[str, Any]]
"""Law, label, color and line style, and changed parameters of a curve."""


@cache
def turns(amplitude: float, rate: float, count: float) -> tuple[Array, Array, Array]:
    """Compute position [rad], velocity [rad/s] and LuGre torque [N m] of a joint with a sinusoidal velocity.

    Parameters
    ----------
    amplitude, rate, count
        Velocity amplitude [rad/s], frequency [Hz], number of periods [1].
    """
    phase = 2 * np.pi * rate * np.arange(0.0, count / rate, STEP)
    velocity = amplitude * np.sin(phase)
    position = amplitude / (2 * np.pi * rate) * (1 - np.cos(phase))
    every = slice(None, None, len(phase) // POINTS)
    return position[every], velocity[every], lugre(velocity)[every]


def draw_law(axes: Axes, law: str, label: str = "", style: str = "C0-", **changes: float) -> None:
    """Draw a law with the knee's parameters and some changes; laws with a jump have a gap at standstill."""
    x = speeds()
    y = curve(law, x, **changes)
    if LAWS[law].jumps:
        x, y = np.insert(x, len(x) // 2, 0.0), np.insert(y, len(y) // 2, np.nan)
    axes.plot(x, y, color=style[:2], ls=style[2:], label=label)


STEADY: Curve = ("coulomb-viscous", "only Coulomb and viscous", "C5:", {})
"""Curve without a Stribeck effect, for comparison."""
CURVES: dict[str, list[Curve]] = {
    "coulomb-viscous": [
        ("coulomb-viscous", "Coulomb and viscous", "C0-", {}),
        ("coulomb-viscous", "with an offset of 0.3 N m", "C1-", {"offset": 0.3}),
        ("coulomb-viscous", "only Coulomb", "C2--", {"viscous": 0.0}),
        ("coulomb-viscous", "only viscous", "C3:", {"coulomb": 0.0}),
    ],
    "stribeck": [
        ("stribeck", f"slope a = {SLOPE:g} s/rad", "C0-", {}),
        ("stribeck", "a = 10 s/rad", "C1--", {"slope": 10.0}),
        ("stribeck", "a = 200 s/rad", "C2--", {"slope": 200.0}),
        STEADY,
    ],
    "stribeck-exponent": [
        *(
            ("stribeck-exponent", f"exponent delta = {delta:g}", style, {"exponent": delta, "stribeck_gain": 1.0})
            for style, delta in {"C0-": 2.0, "C1--": 0.5, "C2--": 1.0, "C3--": 6.0}.items()
        ),
        STEADY,
    ],
    "asymmetric": [
        ("asymmetric", "Fc- = 1.3 Fc+,  Fv- = 2 Fv+", "C0-", {"viscous_negative": 0.4, "coulomb_negative": 1.3}),
        ("coulomb-viscous", "equal in both directions", "C5:", {}),
    ],
}
"""Curves of each law's figure."""


def draw_curves(figure: Figure, law: str) -> None:
    """Draw the figure of a law."""
    axes = figure.subplots()
    for name, label, style, changes in CURVES[law]:
        draw_law(axes, name, label, style, **changes)
    if law == "stribeck-exponent":
        axes.set(xlim=(-0.05, 1.05), ylim=(0.9, 2.1))
    axes.set(xlabel=VELOCITY, ylabel=TORQUE)
    figure.legend(loc="outside right center")


def overview(figure: Figure) -> None:
    """Draw the paper's laws one by one, in its order."""
    figure.set_size_inches(6.5, 4.2)
    grid = figure.subplots(2, 3, sharex=True, sharey=True)
    shown: dict[str, tuple[str, dict[str, Any]]] = {
        "Coulomb": ("coulomb-viscous", {"viscous": 0.0}),
        "viscous": ("coulomb-viscous", {"coulomb": 0.0}),
        "Coulomb with static": ("coulomb-viscous", {"viscous": 0.0}),
        "Stribeck": ("stribeck-exponent", {"viscous": 0.0}),
        "continuous Stribeck": ("stribeck", {}),
    }
    for axes, (title, (law, changes)) in zip(grid.flat, shown.items(), strict=False):
        draw_law(axes, law, **changes)
        axes.set_title(title)
    grid[0, 2].plot([0.0, 0.0], [-STATIC, STATIC], "C1", marker="_", markersize=6)
    grid[1, 2].plot(*turns(amplitude=1.0, rate=1.0, count=2.0)[1:])
    grid[1, 2].set_title("LuGre at 1 Hz")
    figure.supxlabel(VELOCITY, fontsize=9)
    figure.supylabel(TORQUE, fontsize=9)


def lugre_loops(figure: Figure) -> None:
    """Draw presliding versus position, and hysteresis versus velocity."""
    left, right = figure.subplots(1, 2, sharey=True)
    for turn in (0.04, 0.006):  # amplitude of the motion [rad]
        position, _, torque = turns(amplitude=np.pi * turn, rate=1.0, count=3.0)
        left.plot(1e3 * position, torque)
    left.set(xlabel="position [mrad]", ylabel=TORQUE, title="back and forth by 40 and 6 mrad")
    for rate in (0.2, 2.0):
        _, velocity, torque = turns(amplitude=0.5, rate=rate, count=1.5)
        settled = slice(len(torque) // 3, None)
        right.plot(velocity[settled], torque[settled], label=f"{rate:g} Hz")
    x = speeds()
    x = x[np.abs(x) <= 0.5]
    y = curve("stribeck-exponent", x)
    middle = len(x) // 2
    right.plot(np.insert(x, middle, 0), np.insert(y, middle, np.nan), color=figures.ink(), ls=":", label="steady")
    right.set(xlabel=VELOCITY, title="the same law versus velocity")
    right.legend()
