"""Offsets that differ from log to log: torque sensors are zeroed when they start, and drift with temperature."""

from dataclasses import replace

import numpy as np

from stribeck.whole_log.weak_equations import WeakEquations, contrasts_of_logs


def with_log_offsets(plain: WeakEquations, log: int, shape: tuple[int, int]) -> WeakEquations:
    """Return equations with regressors for the contrasts of offsets between logs, which act like constant friction.

    Parameters
    ----------
    plain
        With the regressors of all else.
    log
        Number of the log.
    shape
        Number of contrasts, and of joints that are no couplings; nothing is added for no contrasts.
    """
    if not shape[0]:
        return plain
    own = contrasts_of_logs(shape[0] + 1)[:, log]
    columns = (own[:, None] * plain.weights[:, :, None, : shape[1]]).reshape(*plain.residual.shape, -1)
    before = [] if plain.regressors is None else [plain.regressors]
    return replace(plain, regressors=np.concatenate([*before, columns], axis=2))
