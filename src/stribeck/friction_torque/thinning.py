"""Keeps what the fit and the report need of a stream of chunks, in bounded memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck.errors import LogError
from stribeck.friction_torque.stream import Chunk
from stribeck.samples import Samples
from stribeck.typing import Array

MOST_KEPT = 60_000
"""Samples that are kept: filtered samples lie closer together than they differ, so a fit loses nothing."""


def thin(chunk: Chunk, stride: int) -> Samples:
    """Return one of `stride` samples of a chunk, counted in rows of the log so that chunks fit together."""
    kept = chunk.rows % stride == 0
    samples = chunk.samples
    return replace(
        samples,
        stride=stride,
        **{name: getattr(samples, name)[kept] for name in ("time", "velocity", "acceleration", "friction_torque")},
        **{name: getattr(samples, name)[kept] for name in ("usable", "block", "support")},
        **{name: value[kept] for name in ("jerk", "snap") if (value := getattr(samples, name)) is not None},
    )


def join_logs(logs: Sequence[Samples]) -> Samples:
    """Return the samples of several logs as one, their blocks numbered through; see `join`."""
    firsts = np.cumsum([0, *(int(log.block.max(initial=-1)) + 1 for log in logs)])
    return join([replace(log, block=log.block + first) for log, first in zip(logs, firsts, strict=False)])


def join(parts: Sequence[Samples]) -> Samples:
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

    def stacked(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    return replace(
        parts[0],
        time=stacked("time"),
        velocity=stacked("velocity"),
        acceleration=stacked("acceleration"),
        friction_torque=stacked("friction_torque"),
        jerk=None if parts[0].jerk is None else stacked("jerk"),
        snap=None if parts[0].snap is None else stacked("snap"),
        usable=np.concatenate([part.usable for part in parts]),
        block=np.concatenate([part.block for part in parts]),
        support=np.concatenate(support).astype(np.int64),
        support_names=names,
        stride=max(part.stride for part in parts),
    )
