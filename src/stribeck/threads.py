"""How many processors linear algebra uses."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock

from threadpoolctl import threadpool_limits


@dataclass
class _Limit:
    """The limit of this process, and how many threads need it: the first sets it, the last takes it back."""

    needed: int = 0
    limit: threadpool_limits | None = None


_limit = _Limit()
_turn = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS work on one processor, as long as any thread is in here.

    The matrices here are as large as a robot has joints, or thousands of rows by a handful of columns: threads that
    wait for one another cost more than they bring, up to a hundredfold on a busy machine. Pinocchio keeps its own.
    """
    with _turn:
        if not _limit.needed:
            _limit.limit = threadpool_limits(limits=1, user_api="blas")
        _limit.needed += 1
    try:
        yield
    finally:
        with _turn:
            _limit.needed -= 1
            if not _limit.needed and _limit.limit is not None:
                _limit.limit.restore_original_limits()
