"""Types that all rooms share."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers in double precision; the docstrings give shapes and units."""

TorqueSource = Literal["link_side_sensor", "motor_side_sensor", "motor_current", "command"]
"""What the log's torque is."""
