"""Concurrent threads give the same results as sequential ones, and restore the state of the process."""

import os
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import matplotlib as mpl
import pytest
import scipy.linalg  # noqa: F401 - loads its BLAS
import threadpoolctl
from tests.arm import arm_log

from stribeck import Robot, identify
from stribeck.core.base.threads import one_blas_thread


def process_state() -> tuple[object, ...]:
    threads = [library["num_threads"] for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"]
    return dict(mpl.rcParams), threads, list(warnings.filters)


@pytest.mark.parametrize("method", ["curve-fit", pytest.param("whole-log", marks=pytest.mark.long)])
def test_results_of_two_threads(method: str, arm: Robot, tmp_path: Path) -> None:
    logs = [arm_log(arm, duration=8, seed=seed) for seed in (1, 2)]
    alone = [identify(log, arm, method=method).to_json() for log in logs]
    before, start = process_state(), Barrier(2)

    def find(k: int) -> list[str]:
        start.wait()
        found = []
        for turn in range(2):
            found.append(identify(logs[k], arm, method=method, table=tmp_path / f"{k}-{turn}.parquet").to_json())
        return found

    with ThreadPoolExecutor(2) as threads:
        for k, found in enumerate(threads.map(find, range(2))):
            assert found == [alone[k]] * 2
    assert process_state() == before


def test_the_limit_of_blas_ends_with_the_last_thread_that_needs_it() -> None:
    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        before = process_state()[1]
        first, second = one_blas_thread(), one_blas_thread()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert set(process_state()[1]) == {1}
        second.__exit__(None, None, None)
        assert process_state()[1] == before == [2] * len(before)


def test_the_limit_covers_the_blas_of_scipy_which_is_loaded_late() -> None:
    code = """
from stribeck.core.base.threads import one_blas_thread
with one_blas_thread():
    import scipy.linalg, threadpoolctl
    assert {library["num_threads"] for library in threadpoolctl.threadpool_info()} == {1}
"""
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ | {"OPENBLAS_NUM_THREADS": "2"})
