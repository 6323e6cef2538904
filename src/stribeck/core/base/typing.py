"""Types that all rooms share."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double-precision array; docstrings state shapes and units."""

BoolArray = NDArray[np.bool_]
"""Array of flags, often a mask of samples or joints."""

IntArray = NDArray[np.int64]
"""Array of integers, often indices of rows, columns or joints."""

TorqueSource = Literal["link_side_sensor", "motor_side_sensor", "motor_current", "command"]
"""Source of the log's torque."""
