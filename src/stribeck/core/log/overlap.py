"""Detection of logs that share samples, even if their time starts differ."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog

Prints = NDArray[np.uint64]


def prints(log: RobotLog) -> Prints:
    """Compute fingerprints of windows of a log's positions and torques; a robot at rest has none."""
    # Rows per fingerprint: quantized signals repeat single rows by chance, but never this many.
    window = 32
    # Mean rows per fingerprint. The values themselves select the start rows, independent of how a log is cut.
    every = np.uint64(16)
    rows = _hash_rows(log)
    starts = np.flatnonzero(rows[: max(len(rows) - window + 1, 0)] % every == 0)
    changes = np.concatenate(([0], np.cumsum(rows[1:] != rows[:-1])))
    starts = starts[changes[starts + window - 1] - changes[starts] >= window // 2]
    hashes = np.zeros(len(starts), dtype=np.uint64)
    for k in range(window):
        hashes = hashes * np.uint64(0x100000001B3) + rows[starts + k]  # wraps around, as in FNV
    return np.unique(hashes)


def _hash_rows(log: RobotLog) -> Prints:
    rows = np.zeros(len(log.time), dtype=np.uint64)
    factors = np.random.default_rng(0).integers(1 << 63, size=2 * len(log.joint_names), dtype=np.uint64) | np.uint64(1)
    for start in range(0, len(rows), 4096):  # blocks of a few megabytes, to reuse memory
        block = slice(start, start + 4096)
        both = np.concatenate((log.position[block], log.torque[block]), axis=1).view(np.uint64)
        mixed = (both ^ (both >> np.uint64(32))) * factors  # the last bits of a float are often zero
        rows[block] = mixed.sum(axis=1) >> np.uint64(16)
    return rows


def refuse_overlap(fingerprints: Prints, path: str, others: Sequence[tuple[Prints, str]]) -> None:
    """Refuse a log that contains samples of another one.

    Raises
    ------
    LogError
        Names both logs.
    """
    for other, where in others:
        fewest = min(len(fingerprints), len(other))
        shared = len(np.intersect1d(fingerprints, other, assume_unique=True)) / fewest if fewest else 0.0
        if shared > 0.01:  # recorders repeat some messages when they start a new file
            raise LogError(
                f"{path or 'log'}: {100 * shared:.0f} % of its samples are also in {where or 'the previous log'}; "
                "use each sample only once, because repeated samples make intervals too narrow"
            )
