"""Comparison of torques with the model: swapped joints, unsigned torques, signs, and unexplained torques."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from stribeck.check.audit.channels import unmeasured
from stribeck.check.audit.evidence import LEAST_BINS, AuditData
from stribeck.check.audit.regression import GainFit, fit, friction_shapes, unexplained, without
from stribeck.check.audit.scale import BINS_FOR_GAIN, NEAR, SURE, check_scales, judged
from stribeck.check.audit.units import FAR, MOST, concerns_most
from stribeck.core.base.finding import Finding, listed
from stribeck.core.base.typing import Array
from stribeck.core.robot.scale_setting import scale_setting


def check_torques(evidence: AuditData, left_out: Collection[str] = ()) -> list[Finding]:
    """Report swapped joints, wrong signs and wrong scales; joints that are omitted have been reported."""
    if len(evidence.rows) < LEAST_BINS:
        return []
    joints = [k for k, name in enumerate(evidence.joints) if name not in left_out]
    swapped = _swapped(evidence, joints)
    names = {name for finding in swapped for name in finding.joints}
    joints = [k for k in joints if evidence.joints[k] not in names]
    every = {k: estimate for k in joints if (estimate := fit(evidence, k)) is not None}
    largest = max((estimate.swing for estimate in every.values()), default=0.0)
    if dead := [evidence.joints[k] for k, estimate in every.items() if _only_noise(evidence, k, estimate, largest)]:
        noise = Finding.of("channel-dead.noise", dead, channel="torque", settings=[unmeasured(evidence.robot, dead)])
        return [noise, *check_torques(evidence, [*left_out, *dead])]
    fits = {k: estimate for k, estimate in every.items() if judged(estimate, largest)}
    fits = fits if fits or len(every) < 2 else _enlarged(every)
    signed = {k: estimate for k, estimate in fits.items() if estimate.gain > 0 or _opposite(estimate)}
    return [*swapped, *_signs(evidence, fits, joints), *check_scales(evidence, signed, joints)]


def _enlarged(every: dict[int, GainFit]) -> dict[int, GainFit]:
    """Replace gains, each hidden by disturbances, by their weighted mean; empty unless no model is wrong by as much."""
    gains, errors = np.array([(e.gain, e.error + 1e-9) for e in every.values()]).T
    error = float(np.sum(errors**-2.0) ** -0.5)
    gain = float(np.sum(gains / errors**2)) * error**2
    return {k: replace(e, gain=gain, error=error) for k, e in every.items() if gain > max(FAR**2, SURE * error)}


def _only_noise(evidence: AuditData, k: int, estimate: GainFit, largest: float) -> bool:
    """Whether a torque hardly varies, and not with the model's large variation: with a wrong unit it does."""
    small = evidence.torque[:, k].std() < 0.05 * estimate.swing
    return bool(small and estimate.share < 0.5 and estimate.swing > 0.1 * largest)


def check_unexplained(evidence: AuditData, left_out: Collection[str] = ()) -> list[Finding]:
    """Report torques that the model fails to explain, for example because whole joints are exchanged.

    A joint carries a load if the model's torque varies by half of the measured one, in standard deviations.
    """
    joints = [k for k, name in enumerate(evidence.joints) if name not in left_out]
    known = {k: np.isfinite(evidence.model[:, k]) for k in joints}
    carrying = {
        k: unexplained(evidence, k, 1.0)
        for k, rows in known.items()
        if rows.sum() >= BINS_FOR_GAIN and evidence.model[rows, k].std() > 0.5 * evidence.torque[rows, k].std() > 0
    }
    alien = {k: share for k, share in carrying.items() if share > 0.5}
    if len(alien) < max(2, MOST * len(carrying)):
        return []
    percentage = _percent(float(np.median(list(alien.values()))))
    names = [evidence.joints[k] for k in alien]
    return [Finding.of("torque-unexplained", names, count=len(carrying), left=percentage)]


