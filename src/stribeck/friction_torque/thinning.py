"""Keeps what the fit and the report need of a stream of chunks, in bounded memory."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stribeck.errors import LogError
from stribeck.friction_torque.inverse_dynamics import Chunk
from stribeck.friction_torque.samples import FrictionSamples

MOST_KEPT = 60_000
"""Samples that are kept: filtered samples lie closer together than they differ, so a fit loses nothing."""

PER_SAMPLE = (
    *("time", "velocity", "acceleration", "friction_torque", "usable", "block", "support"),
    *("torque", "jerk", "snap", "sharp_velocity"),
)
"""What `FrictionSamples` has of each sample."""


def thin(chunk: Chunk, stride: int) -> FrictionSamples:
    """Return one of `stride` samples of a chunk, counted in rows of the log so that chunks fit together."""
    return chunk.samples if stride == 1 else replace(take(chunk.samples, chunk.rows % stride == 0), stride=stride)


def take(samples: FrictionSamples, rows: NDArray[np.bool_]) -> FrictionSamples:
    """Select samples."""
    taken = {name: value[rows] for name in PER_SAMPLE if (value := getattr(samples, name)) is not None}
    return replace(samples, **taken)


def join_logs(logs: Sequence[FrictionSamples]) -> FrictionSamples:
    """Return the samples of several logs as one, their blocks numbered through; see `join`."""
    firsts = np.cumsum([0, *(int(log.block.max(initial=-1)) + 1 for log in logs)])
    return join([replace(log, block=log.block + first) for log, first in zip(logs, firsts, strict=False)])


def join(parts: Sequence[FrictionSamples]) -> FrictionSamples:
    """Return parts of one log as one; supports are merged by name.

    Raises
    ------
    LogError
        If the joints differ, or there are no samples.
    """
    if not parts:
        raise LogError(
            "log: no sample is usable: no support phase is longer than what is trimmed off and filtered away"
        )
    if len({part.joint_names for part in parts}) > 1:
        raise LogError("log: the logs have different joints")
    names = tuple(dict.fromkeys(name for part in parts for name in part.support_names))
    support = [np.array([names.index(name) for name in part.support_names])[part.support] for part in parts]
    stacked = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in PER_SAMPLE
        if getattr(parts[0], name) is not None
    }
    merged = {"support": np.concatenate(support).astype(np.int64), "support_names": names}
    stride = max(part.stride for part in parts)
    return replace(parts[0], stride=stride, **(stacked | merged))  # type: ignore[arg-type]
