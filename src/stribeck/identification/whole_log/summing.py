"""Sums the equations of many stretches up, weighed by threads."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from threading import Event, Lock

from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.narrowing import Narrowing, all_functions
from stribeck.identification.whole_log.statistic import Statistic, merged
from stribeck.identification.whole_log.suspects import Suspects
from stribeck.weak_equations import WeakEquations

WORKERS = 2
"""Threads [1] that weigh equations: linear algebra lets other threads run."""

ByWorker = Sequence[Statistic]
"""One statistic for each worker."""


def sum_up(
    equations: Sequence[WeakEquations],
    levels: ErrorLevels,
    curves: Curves,
    model: ModelCorrections,
    narrowing: Narrowing | None = None,
    places: Sequence[int] | None = None,
) -> Statistic:
    """Return the statistic of equations, all or those at some places.

    What `narrowing` leaves out is not lost: the statistic is of all columns.
    """
    narrow = narrowing or all_functions(curves.nodes, model.corrections)
    own = _nothing(narrow)
    chosen = range(len(equations)) if places is None else places
    _share_out(equations, levels, [(place, own, None) for place in chosen])
    return narrow.widened(merged(own), curves.nodes)


def sum_up_folds(
    equations: Sequence[WeakEquations],
    folds: Sequence[tuple[Sequence[int], Sequence[int]]],
    levels: ErrorLevels,
    curves: Curves,
    narrow: Narrowing,
    gaits: int,
    suspects: Suspects,
) -> tuple[list[Statistic], Statistic]:
    """Return the statistics of folds, and that of the share of all that is looked at, with more columns.

    Parameters
    ----------
    equations
        Of all stretches.
    folds
        Places of the stretches of each: of those that are looked at, and of the others.
    gaits, suspects
        The further columns: repeated errors of so many gait phases, and friction beyond the law.
    """
    further = gaits * COSINES * (len(curves.top_speed) + len(levels.rocking)) + suspects.size
    shares = [Statistic(narrow.nodes, len(narrow.kept) + further, gaits, suspects, narrow.kept) for _ in range(WORKERS)]
    statistics = [_nothing(narrow) for _ in folds]
    tasks: list[tuple[int, ByWorker, ByWorker | None]] = []
    for (looked_at, others), own in zip(folds, statistics, strict=True):
        tasks += [(place, shares, own) for place in looked_at]
        tasks += [(place, own, None) for place in others]
    _share_out(equations, levels, tasks)
    whole = [narrow.widened(merged(own), curves.nodes) for own in statistics]
    return whole, narrow.widened(merged(shares), curves.nodes)


def _nothing(narrow: Narrowing) -> ByWorker:
    return [Statistic(narrow.nodes, len(narrow.kept), kept=narrow.kept) for _ in range(WORKERS)]


def _share_out(
    equations: Sequence[WeakEquations], levels: ErrorLevels, tasks: Sequence[tuple[int, ByWorker, ByWorker | None]]
) -> None:
    """Take in equations by threads in turn, each in an order that never changes.

    A task is the place of the equations, the statistics that take them in, and those of their core, if any. One thread
    at a time works equations out: Pinocchio's working memory is not for two.
    """
    making, over = Lock(), Event()

    def work(worker: int) -> None:
        for place, whole, core in tasks[worker::WORKERS]:
            if over.is_set():
                return
            with making:
                part = equations[place]
            whole[worker].add(part, levels, core[worker] if core else None)

    with ThreadPoolExecutor(WORKERS) as pool:
        try:
            done, _ = wait([pool.submit(work, worker) for worker in range(WORKERS)], return_when=FIRST_EXCEPTION)
        finally:
            over.set()  # nobody waits for what an error, or Ctrl-C, has made useless
    for each in done:
        each.result()
