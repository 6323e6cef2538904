"""Spans in which torques disagree with a model that explains the rest of the log: a hand, a table, a payload."""

from dataclasses import replace

import numpy as np

from stribeck.check.audit.evidence import LEAST_BINS, AuditData
from stribeck.check.audit.regression import friction_shapes, unexplained
from stribeck.core.base.spans import Span
from stribeck.core.base.typing import Array, BoolArray
from stribeck.core.equations.friction_torque.payload import MARGIN


def disturbed_spans(evidence: AuditData) -> tuple[list[Span], BoolArray]:
    """Find the spans whose torques deviate far from model plus robustly fitted friction, and mask their bins."""
    negligible = 0.1  # residual relative to the torque's variation that counts as one deviation: reversals are larger
    slow = 0.02  # speed relative to the top speed below which friction may be static [1]
    outlying = 5.0  # residual beyond which a bin is disturbed [robust standard deviations]
    far = np.zeros(len(evidence.rows))
    for k in range(len(evidence.joints)):
        rows = np.isfinite(evidence.model[:, k])
        if rows.sum() >= LEAST_BINS:
            torque = evidence.torque[rows, k]
            residual, friction = _residual(friction_shapes(evidence, k, rows), torque - evidence.model[rows, k])
            usual = max(_deviation(residual), negligible * _deviation(torque - np.median(torque)))
            resting = np.abs(evidence.velocity[rows, k]) < slow * evidence.top_speed[k]
            beyond = np.maximum(np.abs(residual) - resting * np.ptp(friction), 0.0)  # static friction has any value
            far[rows] = np.maximum(far[rows], beyond / max(usual, 1e-12))
    log = evidence.prepared.log
    time = log.time[evidence.rows] - log.start
    lasting = np.minimum(far[1:], far[:-1]) > outlying  # a single bin is a reversal
    edges = np.maximum(time[1:][lasting][:, None] + [-MARGIN, MARGIN], 0.0)
    new = np.append(True, edges[1:, 0] > edges[:-1, 1]) if len(edges) else np.zeros(0, dtype=bool)
    starts, ends = edges[new, 0], edges[np.roll(new, -1), 1]
    inside = np.any((time[:, None] >= starts) & (time[:, None] <= ends), axis=1)
    return [Span(*span) for span in zip(starts.tolist(), ends.tolist(), strict=True)], inside


def rest_of(evidence: AuditData, disturbed: BoolArray) -> AuditData:
    """Select the bins outside of disturbed spans."""
    bins = ("rows", "run", "support", "torque", "model", "velocity", "acceleration", "external")
    return replace(evidence, **{name: getattr(evidence, name)[~disturbed] for name in bins})


def unexplained_joints(evidence: AuditData) -> set[str]:
    """Find the joints of whose torque model and friction leave more than half."""
    return {name for k, name in enumerate(evidence.joints) if unexplained(evidence, k, 1.0) > 0.5}


def explained(whole: AuditData, rest: AuditData) -> set[str]:
    """Find the joints that model and friction explain in the larger part of a log, under the loads of the whole log."""
    if 2 * len(rest.rows) < len(whole.rows):
        return set()
    load, kept = (np.nan_to_num(part.model).std(axis=0) for part in (whole, rest))
    loaded = np.flatnonzero(kept > 0.7 * load).tolist()
    return {whole.joints[k] for k in loaded if unexplained(rest, k, 1.0) < 0.1}


def _residual(shapes: Array, torque: Array) -> tuple[Array, Array]:
    """Compute residual and friction of a robust fit, whose weights fall beyond the median (Holland and Welsch 1977)."""
    shapes, weight = shapes / np.maximum(np.linalg.norm(shapes, axis=0), 1e-12), np.ones(len(torque))
    for _ in range(20):
        friction = shapes @ np.linalg.lstsq(shapes * weight[:, None], torque * weight, rcond=None)[0]
        residual = torque - friction
        size = np.abs(residual) / max(float(np.median(np.abs(residual))), 1e-12)
        weight = np.sqrt(1 / np.maximum(size, 1.0))
    return np.asarray(residual), np.asarray(friction)


def _deviation(values: Array) -> float:
    """Compute the standard deviation of a normal distribution with the same median size."""
    return float(np.median(np.abs(values))) / 0.6745
