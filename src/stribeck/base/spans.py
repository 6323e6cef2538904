"""Spans of logs: formatting for messages and for `--exclude`."""

from collections.abc import Mapping, Sequence
from math import ceil, floor
from types import MappingProxyType
from typing import NamedTuple


class Span(NamedTuple):
    """Start and end [s] after the start of the log, and the file name of the log if there are several."""

    start: float
    end: float
    log: str = ""


MOST = 5
"""Largest number of spans that a message lists [1]."""
MOST_OPTIONS = 20
"""Largest number of spans that a message offers to exclude [1]."""


def listed_spans(spans: Sequence[Span], notes: Mapping[Span, str] = MappingProxyType({})) -> str:
    """List spans, largest first, only the first few of many: "40.2 to 70.1 s (note), 81 to 83.5 s and 2 more"."""
    spans = sorted(spans, key=lambda span: span.start - span.end)
    own = [f" ({notes[span]})" if span in notes else "" for span in spans]
    largest = zip(_largest(spans, " ", MOST), own, strict=False)
    shown = [f"{name}{start} to {end} s{note}" for (name, start, end), note in largest]
    return ", ".join(shown) + (f" and {len(spans) - MOST} more" if len(spans) > MOST else "")


def exclude_options(spans: Sequence[Span]) -> str:
    """Format the options that exclude spans: "--exclude 40.2:70.1 --exclude 81:83.5"."""
    return " ".join(f"--exclude {name}{start}:{end}" for name, start, end in _largest(spans, ":", MOST_OPTIONS))


def _largest(spans: Sequence[Span], after_name: str, most: int) -> list[tuple[str, str, str]]:
    """Format name, start and end of the largest spans, rounded outward to tenths of a second."""
    largest = sorted(spans, key=lambda span: span.start - span.end)[:most]
    return [
        (f"{log}{after_name}" if log else "", f"{max(0, floor(10 * start)) / 10:g}", f"{ceil(10 * end) / 10:g}")
        for start, end, log in largest
    ]
