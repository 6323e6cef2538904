"""Wrenches that a rectangular sole can press on the ground with, as linear inequalities."""

import numpy as np

from stribeck.typing import Array
from stribeck_simulation.robots.sole import Sole


def wrench_cone(sole: Sole, friction: float, margin: float = 0.9) -> Array:
    """Return G with `G w <= 0` for every wrench w that a sole can bear without slipping or tipping.

    The closed form of Caron, Pham and Nakamura, "Stability of surface contacts for humanoid robots" (ICRA 2015): four
    rows for the friction pyramid, four for the centre of pressure, eight for the yaw moment.

    Parameters
    ----------
    sole
        Its half length X and half width Y; the wrench is taken at its centre.
    friction
        Coefficient; the pyramid is inside the cone.
    margin
        Share of the rectangle that is used.

    Returns
    -------
    G
        Shape (16, 6), of force then moment in the sole's frame.
    """
    X, Y, mu = margin * sole.half_length, margin * sole.half_width, friction / np.sqrt(2)
    rows = [[-1, 0, -mu, 0, 0, 0], [1, 0, -mu, 0, 0, 0], [0, -1, -mu, 0, 0, 0], [0, 1, -mu, 0, 0, 0]]
    rows += [[0, 0, -Y, -1, 0, 0], [0, 0, -Y, 1, 0, 0], [0, 0, -X, 0, -1, 0], [0, 0, -X, 0, 1, 0]]
    bound = -(X + Y) * mu
    for a in (-1, 1):
        for b in (-1, 1):
            rows.append([a * Y, b * X, bound, -a * mu, -b * mu, -1])  # -tz + |Y fx - mu tx| + |X fy - mu ty|
            rows.append([a * Y, b * X, bound, a * mu, b * mu, 1])  # tz + |Y fx + mu tx| + |X fy + mu ty|
    return np.array(rows, dtype=float)