def _opposite(estimate: GainFit) -> bool:
    """Whether both model and friction indicate the other sign, or the model overwhelmingly."""
    return estimate.gain < -SURE * estimate.error and (
        estimate.dissipation < -0.5
        or estimate.friction < estimate.residual
        or abs(estimate.gain) * estimate.swing > 3 * estimate.friction
    )


def _signs(evidence: AuditData, fits: dict[int, GainFit], joints: list[int]) -> list[Finding]:
    """Report torques that model and friction explain far better with the other sign.

    The better sign must leave less than 40 % of the variance, and less than 20 % of the variance left by the other
    sign.
    """
    shares = {k: (unexplained(evidence, k, 1.0), unexplained(evidence, k, -1.0)) for k in joints}
    agreeing = {k for k, (same, other) in shares.items() if same < min(0.4, 0.2 * other)}
    opposite = {k for k, (same, other) in shares.items() if other < min(0.4, 0.2 * same)}
    if len(evidence.rows) < BINS_FOR_GAIN:
        opposite = {k for k in opposite if k in fits}  # friction may look like its opposite for a short time
    opposite |= {k for k, estimate in fits.items() if _opposite(estimate)} - agreeing
    if not opposite:
        return []
    names = [evidence.joints[k] for k in sorted(opposite)]
    most = concerns_most(len(opposite), len(opposite | agreeing | set(fits)), joints)
    same, other = (_percent(float(np.median([shares[k][side] for k in opposite]))) for side in (0, 1))
    if evidence.prepared.log.command is not None:  # it has no scale
        return [Finding.of("torque-sign.command", names, stops=most, same=same, other=other)]
    inverted = evidence.joints if most and len(joints) > 1 and not agreeing else names
    setting = scale_setting(evidence.robot, dict.fromkeys(inverted, -1.0))
    return [Finding.of("torque-sign", names, stops=most, same=same, other=other, settings=[setting])]


def _percent(share: float) -> str:
    return f"{100 * share:.2g}" if share < 1 else f"{100 * share:.0f}"


def check_unsigned(evidence: AuditData, left_out: Collection[str] = ()) -> list[Finding]:
    """Report torques that never change their sign although the motion requires it."""
    joints = [k for k, name in enumerate(evidence.joints) if name not in left_out]
    negated = [evidence.joints[k] for k in joints if _negated_one_way(evidence, k)]
    agreeing = sum(unexplained(evidence, k, 1.0) < 0.2 for k in joints) if negated else 0
    if negated and agreeing >= min(len(negated), len(joints) - 1):  # otherwise joints may be exchanged
        most = concerns_most(len(negated), len(joints), evidence.joints)
        finding = Finding.of("torque-unsigned.direction", negated, stops=most)
        return [finding, *check_unsigned(evidence, [*left_out, *negated])]
    torque = evidence.prepared.log.torque[:, evidence.robot.torque_controlled[joints]]
    if len(joints) > 2 and (torque.min() >= 0 or torque.max() <= 0) and np.all(torque.std(axis=0) > 0):
        return [Finding.of("torque-unsigned", [evidence.joints[k] for k in joints], stops=True)]
    one_sided = [k for k in joints if _touches_zero(evidence, k)]
    sure = [k for k in one_sided if _folded(evidence, k)]
    active = [k for k in joints if evidence.moves(k)]
    if len(one_sided) >= max(3, 0.8 * len(active)):
        sure = one_sided
    if not sure:
        return []
    most = len(sure) >= max(2, MOST * len(active))
    return [Finding.of("torque-unsigned", [evidence.joints[k] for k in sure], stops=most)]


def _touches_zero(evidence: AuditData, k: int) -> bool:
    """Whether a moving joint's torque approaches zero from one side three times, and exceeds 2 % only on that side."""
    if not evidence.moves(k):
        return False
    torque = evidence.prepared.log.torque[:, evidence.robot.torque_controlled[k]]
    size = np.abs(torque)
    most = float(np.percentile(size, 99))
    if most == 0 or (torque.min() < -0.02 * most and torque.max() > 0.02 * most):
        return False
    near = size < 0.1 * most
    return int(np.count_nonzero(near[1:] & ~near[:-1])) >= 3


