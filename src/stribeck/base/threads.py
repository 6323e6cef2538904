"""Number of processors that linear algebra uses."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

from threadpoolctl import threadpool_limits

_limits: list[threadpool_limits] = []
_turn = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS work on one processor, as long as any thread is in here.

    The matrices here are as large as a robot has joints, or thousands of rows by a handful of columns: threads that
    wait for one another cost more than they bring, up to a hundredfold on a busy machine. Pinocchio keeps its own.
    """
    with _turn:
        _limits.append(threadpool_limits(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _turn:
            _limits.pop().restore_original_limits()  # the last thread restores what the first one found
