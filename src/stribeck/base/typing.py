"""Types that all rooms share."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double-precision array; docstrings state shapes and units."""

TorqueSource = Literal["link_side_sensor", "motor_side_sensor", "motor_current", "command"]
"""Source of the log's torque."""
