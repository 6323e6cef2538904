"""Interval in which the friction curve of another log of the robot is expected."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.friction import FrictionLaw
from stribeck.core.judgement.curve import ROUNDING
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.result import CurvePoint, JointResult
from stribeck.core.result.log_spread import learn_spread
from stribeck.core.result.samples import FrictionSamples


def with_next_log(
    joints: Mapping[str, JointResult],
    samples: Sequence[FrictionSamples],
    fits: Mapping[str, JointFit],
    law: FrictionLaw,
    removed: Mapping[str, Sequence[float]],
) -> dict[str, JointResult]:
    """Add `interval_next_log` to the curves of all joints, given the friction samples of each of the N logs.

    It contains 95 % of the differences of one log from the mean of N logs, with the spread learned from the N logs; one
    log has the spread of public robots. Only a share of the result's own error differs from log to log, because errors
    of the model repeat; the interval contains `interval_95`.

    Parameters
    ----------
    joints, fits, law
        Results and fits of the joints, and their law.
    samples
        Friction torque of each log.
    removed
        Friction of each log relative to the mean, minus one [1], which the samples no longer contain, by joint.
    """
    from scipy.linalg import helmert

    names, count = [name for name, joint in joints.items() if joint.curve and name in fits], len(samples)
    if not names:
        return dict(joints)
    levels = np.array([[_levels(log, joints[name].curve, name, fits[name], law) for name in names] for log in samples])
    levels += np.reshape([removed.get(name, np.zeros(count)) for name in names], (-1, count, 1)).swapaxes(0, 1)
    levels = levels.reshape(count, -1)  # (logs, joints and speeds)
    contrasts = helmert(count) @ levels if count > 1 else np.full(levels.shape, np.nan)  # with the variance of one log
    spread = learn_spread(contrasts, 0 * contrasts, np.arange(levels.shape[1]) // 3, count=1.0)
    halves = [spread.quantile(channel, 0.05, 0.0, 1 + 1 / count) for channel in range(levels.shape[1])]
    shares = dict(zip(names, np.reshape(halves, (-1, 3)).tolist(), strict=True))
    return {
        name: replace(joint, curve=tuple(map(_point, joint.curve, shares[name]))) if name in shares else joint
        for name, joint in joints.items()
    }


def _levels(samples: FrictionSamples, curve: Sequence[CurvePoint], name: str, fit: JointFit, law: FrictionLaw) -> Array:
    """Compute how much friction of one log differs from the fit at each speed of a curve [1], shape (3,).

    The torque that the fit does not explain is that of Coulomb friction, viscous friction and an offset.
    """
    column = samples.joint_names.index(name)
    valid = samples.usable[:, column] & np.isfinite(samples.friction_torque[:, column])
    if len(np.unique(samples.block[valid])) < 3:  # as many as columns
        return np.full(len(curve), np.nan)
    velocity = samples.velocity[valid, column]
    unexplained = samples.friction_torque[valid, column] - law.torque(velocity, fit.law_values(law, fit.mean_load))
    columns = np.stack([np.sign(velocity), velocity, np.ones_like(velocity)], axis=1)
    coulomb, viscous, _ = np.linalg.pinv(columns.T @ columns) @ columns.T @ unexplained
    return np.array([(coulomb + viscous * point.velocity) / max(point.value, ROUNDING) for point in curve])


def _point(point: CurvePoint, share: float) -> CurvePoint:
    """Add the interval for the next log, whose half-width relative to the value is a share [1]."""
    differs = 0.3  # share of a log's error that differs from log to log, of public robots [1]
    half = max(point.half_width, float(np.hypot(differs * point.half_width, share * point.value)))
    return replace(point, interval_next_log=(max(point.value - half, 0.0), point.value + half))
