"""Number of threads for linear algebra."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

from threadpoolctl import threadpool_limits

_limits: list[threadpool_limits] = []
_turn = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread while any thread is inside.

    Matrices here have as many rows as a robot has joints, or thousands of rows and a handful of columns. Waiting
    threads cost more than they gain, up to a hundredfold on a busy machine. Pinocchio's threads are not affected.
    """
    import scipy.linalg  # noqa: F401 - a limit holds for the libraries that are loaded, and SciPy brings its own BLAS

    with _turn:
        _limits.append(threadpool_limits(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _turn:
            _limits.pop().restore_original_limits()  # the last thread restores the limits from before the first
