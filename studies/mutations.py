"""Seed wrong lines into a copy of the package, and print which test catches each of them.

    python -m studies.mutations [WORD ...]

`mutations.toml` lists the wrong lines with the tests that are nearest to them; words select those whose file contains
one. A copy without wrong lines has to pass these tests first. Frozen numbers (`tests/test_golden.py`) catch any change
and prove nothing, so that no entry may name them. Tests have no deadlines (`tests/conftest.py`), and a run that takes
longer than `LONGEST` catches nothing. The exit code is 1 if a wrong line survives.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import NamedTuple

from studies.command import ROOT, SOURCE
from studies.markdown import markdown_table

LONGEST = 900.0
"""Longest duration of the tests of one wrong line [s]."""


class Mutation(NamedTuple):
    """Text of one file of the package, the wrong text, and the files or folders of tests that have to notice it."""

    file: str
    old: str
    new: str
    tests: list[str]


TABLE = tomllib.loads((ROOT / "studies" / "mutations.toml").read_text(encoding="utf-8"))
TESTS = ROOT / "tests"
MUTATIONS = [Mutation(**entry) for entry in TABLE["mutation"]]


def failure(source: Path, tests: list[str]) -> str:
    """Run tests with a copy of the package in a folder; return the first test that fails, or ""."""
    command = [sys.executable, "-m", "pytest", "-xqp", "no:cacheprovider", *(str(TESTS / name) for name in tests)]
    environment = os.environ | {"PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return ""
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{tests}: pytest could not run\n{done.stdout}{done.stderr}")
    failed = re.search(r"^(?:FAILED|ERROR) tests/(.+?)(?: - .*)?$", done.stdout, re.MULTILINE)
    return failed[1] if failed else ""


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only files whose path contains one of these")
    words, rows = parser.parse_args().words, []
    chosen = [each for each in MUTATIONS if not words or any(word in each.file for word in words)]
    with tempfile.TemporaryDirectory() as folder:
        package = shutil.copytree(SOURCE, Path(folder) / SOURCE.name)
        if failed := failure(Path(folder), sorted({name for each in chosen for name in each.tests})):
            sys.exit(f"{failed} fails without a wrong line")
        for file, old, new, tests in chosen:
            text = (package / file).read_text()
            (package / file).write_text(text.replace(old, new))
            rows.append((file, f"`{old}`", f"`{new}`", failure(Path(folder), tests) or "**survives**"))
            (package / file).write_text(text)
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(markdown_table(("file", "line", "wrong line", "caught by"), rows, left=4))
    sys.exit(any(row[-1] == "**survives**" for row in rows))


if __name__ == "__main__":
    main()
