"""Whether two logs hold the same samples, whatever their stamps count from."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.log import RobotLog

Prints = NDArray[np.uint64]

WINDOW = 32
"""Rows of a print: quantised signals of a joint repeat a row by chance, and never this many in a row."""

EVERY = np.uint64(16)
"""Rows for each print. Their own values choose where one begins, so that two logs agree on it however they are cut."""

SHARED = 0.01
"""Share of prints from which logs overlap: recorders repeat some messages where one file ends and the next begins."""


def prints(log: RobotLog) -> Prints:
    """Return numbers that stand for windows of a log's positions and torques, bit by bit; none of a robot at rest."""
    rows = _row_hashes(log)
    starts = np.flatnonzero(rows[: max(len(rows) - WINDOW + 1, 0)] % EVERY == 0)
    changes = np.concatenate(([0], np.cumsum(rows[1:] != rows[:-1])))
    starts = starts[changes[starts + WINDOW - 1] - changes[starts] >= WINDOW // 2]
    found = np.zeros(len(starts), dtype=np.uint64)
    for k in range(WINDOW):
        found = found * np.uint64(0x100000001B3) + rows[starts + k]  # wraps around, as in FNV
    return np.unique(found)


def _row_hashes(log: RobotLog) -> Prints:
    rows = np.zeros(len(log.time), dtype=np.uint64)
    factors = np.random.default_rng(0).integers(1 << 63, size=2 * len(log.joint_names), dtype=np.uint64) | np.uint64(1)
    for start in range(0, len(rows), 4096):  # blocks of a few megabytes, which memory is found for once
        block = slice(start, start + 4096)
        both = np.concatenate((log.position[block], log.torque[block]), axis=1).view(np.uint64)
        mixed = (both ^ (both >> np.uint64(32))) * factors  # the last bits of a float are often zero
        rows[block] = mixed.sum(axis=1) >> np.uint64(16)
    return rows


def refuse_overlap(own: Prints, path: str, others: Sequence[tuple[Prints, str]]) -> None:
    """Refuse a log that holds samples of another one.

    Raises
    ------
    LogError
        Naming both.
    """
    for other, where in others:
        fewest = min(len(own), len(other))
        shared = len(np.intersect1d(own, other, assume_unique=True)) / fewest if fewest else 0.0
        if shared > SHARED:
            raise LogError(
                f"{path or 'log'}: {100 * shared:.0f} % of its samples are those of {where or 'the log before it'}; "
                "expected logs of different times, since samples that count twice make intervals too narrow"
            )