def _folded(evidence: AuditData, k: int) -> bool:
    """Whether the absolute value of the model's torque explains a torque better than the signed value."""
    model, torque = np.abs(evidence.model[:, k]), np.abs(evidence.torque[:, k])
    plain, folded = fit(evidence, k), fit(evidence, k, model=model, torque=torque)
    if plain is None or folded is None:
        return False
    return folded.share > 0.6 and 0.5 < folded.gain < 2 and folded.residual < 0.7 * plain.residual


def _negated_one_way(evidence: AuditData, k: int) -> bool:
    """Whether model and friction explain a torque far better if it is inverted in one direction of motion."""
    rows = np.isfinite(evidence.model[:, k])
    if rows.sum() < LEAST_BINS or not evidence.moves(k):
        return False
    load = evidence.model[rows, k].std()
    if not load / 3 < evidence.torque[rows, k].std() < 3 * load:
        return False  # friction or a wrong unit dominates
    slow = np.abs(evidence.velocity[:, k]) < 0.1 * evidence.top_speed[k]  # bins may contain a reversal
    signs = np.where(slow, 0.0, np.sign(evidence.velocity[:, k]))
    signed = min(unexplained(evidence, k, signs), unexplained(evidence, k, -signs))
    plain = min(unexplained(evidence, k, np.abs(signs)), unexplained(evidence, k, -np.abs(signs)))
    return plain > 0.2 and signed < 0.05  # plain is up to 0.15 for sound torques


def _swapped(evidence: AuditData, joints: list[int]) -> list[Finding]:
    """Report torques that other joints' models explain far better than their own."""
    joints = [k for k in joints if np.isfinite(evidence.model[:, k]).sum() >= LEAST_BINS]
    if len(joints) < 2:
        return []
    residual, gain, share = _cross_fits(evidence, joints)
    own, other = linear_sum_assignment(np.log(residual))
    factor, gain_on_other = residual[own, own] / residual[own, other], gain[own, other]
    better = (factor > 1.2) & (gain_on_other > 1 / NEAR) & (gain_on_other < NEAR) & (share[own, other] > 0.8)
    _, group = connected_components(coo_array((np.ones(len(own)), (own, other))))
    cycles = [np.flatnonzero(group == number) for number in range(len(joints))]
    cycles = [some for some in cycles if len(some) > 1 and better[some].all()]
    cycles = [some for some in cycles if np.prod(factor[some]) > 30.0 ** (len(some) / 2)]
    if not cycles:
        return []
    groups = [{evidence.joints[joints[i]]: f"{gain[i, i]:.2f}" for i in some} for some in cycles]
    parts = [f"{' and '.join(group)} (gains on their own models: {', '.join(group.values())})" for group in groups]
    names = [name for group in groups for name in group]
    most = len(names) >= MOST * len(evidence.joints)
    return [Finding.of("joints-swapped", names, stops=most, groups=listed(parts))]


def _cross_fits(evidence: AuditData, joints: list[int]) -> tuple[Array, Array, Array]:
    """Compute relative residual variance, gain and share of each torque (row) on each model (column)."""
    residual, gain, share = np.ones((3, len(joints), len(joints)))
    for column, k in enumerate(joints):
        rows = np.isfinite(evidence.model[:, k])
        if rows.sum() < LEAST_BINS:
            continue
        torques = evidence.torque[rows][:, joints]
        spread = np.maximum(np.sum((torques - torques.mean(axis=0)) ** 2, axis=0), 1e-30)
        model, torques = without(friction_shapes(evidence, k, rows), evidence.model[rows, k], torques)
        power = float(model @ model)
        before = np.maximum(np.sum(torques**2, axis=0), 1e-30)
        along = model @ torques / max(power, 1e-30)
        after = np.maximum(before - along**2 * power, 1e-9 * before)
        residual[:, column], gain[:, column], share[:, column] = after / spread, along, 1 - after / before
    return np.maximum(residual, 1e-9), gain, share
