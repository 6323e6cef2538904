"""Whether torques come later than the motion asks for them, by what several joints agree on."""

import numpy as np

from stribeck.audit.evidence import Evidence, Run
from stribeck.finding import Finding
from stribeck.typing import Array

LONGEST = 0.03
"""[s] searched on either side."""
FEWEST_STEPS = 5
"""Samples [1] searched on either side at least."""
SHORTEST_RUN = 0.3
"""[s]; shorter runs say little about a delay."""
FEWEST_SAMPLES = 16
MOST_SAMPLES = 6000
"""Of each joint that are compared; the shifts between them are those of the log's rate."""
EXPLAINED = 0.5
"""Share of a torque's variance that the model must explain before a delay is given."""
WORTH = 0.1
"""Share of what is left of a torque that a delay must explain; less is what errors of the model are like."""
FRICTION_SHAPES = (0.01, 0.03, 0.1, 0.3)
"""Widths of the smoothed signs that stand for friction, in shares of the top speed."""
FEWEST_JOINTS = 3
"""That must have a delay, of a robot that has as many."""
SURE = 4.0
"""Standard errors of the median over joints that a delay must be beyond."""
LEAST = 1.5
"""Samples [1] of delay that are worth a finding."""
AGREE, AGREE_OF_FEW, FEW = 0.6, 0.75, 8
"""Share of the joints that must agree on a delay, and of fewer than so many."""


def delays(evidence: Evidence) -> dict[str, float]:
    """Return by how much each joint's torque comes late [s]; joints whose model explains too little have none."""
    found = {name: _delay(evidence, k) for k, name in enumerate(evidence.joints)}
    return {name: delay for name, delay in found.items() if delay is not None}


def check_delay(evidence: Evidence, found: dict[str, float]) -> list[Finding]:
    """Return a finding if the joints' delays agree on more than a sample or two."""
    period = evidence.prepared.sampling.period
    values = np.array(list(found.values()))
    if len(values) < max(2, min(FEWEST_JOINTS, len(evidence.joints))):
        return []
    middle = float(np.median(values))
    agreeing = np.abs(values - middle) < max(0.35 * abs(middle), 0.5 * period)
    error = 1.25 * 1.48 * float(np.median(np.abs(values - middle))) / np.sqrt(len(values))  # of a median
    needed = (AGREE if len(values) >= FEW else AGREE_OF_FEW) * len(values)
    if abs(middle) < max(LEAST * period, SURE * error) or agreeing.sum() < max(2.0, needed):
        return []
    present = evidence.robot.log_table.torque.delay
    return [
        Finding(
            check="torque-delay",
            channel="torque",
            text=f"the torque comes {1e3 * middle:+.2f} ms after what the motion asks for (median of {len(values)} "
            f"joints, of which {int(agreeing.sum())} agree)",
            cure=f"set [log] torque = {{ delay = {present + middle:.5f} }} if all signals should belong to one time",
        )
    ]


def _delay(evidence: Evidence, k: int) -> float | None:
    """Return by how much the torque comes late [s], or None where the model explains too little of it.

    For every shift the torque is regressed on the model's torque, the velocity, smoothed signs of it and a constant:
    friction shall not be taken for a delay. A parabola through the best shift and its neighbours gives the fraction of
    a sample. One that explains next to nothing is not known.
    """
    if not evidence.moves(k):
        return None
    period = evidence.prepared.sampling.period
    reach = max(FEWEST_STEPS, round(LONGEST / period))
    shortest = 2 * reach + max(FEWEST_SAMPLES, SHORTEST_RUN / period)
    runs = [run for run in _known(evidence, k) if len(run.model) > shortest]
    if not runs:
        return None
    every = -(-sum(len(run.model) for run in runs) // MOST_SAMPLES)
    speed = np.concatenate([run.velocity[reach:-reach:every] for run in runs])
    model = np.concatenate([run.model[reach:-reach:every] for run in runs])
    top = max(float(np.abs(speed).max()), 1e-9)
    signs = [np.tanh(speed / (share * top)) for share in FRICTION_SHAPES]
    without_model = np.linalg.qr(np.column_stack([np.ones(len(speed)), speed, *signs]))[0]
    with_model = np.linalg.qr(np.column_stack([without_model, model]))[0]

    def shifted(shift: int) -> Array:
        return np.concatenate([run.torque[reach + shift : len(run.torque) - reach + shift : every] for run in runs])

    shifts = np.arange(-reach, reach + 1)
    left = [_unexplained(with_model, shifted(int(shift))) for shift in shifts]
    best = int(np.argmin(left))
    torque = shifted(int(shifts[best]))
    gained = _unexplained(without_model, torque) - left[best]
    if best in (0, len(shifts) - 1) or gained < EXPLAINED * _unexplained(without_model[:, :1], torque):
        return None
    low, middle, high = left[best - 1 : best + 2]
    fraction = 0.5 * (low - high) / (low - 2 * middle + high)
    delay = float(shifts[best] + fraction)
    if abs(delay) > LEAST and left[reach] < (1 + WORTH) * left[best]:
        return None
    return delay * period


def _known(evidence: Evidence, k: int) -> list[Run]:
    """Return the parts of runs in which a joint's model torque is known, of that joint alone, shape (t,) each."""
    found = []
    for run in evidence.runs:
        known = np.isfinite(run.model[:, k]).astype(int)
        edges = np.flatnonzero(np.diff(known, prepend=0, append=0))
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            found.append(Run(run.torque[start:stop, k], run.model[start:stop, k], run.velocity[start:stop, k]))
    return found


def _unexplained(orthonormal: Array, torque: Array) -> float:
    """Return the sum of squares that a basis leaves of a torque."""
    return float(torque @ torque - np.sum((orthonormal.T @ torque) ** 2))
