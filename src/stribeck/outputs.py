"""Outputs that appear whole or not at all, whenever the user or the system asks to stop, and whoever else writes."""

from __future__ import annotations

import atexit
import errno
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from stribeck.errors import SettingsError

try:
    import fcntl
except ImportError:  # of other systems than POSIX; there, two runs must not write to the same place at once
    fcntl = None  # type: ignore[assignment]

UNWRITABLE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""What a disk may say when it is written to; the system then names no file."""


STAGING = ".stribeck.part"
"""Folder in an output folder in which outputs come to be."""


class Interrupted(BaseException):
    """The user or the system asks to stop; what is half written is taken away on the way out."""


@dataclass
class _State:
    """What this process has not finished, and whether it was asked to stop."""

    unfinished: dict[Path, _Claim] = field(default_factory=dict)
    asked: bool = False
    waiting: bool = False  # a request changes nothing now: outputs move to their place, or one was made already
    written: bool = False


@dataclass(frozen=True)
class _Claim:
    """A place to write to that no other run takes: its lock, and the folders that were made for it, innermost first."""

    lock: int | None
    folders: tuple[Path, ...]


_state = _State()


def catch_signals() -> None:
    """Let SIGINT, SIGTERM and SIGHUP raise Interrupted, once; one that is ignored (nohup) stays so."""
    _state.asked = _state.waiting = _state.written = False
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        request = getattr(signal, name, None)  # Windows has no SIGHUP
        if request is not None and signal.getsignal(request) is not signal.SIG_IGN:
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


def check_name(path: Path) -> None:
    """Refuse a path that is not in the system's encoding: JSON cannot say it, nor do all libraries open it.

    Raises
    ------
    SettingsError
    """
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        encoding = sys.getfilesystemencoding().upper()
        raise SettingsError(f"{path}: is not {encoding}; expected files and folders with names that are") from error


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path], overwrite: bool) -> None:
    """Refuse to write over what is read, however it is spelt, and over what is there already unless asked to.

    Of an input that is a folder, the files in it are read.

    Raises
    ------
    SettingsError
        If an output is an input, a folder, a device, or there already.
    """
    read = [file for path in inputs if path.exists() for file in (path.iterdir() if path.is_dir() else [path])]
    for output in outputs:
        check_name(output)
        if output.is_dir():
            raise SettingsError(f"{output}: is a folder; expected a file to write")
        if output.exists() and not output.is_file():
            raise SettingsError(f"{output}: is a pipe, a device or a socket; expected a file to write")
        if output.exists() and any(output.samefile(file) for file in read):
            raise SettingsError(f"{output}: is read, and is not written over; expected another output")
        if os.path.lexists(output) and not overwrite:
            raise SettingsError(f"{output}: is there already; name another output, or add --overwrite")


@contextmanager
def staged_folder(folder: str | Path) -> Iterator[Path]:
    """Give a temporary folder to write to; its files move into `folder`, all or none, if no error came.

    It lies in `folder` itself, whose parent may be one that nobody writes to, and holds the place until the end:
    another run is refused. What a run that was killed has left there is taken away.

    Raises
    ------
    SettingsError
        If the folder cannot be made or written to, or another run writes to it.
    """
    target = Path(folder)
    staging = target / STAGING
    with _staged(target, staging, Path.mkdir, lambda: _move_files(staging, target)):
        yield staging


@contextmanager
def whole_or_not_at_all(path: str | Path) -> Iterator[Path]:
    """Give a temporary path beside `path` to write to; it takes the name `path` only if no error came.

    Raises
    ------
    SettingsError
        If it cannot be made or written to, or another run writes to it.
    """
    target = Path(path)
    staging = target.parent / f".{target.name}.part"
    with _staged(target, staging, lambda place: place.touch(exist_ok=False), lambda: staging.replace(target)):
        yield staging


@contextmanager
def _staged(target: Path, staging: Path, make: Callable[[Path], None], move: Callable[[], object]) -> Iterator[None]:
    check_name(target)
    own: list[Path] = []
    try:
        with _named(target):
            _undisturbed(lambda: own.append(_claim(target, staging, make)))
            yield
            _finish(target, move)
    finally:
        for place in own:  # another run's stays
            _discard(place)


@contextmanager
def _named(target: Path) -> Iterator[None]:
    """Say which output a disk has no room for."""
    try:
        yield
    except OSError as error:
        if error.errno not in UNWRITABLE or error.filename:
            raise
        place = target.parents[1] / target.name if target.parent.name == STAGING else target
        raise SettingsError(f"{place}: cannot be written ({os.strerror(error.errno)})") from error


def _claim(target: Path, staging: Path, make: Callable[[Path], None]) -> Path:
    """Make a place to write to, that no other run takes until `_discard`; one that a killed run left is taken away."""
    busy = SettingsError(f"{target}: another run is writing to it now; wait for its end, or name another output")
    missing = tuple(folder for folder in (staging.parent, *staging.parent.parents) if not os.path.lexists(folder))
    try:
        if staging.parent == target and target.exists() and not target.is_dir():
            raise SettingsError(f"{target}: is a file; expected a folder for the outputs, which is made if needed")
        staging.parent.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(staging):
            left = _lock(staging)
            _remove(staging)
            _unlock(left)
        make(staging)
        _state.unfinished[staging] = _Claim(_lock(staging), missing)
    except (BlockingIOError, FileExistsError, FileNotFoundError) as error:  # it came or went meanwhile
        raise busy from error
    except OSError as error:
        raise SettingsError(f"{target}: cannot be made ({error.strerror}); expected a place to write to") from error
    return staging


def _lock(place: Path) -> int | None:
    """Return the lock of a file or folder, which ends with this process; None where there are no locks.

    Raises
    ------
    OSError
        Among them BlockingIOError if another run has it, and FileNotFoundError if the place is not the same any more.
    """
    if fcntl is None:
        return None
    lock = os.open(place, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise
    except OSError:  # some file systems have no locks
        return lock
    if not os.path.samestat(os.fstat(lock), os.stat(place)):
        os.close(lock)
        raise FileNotFoundError
    return lock


def _unlock(lock: int | None) -> None:
    if lock is not None:
        os.close(lock)


def _remove(place: Path) -> None:
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place, ignore_errors=True)
    else:
        with suppress(OSError):
            place.unlink(missing_ok=True)


def _move_files(staging: Path, target: Path) -> None:
    """Move files to their places; if one cannot, those that were there before come back."""
    files = sorted(staging.iterdir())
    before = staging / "before"
    before.mkdir()
    moved: list[Path] = []
    try:
        for file in files:
            place = target / file.name
            if place.is_dir():
                raise SettingsError(f"{place}: is a folder; expected a file to write")
            if os.path.lexists(place):
                _keep(place, before / file.name)
            moved.append(place)
            file.replace(place)
    except BaseException:
        for place in moved:
            if os.path.lexists(before / place.name):
                (before / place.name).replace(place)
            else:
                place.unlink(missing_ok=True)
        raise


def _keep(file: Path, kept: Path) -> None:
    """Give a file a second name, or where there are no hard links another one."""
    try:
        os.link(file, kept, follow_symlinks=False)
    except (OSError, NotImplementedError):
        file.rename(kept)


def _finish(target: Path, move: Callable[[], object]) -> None:
    """Move an output to its place in one go, unless a request to stop got lost on the way."""

    def finish() -> None:
        if _state.asked:
            raise Interrupted
        move()
        _state.written |= _state.unfinished.keys().isdisjoint(target.parents)  # else it is still in a staged folder

    _undisturbed(finish)


def _discard(staging: Path) -> None:
    def discard() -> None:
        claim = _state.unfinished.get(staging)
        if claim is None:  # it is another run's
            return
        _remove(staging)
        if staging.exists():
            return
        for folder in claim.folders:  # that are still empty
            with suppress(OSError):
                folder.rmdir()
        _unlock(claim.lock)
        del _state.unfinished[staging]

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
