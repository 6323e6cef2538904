"""How a law does on blocks of samples that its fit did not see."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from stribeck.friction import FrictionLaw
from stribeck.identification.curve_fit.problem import FitProblem, hold_out, joint_problem
from stribeck.identification.joint_fit import JointFit
from stribeck.result import Validation
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.typing import Array


def validate(
    fits: Mapping[str, JointFit], samples: Samples, law: FrictionLaw, settings: Settings
) -> dict[str, Validation | None]:
    """Return how each joint's fit does on the blocks that `fit_law` held out, None without any."""
    found: dict[str, Validation | None] = {}
    for joint, fit in fits.items():
        training, unseen = hold_out(joint_problem(samples, joint, law, settings), settings.holdout)
        found[joint] = validate_values(fit.values, training, unseen) if len(unseen.velocity) else None
    return found


def held_out(fits: Mapping[str, JointFit], samples: Samples, law: FrictionLaw, settings: Settings) -> NDArray[np.bool_]:
    """Return which samples of each joint lie in the blocks that `fit_law` held out, shape (N, n)."""
    found = np.zeros(samples.usable.shape, dtype=bool)
    for joint in fits:
        _, unseen = hold_out(joint_problem(samples, joint, law, settings), settings.holdout)
        found[:, samples.joint_names.index(joint)] = np.isin(samples.block, unseen.block)
    return found


def validate_values(values: Array, training: FitProblem, unseen: FitProblem) -> Validation:
    """Compare the law on unseen blocks with no friction at all, and with Coulomb and offset of the training blocks.

    `values` are those of the problems' parameters, shape (p,).
    """
    coefficients, *_ = np.linalg.lstsq(_coulomb_basis(training), training.friction_torque)
    return Validation(
        rms=_rms(unseen.friction_torque - unseen.predict(values)),
        rms_zero_friction=_rms(unseen.friction_torque),
        rms_coulomb_only=_rms(unseen.friction_torque - _coulomb_basis(unseen) @ coefficients),
    )


def _coulomb_basis(problem: FitProblem) -> Array:
    return np.column_stack([np.sign(problem.velocity), np.ones_like(problem.velocity)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
