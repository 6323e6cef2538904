"""Outputs are whole or not there, at whatever moment a request to stop comes."""

import atexit
import contextlib
import itertools
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pytest
from tests.arm import arm_log, save_npz, write_arm

from stribeck import Robot
from stribeck.core.base import outputs
from stribeck.core.base.outputs import Interrupted, staged_folder, whole_or_not_at_all
from stribeck.core.errors import SettingsError


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outputs, "_state", outputs._State())


def write_folder(place: Path) -> None:
    with staged_folder(place / "out") as staging, whole_or_not_at_all(staging / "table") as table:
        table.write_text("1")
        (staging / "result").write_text("2")


def write_file(place: Path) -> None:
    with whole_or_not_at_all(place / "page") as page:
        page.write_text("3")


@contextlib.contextmanager
def stopped_at(moment: int) -> Iterator[None]:
    """Ask to stop before the n-th bytecode of the staging and of what drives it, as a signal would."""
    watched = {outputs.__file__: "opcode", contextlib.__file__: "opcode", shutil.__file__: "line"}
    left = itertools.count(moment, -1)
    before = sys.gettrace()

    def trace(frame: FrameType, event: str, _: object) -> Callable[..., object] | None:
        if frame.f_code.co_filename not in watched or frame.f_code is outputs.stop.__code__:
            return None
        frame.f_trace_opcodes = watched[frame.f_code.co_filename] == "opcode"
        if event == watched[frame.f_code.co_filename] and next(left) == 0:
            outputs.stop()
        return trace

    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)


@pytest.mark.parametrize(
    ("write", "whole"), [(write_folder, ["out", "out/result", "out/table"]), (write_file, ["page"])]
)
def test_a_request_to_stop_at_any_moment(write, whole, tmp_path, monkeypatch):
    ends, at_exit = set(), list[Callable[[], None]]()
    monkeypatch.setattr(atexit, "register", at_exit.append)
    for moment in itertools.count():
        monkeypatch.setattr(outputs, "_state", outputs._State())
        place = tmp_path / str(moment)
        place.mkdir()
        try:
            with stopped_at(moment):
                write(place)
            heard = outputs._state.asked
        except Interrupted:
            heard = True
        while at_exit:  # at the end of the process
            at_exit.pop()()
        left = sorted(str(path.relative_to(place)) for path in place.rglob("*"))
        assert left == (whole if outputs.anything_written() else []), moment
        ends.add((heard, bool(left)))
        if not heard:
            break
    assert moment > 100
    assert ends == {(True, False), (True, True), (False, True)}


@pytest.mark.parametrize("write", [write_folder, write_file])
def test_a_second_request_does_not_disturb_the_clean_up(write, tmp_path, monkeypatch):
    remove = shutil.rmtree

    def disturbed(place: Path, **options: bool) -> None:
        outputs.stop()
        remove(place, **options)

    monkeypatch.setattr(shutil, "rmtree", disturbed)
    monkeypatch.setattr(Path, "write_text", outputs.stop)
    with pytest.raises(Interrupted):
        write(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_folders_that_were_made_go_with_what_failed(tmp_path: Path) -> None:
    with pytest.raises(KeyError), staged_folder(tmp_path / "a/b/out"):
        raise KeyError
    with pytest.raises(KeyError), whole_or_not_at_all(tmp_path / "c/page"):
        raise KeyError
    assert list(tmp_path.iterdir()) == []


def test_all_outputs_or_none(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")

    def write_all() -> None:
        with staged_folder(tmp_path) as staging:
            for name in ("a", "b", "c"):
                (staging / name).write_text("new")
            (tmp_path / "c").mkdir()  # while this run goes on

    with pytest.raises(SettingsError, match="c: is a folder"):
        write_all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "c"]
    assert (tmp_path / "a").read_text() == "old"


FULL = """
import resource, sys
from stribeck.app.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 14, 1 << 14))
sys.argv = ["stribeck", "identify", *sys.argv[1:]]
main()
"""


def test_a_full_disk_is_reported_with_the_file(tmp_path: Path) -> None:
    save_npz(arm_log(Robot.from_file(write_arm(tmp_path)), duration=8, rate=250), tmp_path / "log.npz")
    arguments = ["log.npz", "-r", "robot.toml", "-o", "out", "--method", "curve-fit"]
    ended = subprocess.run(
        [sys.executable, "-c", FULL, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    *notes, sentence = ended.stderr.splitlines()
    assert sentence == "stribeck: out/friction_torque.parquet: cannot be written (File too large)"
    assert all(note.startswith("stribeck: note: ") for note in notes)
    assert not (tmp_path / "out").exists()


EARLY = """
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "typer":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from stribeck.app.cli import main
main()
"""


def test_a_request_to_stop_during_the_start() -> None:
    ended = subprocess.run([sys.executable, "-c", EARLY], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (130, "stribeck: interrupted; nothing was written\n")
