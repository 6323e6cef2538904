"""Sections of the page of `stribeck paper` as plain data; `app/report/paper.toml` has their texts."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.result.samples import FrictionSamples


class PaperChart(NamedTuple):
    """Chart of a joint.

    Attributes
    ----------
    samples, column
        Samples with the joint, and its column.
    along
        Time [s], frequency or velocity, ascending, shape (K,).
    values
        Lines in the order of the legend, once or several times, shape (L, K).
    numbers
        Numbers of the caption.
    """

    samples: FrictionSamples
    column: int
    along: Array
    values: Array
    numbers: Sequence[float]


class PaperSection(NamedTuple):
    """Section of the page.

    Attributes
    ----------
    key
        Key of the texts.
    charts
        One chart per joint.
    about, reason
        Key of the sentence, which may contain a reason.
    marks
        Places of upright lines on the horizontal axes.
    """

    key: str
    charts: Sequence[PaperChart]
    about: str = "about"
    reason: str = ""
    marks: Sequence[float] = ()


def busiest(samples: FrictionSamples, duration: float = 10.0) -> IntArray:
    """Find the samples of the part of a log in which the joints are fastest, at most `duration` [s]."""
    speed = np.where(samples.usable, np.abs(samples.velocity), 0.0)
    part = ((samples.time - samples.time[0]) / duration).astype(int)
    busy = np.bincount(part, speed @ (1 / np.maximum(speed.max(axis=0), 1e-9)))
    return np.flatnonzero(part == int(np.argmax(busy)))


def rms(values: Array) -> float:
    """Compute the root mean square of all values except NaN."""
    return float(np.sqrt(np.nanmean(values**2)))
