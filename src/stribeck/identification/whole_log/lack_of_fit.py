"""Whether friction does what no law of velocity can: score tests of what the fit leaves over.

A law that is fitted to friction that it cannot describe gives an average, and its intervals do not know. With r what
the fit leaves over of a share of the log, whitened, C the columns of `Suspects`, J those of all that is fitted, and A
their curvature on this share,

    scores       s = C^T r - C^T J A^-1 (J^T r)
    information  N = C^T C - C^T J A^-1 (J^T C)
    covariance   V = N + B Q B^T,   B = C^T Z - C^T J A^-1 (J^T Z)

the last term of V being what errors Z that every step repeats do to the scores. A kind of friction beyond the law is
found where its terms b = N^-1 s differ from zero by more than their covariance N^-1 V N^-1 lets chance do (Rao 1948);
it is told of where it also matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import chdtrc  # the tail of chi square

from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution, curvature, times_jacobian
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.identification.whole_log.suspects import COLUMNS, GAIN_COLUMN, KINDS, NO_TORQUE
from stribeck.typing import Array

SURPRISING = 8.0
"""Minus log10 of the probability [1] of a false alarm in one test by chance alone; errors of a model add to it."""

MATTERS = 0.05
"""Share of a joint's friction [1] below which a term is not worth a word."""

LEAST_FRICTION = 0.01
"""Share of the torque that a joint carries [1]: less counts as so much friction."""

LEAST = 1e-6
"""Information [1/(N m)^2] below which a term is not tested: the law can do the same."""


SENTENCES = {
    "load": "friction changes with the torque that the joint carries",
    "drift": "friction drifts in the course of the log",
    "presliding": "friction builds up over some way after a reversal, as bristles bend or a gear winds up",
    "play": "torque is lost where it changes its sign, as in a play",
}
"""What is said of each kind."""


@dataclass(frozen=True)
class Lack:
    """Friction beyond the law.

    Attributes
    ----------
    kind
        Of `KINDS`.
    size, share
        Of its largest column [N m], and that over the joint's friction [1].
    surprise
        Minus log10 of the probability that chance alone does as much [1].
    told
        Whether it is surprising, and matters.
    """

    kind: str
    size: float
    share: float
    surprise: float
    told: bool


def lacks_of_fit(
    statistic: Statistic,
    total: int,
    curves: Curves,
    model: ModelCorrections,
    solution: Solution,
    repeated: Array,
) -> tuple[tuple[Lack, ...], ...]:
    """Return what is found beyond the law, for each joint one entry a kind.

    Parameters
    ----------
    statistic
        Of a share of the log, with columns of repeated errors and of suspects.
    total
        Number of equations of the whole log, which solution and chi^2 are of.
    curves, model, solution
        Of the whole log.
    repeated
        Standard deviations of the repeated errors: of each joint's torque [N m] and the root's turns, shape (n + 3,) or
        (n,).
    """
    joints, own = len(curves.top_speed), statistic.suspects
    assert own is not None
    cosines, plain = statistic.gaits * COSINES * len(repeated), statistic.nodes.size + model.size
    corrected, slopes = model.values(solution.corrections)
    x = np.concatenate([curves.coefficients(solution.internal), corrected])
    left = statistic.right - statistic.gram[:, :plain] @ x
    rows = np.vstack([statistic.gram[plain:, :plain], left[:plain]])
    mixed = times_jacobian(rows, curves.jacobians(solution.internal), slopes, model.scales)  # [Z, C, r]^T J
    fitted = curvature(statistic.without_last(cosines + own.size), curves, model, solution)
    lost = cho_solve(cho_factor(fitted), mixed[cosines:-1].T).T  # C^T J A^-1
    score = left[plain + cosines :] - lost @ mixed[-1]
    gram = statistic.gram[plain + cosines :, plain:] - lost @ mixed[:-1].T  # [C^T Z, C^T C] without what is fitted
    bias = gram[:, :cosines] * np.tile(repeated, statistic.gaits * COSINES)
    information = gram[:, cosines:]
    scale = max(1.0, solution.chi_square / max(total - solution.internal.size, 1))
    level = np.maximum(_friction(curves, solution), LEAST_FRICTION * own.torque)
    found: list[tuple[Lack, ...]] = []
    for joint in range(joints):
        if own.torque[joint] <= NO_TORQUE:
            found.append(())
            continue
        place = slice(joint * COLUMNS, (joint + 1) * COLUMNS)
        variance = scale * information[place, place] + bias[place] @ bias[place].T
        found.append(_test(score[place], information[place, place], variance, float(level[joint])))
    return tuple(found)


def _test(score: Array, information: Array, variance: Array, level: float) -> tuple[Lack, ...]:
    """Return what one joint's scores say of each kind; the sensor's gain may be wrong beside each of them."""
    found = []
    for kind, columns in KINDS.items():
        which = np.array([*columns, GAIN_COLUMN])
        grid = np.ix_(which, which)
        prior = np.diag(which == GAIN_COLUMN).astype(float)
        own = slice(len(columns))
        if np.linalg.eigvalsh(information[grid][own, own])[0] <= LEAST:
            continue  # the law can do the same
        inverse = np.linalg.inv(information[grid] + prior)
        size, covariance = (inverse @ score[which])[own], (inverse @ (variance[grid] + prior) @ inverse)[own, own]
        squares = float(size @ np.linalg.solve(covariance, size))
        with np.errstate(divide="ignore"):  # beyond what a number can hold: infinite
            surprise = float(-np.log10(chdtrc(len(columns), squares)))
        largest = float(np.abs(size).max())
        share = largest / max(level, 1e-12)
        found.append(Lack(kind, largest, share, surprise, surprise > SURPRISING and share > MATTERS))
    return tuple(found)


def lack_warnings(lacks: Sequence[Sequence[Lack]], names: Sequence[str]) -> list[str]:
    """Return a sentence for each kind that joints have, by name; of a joint that shows several, the clearest."""
    found: dict[str, list[str]] = {}
    for name, own in zip(names, lacks, strict=True):
        told = [lack for lack in own if lack.told]
        if told:
            clearest = max(told, key=lambda lack: lack.surprise)
            found.setdefault(clearest.kind, []).append(f"{name} ({100 * clearest.share:.0f} %)")
    return [
        f"{sentence}: {', '.join(found[kind])} of its friction; the law's parameters are an average over this log, and "
        "their intervals do not know"
        for kind, sentence in SENTENCES.items()
        if kind in found
    ]


def _friction(curves: Curves, solution: Solution) -> Array:
    """Return how large each joint's friction is at half its top speed, without the offset [N m], shape (n,)."""
    nodes, joints = curves.nodes, len(curves.top_speed)
    functions = nodes.functions.shape[1]
    own = curves.coefficients(solution.internal).reshape(joints, -1)[:, :functions]
    both = [
        np.interp(0.5 * top * np.array([-1.0, 1.0]), velocity, nodes.functions @ each)
        for top, velocity, each in zip(curves.top_speed, nodes.velocity, own, strict=True)
    ]
    return np.asarray(np.abs(np.diff(both, axis=1)[:, 0]) / 2)
