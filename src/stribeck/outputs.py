"""Outputs that appear whole or not at all, whenever the user or the system asks to stop."""

from __future__ import annotations

import atexit
import os
import secrets
import shutil
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from stribeck.errors import SettingsError


class Interrupted(BaseException):
    """The user or the system asks to stop; what is half written is taken away on the way out."""


@dataclass
class _State:
    """What this process has not finished, and whether it was asked to stop."""

    unfinished: set[Path] = field(default_factory=set)
    asked: bool = False
    waiting: bool = False  # a request changes nothing now: outputs move to their place, or one was made already
    written: bool = False


_state = _State()


def catch_signals() -> None:
    """Let SIGINT and SIGTERM raise Interrupted, once."""
    _state.asked = _state.waiting = _state.written = False
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, stop)


def stop(*_: object) -> None:
    """Raise Interrupted at the first request to stop; another one shall not disturb the clean-up."""
    _state.asked = True
    if not _state.waiting:
        _state.waiting = True
        raise Interrupted


def anything_written() -> bool:
    """Return whether an output has appeared since `catch_signals`."""
    return _state.written


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path], overwrite: bool) -> None:
    """Refuse to write over what is read, however it is spelt, and over what is there already unless asked to.

    Of an input that is a folder, the files in it are read.

    Raises
    ------
    SettingsError
        If an output is an input, a folder, or there already.
    """
    read = [file for path in inputs if path.exists() for file in (path.iterdir() if path.is_dir() else [path])]
    for output in outputs:
        if output.is_dir():
            raise SettingsError(f"{output}: is a folder; expected a file to write")
        if output.exists() and any(output.samefile(file) for file in read):
            raise SettingsError(f"{output}: is read, and is not written over; expected another output")
        if os.path.lexists(output) and not overwrite:
            raise SettingsError(f"{output}: is there already; name another output, or add --overwrite")


@contextmanager
def staged_folder(folder: str | Path) -> Iterator[Path]:
    """Give a temporary folder to write to; its files move into `folder` only if no error came.

    Raises
    ------
    SettingsError
        If the folder cannot be made.
    """
    target = Path(folder)
    staging = _beside(target)
    try:
        _make(target, staging)
        yield staging
        _finish(target, lambda: _move_files(staging, target))
    finally:
        _discard(staging)


def _make(target: Path, staging: Path) -> None:
    try:
        if target.exists() and not target.is_dir():
            raise SettingsError(f"{target}: is a file; expected a folder for the outputs, which is made if needed")
        target.parent.mkdir(parents=True, exist_ok=True)
        staging.mkdir()
    except OSError as error:
        raise SettingsError(f"{target}: cannot be made ({error.strerror}); expected a folder to write to") from error


@contextmanager
def whole_or_not_at_all(path: str | Path) -> Iterator[Path]:
    """Give a temporary path beside `path` to write to; it takes the name `path` only if no error came."""
    target = Path(path)
    staging = _beside(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        staging.touch(exist_ok=False)
        yield staging
        _finish(target, lambda: staging.replace(target))
    finally:
        _discard(staging)


def _move_files(staging: Path, target: Path) -> None:
    target.mkdir(exist_ok=True)
    for file in sorted(staging.iterdir()):
        file.replace(target / file.name)


def _beside(target: Path) -> Path:
    """Return a new name beside an output, on the list of what is taken away before there is anything under it."""
    staging = target.parent / f".{target.name}.{secrets.token_hex(4)}.part"
    _state.unfinished.add(staging)
    return staging


def _finish(target: Path, move: Callable[[], object]) -> None:
    """Move an output to its place in one go, unless a request to stop got lost on the way."""

    def finish() -> None:
        if _state.asked:
            raise Interrupted
        move()
        _state.written |= _state.unfinished.isdisjoint(target.parents)  # else it is still in a staged folder

    _undisturbed(finish)


def _discard(staging: Path) -> None:
    def discard() -> None:
        if staging.is_dir():
            shutil.rmtree(staging, ignore_errors=True)
        else:
            with suppress(OSError):
                staging.unlink(missing_ok=True)
        if not staging.exists():
            _state.unfinished.discard(staging)

    _undisturbed(discard)


def _undisturbed(act: Callable[[], None]) -> None:
    """Do what is not to be left half done: a request to stop waits until it is."""
    waiting = _state.waiting
    _state.waiting = True
    try:
        act()
    finally:
        _state.waiting = waiting
    if _state.asked:
        stop()


@atexit.register
def discard_unfinished() -> None:
    """Take away what an interruption has left: it may come just before clean-up, and while threads still write."""
    for staging in tuple(_state.unfinished):
        _discard(staging)
