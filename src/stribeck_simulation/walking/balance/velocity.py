"""The joint velocities that the tasks want: inverse kinematics, in which no measured velocity has a part."""

from collections.abc import Sequence

import numpy as np

from stribeck.typing import Array
from stribeck_simulation.walking.balance.qp import BASE, Task
from stribeck_simulation.walking.balance.terms import FootState


def desired_velocity(standing: Sequence[FootState], tasks: Sequence[Task]) -> Array:
    """Return the joint velocities that the tasks want while the standing feet rest [rad/s], shape (n,).

    `J_k v = velocity_k` and `J_c v = 0` by damped least squares; the base's velocity is eliminated by the first
    standing foot's rest.

    Parameters
    ----------
    standing
        Feet that stand, one or two.
    tasks
        What should move.
    """
    root, others = standing[0], standing[1:]
    jacobian = np.concatenate([*(task.jacobian for task in tasks), *(foot.jacobian for foot in others)])
    wanted = np.concatenate([*(task.velocity for task in tasks), np.zeros(BASE * len(others))])
    reduced = jacobian[:, BASE:] - jacobian[:, :BASE] @ root.to_base @ root.jacobian[:, BASE:]
    # weight of joints at rest [m^2] beside the tasks: with it arms rest, and a stretched knee stays slow
    return np.linalg.solve(reduced.T @ reduced + 1e-3**2 * np.eye(reduced.shape[1]), reduced.T @ wanted)
