"""Thinning of a stream of chunks to the samples that fit and report need, in bounded memory."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import BoolArray
from stribeck.core.equations.friction_torque.inverse_dynamics import Chunk
from stribeck.core.errors import LogError
from stribeck.core.result.samples import FrictionSamples

PER_SAMPLE = (
    *("time", "velocity", "acceleration", "friction_torque", "usable", "block", "support"),
    *("torque", "jerk", "snap", "sharp_velocity"),
)
"""Attributes of `FrictionSamples` with one entry per sample."""


def thin(chunk: Chunk, stride: int) -> FrictionSamples:
    """Keep every `stride`-th sample of a chunk, counted in rows of the log so that chunks fit together."""
    return chunk.samples if stride == 1 else replace(take(chunk.samples, chunk.rows % stride == 0), stride=stride)


def take(samples: FrictionSamples, rows: BoolArray) -> FrictionSamples:
    """Select samples."""
    taken = {name: value[rows] for name in PER_SAMPLE if (value := getattr(samples, name)) is not None}
    return replace(samples, **taken)


def join_logs(logs: Sequence[FrictionSamples]) -> FrictionSamples:
    """Join the samples of several logs, with blocks numbered consecutively; see `join`."""
    firsts = np.cumsum([0, *(int(log.block.max(initial=-1)) + 1 for log in logs)])
    return join([replace(log, block=log.block + first) for log, first in zip(logs, firsts, strict=False)])


def join(parts: Sequence[FrictionSamples]) -> FrictionSamples:
    """Join parts of one log; supports are merged by name.

    Raises
    ------
    LogError
        If the joints differ, or there are no samples.
    """
    if not parts:
        raise LogError(
            "log: no sample is usable: all support phases are shorter than the edges removed by trimming and filtering"
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
