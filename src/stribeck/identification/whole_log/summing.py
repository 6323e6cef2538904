"""Sums the equations of many stretches up, weighed by threads."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack

from stribeck.equations import WeakEquations
from stribeck.identification.whole_log.cosines import COSINES
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.levels import ErrorLevels
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.narrowing import Narrowing, all_functions
from stribeck.identification.whole_log.statistic import Statistic, merged
from stribeck.identification.whole_log.suspects import Suspects

WORKERS = 2
"""Threads [1] that weigh equations: linear algebra lets other threads run."""

WAITING = 2
"""Equations [1] that wait for each of them: enough that none idles, and few in memory."""

Task = Callable[[int], None]
"""What a worker does, told which one it is."""


def sum_up(
    equations: Iterable[WeakEquations],
    levels: ErrorLevels,
    curves: Curves,
    model: ModelCorrections,
    narrowing: Narrowing | None = None,
) -> Statistic:
    """Return the statistic of equations. What `narrowing` leaves out is not lost: it is of all columns."""
    narrow = narrowing or all_functions(curves.nodes, model.corrections)
    statistics = [_nothing(narrow) for _ in range(WORKERS)]

    def take(part: WeakEquations) -> Task:
        return lambda worker: statistics[worker].add(part, levels)

    _share_out(take(part) for part in equations)
    return narrow.widened(merged(statistics), curves.nodes)


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
    statistics = [[_nothing(narrow) for _ in range(WORKERS)] for _ in folds]

    def tasks() -> Iterator[Task]:
        for (looked_at, others), own in zip(folds, statistics, strict=True):
            for place in looked_at:
                yield look(equations[place], own)
            for place in others:
                yield take(equations[place], own)

    def look(part: WeakEquations, own: list[Statistic]) -> Task:
        return lambda worker: shares[worker].add(part, levels, own[worker])

    def take(part: WeakEquations, own: list[Statistic]) -> Task:
        return lambda worker: own[worker].add(part, levels)

    _share_out(tasks())
    whole = [narrow.widened(merged(own), curves.nodes) for own in statistics]
    return whole, narrow.widened(merged(shares), curves.nodes)


def _nothing(narrow: Narrowing) -> Statistic:
    return Statistic(narrow.nodes, len(narrow.kept), kept=narrow.kept)


def _share_out(tasks: Iterable[Task]) -> None:
    """Run tasks by threads in turn, in an order that never changes, while the next ones are worked out here."""
    with ExitStack() as stack:
        workers = [stack.enter_context(ThreadPoolExecutor(1)) for _ in range(WORKERS)]
        waiting: deque[Future[None]] = deque()
        for k, task in enumerate(tasks):
            if len(waiting) == WAITING * WORKERS:
                waiting.popleft().result()
            waiting.append(workers[k % WORKERS].submit(task, k % WORKERS))
        for last in waiting:
            last.result()
