"""How many processors linear algebra uses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS work on one processor.

    The matrices here are as large as a robot has joints, or thousands of rows by a handful of columns: threads that
    wait for one another cost more than they bring, up to a hundredfold on a busy machine. Pinocchio keeps its own.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
