"""Settings of the whole test run, applied before anything imports NumPy."""

import gc
import os

# With a BLAS thread a core, two workers on two cores spend most of their time waiting for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings
from tests.arm import write_arm

from stribeck import Robot

# The same examples in every run: a change is judged by what it changed; `make fuzz` looks for new ones.
# Deadlines would fail on loaded machines only.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("random", deadline=None)
settings.register_profile("fuzz", settings.get_profile("random"), max_examples=8000)
settings.load_profile("repeatable")

LONGEST = ("test_site.py", "test_demo.py", "test_hostile.py", "test_real_logs.py", "test_docs.py", "test_paper.py")
"""Files with tests of many seconds. They start first, so that no worker waits for another at the end."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the longest tests, and exclude existing objects from garbage collection."""
    items.sort(key=lambda item: (*LONGEST, item.path.name).index(item.path.name))
    gc.freeze()


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """The arm of `tests.arm`, from a folder of its own."""
    return Robot.from_file(write_arm(tmp_path_factory.mktemp("arm")))
