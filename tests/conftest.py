"""Settings of the whole test run, made before anything imports NumPy."""

import gc
import os

# With a BLAS thread a core, two workers on two cores spend most of their time waiting for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

# The same examples in every run: a change is judged by what it changed; `make fuzz` looks for new ones.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")

LONGEST = ("test_site.py", "test_demo.py", "test_fuzz.py", "test_real_logs.py", "test_docs.py", "test_paper.py")
"""Files with tests of many seconds: what is begun last is short, and no worker waits for another."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest tests; what has been made by now is never garbage, and need not be looked at for it."""
    items.sort(key=lambda item: (*LONGEST, item.path.name).index(item.path.name))
    gc.freeze()
