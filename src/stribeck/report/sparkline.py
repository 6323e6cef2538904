"""A fitted law as a thumbnail for a table's cell: its shape at a glance."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from stribeck.friction.law import FrictionLaw
from stribeck.typing import Array

SIZE = (104.0, 30.0)
"""Width and height [SVG units, about a pixel each]."""

POINTS = 121
"""Points of the curve: about one a pixel."""


def sparkline(law: FrictionLaw, values: Array, velocity_range: tuple[float, float]) -> Markup:
    """Return the law over the velocities that the joint had, scaled to fill; values of shape (p,)."""
    velocity = np.linspace(*velocity_range, POINTS)
    torque = law.torque(velocity, values)
    width, height = SIZE
    reach = max(float(np.abs(torque).max()), 1e-12)
    x = np.linspace(1, width - 1, POINTS)
    y = height / 2 - torque / reach * (height / 2 - 2)
    curve = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    standstill = float(np.interp(0.0, velocity, x))
    return Markup(
        f'<svg class="sparkline" viewBox="0 0 {width:.0f} {height:.0f}" aria-hidden="true">'
        f'<path class="zero" d="M0 {height / 2:.1f}H{width:.0f}M{standstill:.1f} 0V{height:.0f}"/>'
        f'<polyline points="{curve}"/></svg>'
    )
