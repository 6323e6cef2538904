"""A terminal may know ASCII alone, and the name of a file may be no text."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.result.test_any_result import plain


def stribeck(*arguments: str | bytes | Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
    command = [sys.executable, "-m", "stribeck", *arguments]
    return subprocess.run(command, capture_output=True, env={**os.environ, **environment}, timeout=60)


def test_what_ascii_lacks_is_printed_by_its_number(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(plain("Kniegelenk_ä").to_json())
    done = stribeck("compare", tmp_path, tmp_path, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"Kniegelenk_\xe4" in done.stdout


@pytest.mark.parametrize("command", [["compare"], ["inspect", "-r", "robot.toml"]])
def test_a_name_that_is_not_utf8_is_refused(tmp_path: Path, command: list[str]) -> None:
    done = stribeck(*command, os.fsencode(tmp_path) + b"/w\xff.npz")
    assert done.returncode == 2
    assert done.stderr.endswith(b"w?.npz: is not UTF-8; expected files and folders with names that are\n")
    assert done.stderr.count(b"\n") == 1
