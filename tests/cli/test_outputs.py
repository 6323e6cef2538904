"""Outputs are whole or not there, at whatever moment a request to stop comes."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pytest

from stribeck import outputs
from stribeck.outputs import Interrupted, discard_unfinished, staged_folder, whole_or_not_at_all


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
def test_a_request_to_stop_at_any_moment(
    write: Callable[[Path], None], whole: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = set()
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
        discard_unfinished()  # as at the end of the process
        left = sorted(str(path.relative_to(place)) for path in place.rglob("*"))
        assert left == (whole if outputs.anything_written() else []), moment
        ends.add((heard, bool(left)))
        if not heard:
            break
    assert moment > 100
    assert ends == {(True, False), (True, True), (False, True)}


@pytest.mark.parametrize("write", [write_folder, write_file])
def test_a_second_request_does_not_disturb_the_clean_up(
    write: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    discard = outputs._discard

    def disturbed(staging: Path) -> None:
        outputs.stop()
        discard(staging)

    def interrupted(*_: object) -> None:
        outputs.stop()

    monkeypatch.setattr(outputs, "_discard", disturbed)
    monkeypatch.setattr(Path, "write_text", interrupted)
    with pytest.raises(Interrupted):
        write(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_request_that_something_swallowed_is_heard_before_outputs_appear(tmp_path: Path) -> None:
    with pytest.raises(Interrupted):
        outputs.stop()
    with pytest.raises(Interrupted):
        write_file(tmp_path)
    assert list(tmp_path.iterdir()) == []
