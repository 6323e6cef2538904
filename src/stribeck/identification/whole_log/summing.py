"""Sums the equations of many stretches up, weighed by threads."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.narrowing import Narrowing, all_functions
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.identification.whole_log.suspects import Suspects

WORKERS = 2
"""Threads [1] that weigh equations: linear algebra lets other threads run."""


def sum_up(
    equations: Iterable[WeakEquations],
    levels: ErrorLevels,
    curves: Curves,
    model: ModelCorrections,
    gaits: int,
    suspects: Suspects | None = None,
    narrowing: Narrowing | None = None,
) -> Statistic:
    """Return the statistic of equations: worked out here, added up by threads, in an order that never changes.

    What `narrowing` leaves out is not lost: the statistic is of all columns.
    """
    narrow = narrowing or all_functions(curves.nodes, model.corrections)
    size = len(narrow.kept) + gaits * COSINES * len(curves.top_speed) + (suspects.size if suspects else 0)
    statistics = [Statistic(narrow.nodes, size, gaits, suspects, narrow.kept) for _ in range(WORKERS)]
    waiting: list[Future[None] | None] = [None] * WORKERS
    with ThreadPoolExecutor(WORKERS) as pool:
        for k, part in enumerate(equations):
            if (before := waiting[k % WORKERS]) is not None:
                before.result()  # so that few stretches are in memory
            waiting[k % WORKERS] = pool.submit(statistics[k % WORKERS].add, part, levels)
        for last in waiting:
            if last is not None:
                last.result()
    for other in statistics[1:]:
        statistics[0].merge(other)
    return narrow.widened(statistics[0], curves.nodes)
