"""Outputs that appear whole or not at all, even if the user or the system interrupts."""

import atexit
import errno
import os
import secrets
import shutil
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stribeck.core.errors import SettingsError

STAGING = ".stribeck-"
"""Prefix of the temporary folder inside an output folder."""


class Interrupted(BaseException):
    """The user or the system requested a stop; half-written outputs are removed on the way out."""


@dataclass
class _State:
    """Requests to stop in this process."""

    asked: bool = False
    held: bool = False  # requests wait while outputs are moved or removed
    written: bool = False


_state = _State()


def catch_signals() -> None:
    """Let SIGINT, SIGTERM and SIGHUP raise Interrupted once. Ignored signals (nohup) stay ignored."""
    _state.asked = _state.held = _state.written = False
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        request = getattr(signal, name, None)  # Windows has no SIGHUP
        if request is not None and signal.getsignal(request) is not signal.SIG_IGN:
            signal.signal(request, stop)


def stop(*_: object) -> None:
    """Raise Interrupted at the first request to stop; later requests must not disturb the cleanup."""
    first, _state.asked = not _state.asked, True
    if first and not _state.held:
        raise Interrupted


@contextmanager
def resumable(remainder: str) -> Iterator[None]:
    """Describe what an interruption leaves, also where a library replaces the interruption by another error."""
    try:
        yield
    except BaseException as error:
        if not _state.asked:
            raise
        raise Interrupted(remainder) from error


def anything_written() -> bool:
    """Return whether an output has appeared since `catch_signals`."""
    return _state.written


def check_name(path: Path) -> None:
    """Refuse a path that is not valid in the system's encoding, because JSON and some libraries cannot represent it.

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
    """Refuse to overwrite an input (or a file in an input folder), and any existing file unless `overwrite` is set.

    Raises
    ------
    SettingsError
        If an output is an input, a folder, a device, or exists.
    """
    read = [file for path in inputs if path.exists() for file in (path.iterdir() if path.is_dir() else [path])]
    for output in outputs:
        check_name(output)
        if os.path.lexists(output) and not output.is_file() and (output.exists() or overwrite):
            what = "a folder" if output.is_dir() else "a pipe, a device or a socket"
            what = what if output.exists() else "a broken link"
            raise SettingsError(f"{output}: is {what}; expected a file to write")
        if output.exists() and any(output.samefile(file) for file in read):
            raise SettingsError(f"{output}: is read, and is not written over; expected another output")
        if os.path.lexists(output) and not overwrite:
            raise SettingsError(f"{output}: already exists", option="choose another -o, or pass --overwrite")


@contextmanager
def staged_folder(folder: str | Path) -> Iterator[Path]:
    """Provide a temporary folder to write to; its files move into `folder` if no error occurs.

    The temporary folder is inside `folder`, because the parent may not be writable.

    Raises
    ------
    SettingsError
        If the folder cannot be made or written to.
    """
    target = Path(folder)
    check_name(target)
    if os.path.lexists(target) and not target.is_dir():
        raise SettingsError(f"{target}: is no folder; expected a folder for the outputs, which is made if needed")
    staging = target / f"{STAGING}{secrets.token_hex(8)}"
    discard = partial(_discard, staging, [place for place in (target, *target.parents) if not place.exists()])
    atexit.register(discard)  # in case of an interruption just before the cleanup
    try:
        try:
            staging.mkdir(parents=True)
        except OSError as error:
            reason = f"({error.strerror}); expected a place to write to"
            raise SettingsError(f"{target}: cannot be made {reason}") from error
        with _named(target):
            yield staging
        _undisturbed(partial(_move, staging, target))
    finally:
        _undisturbed(discard)
        atexit.unregister(discard)


@contextmanager
def whole_or_not_at_all(path: str | Path) -> Iterator[Path]:
    """Provide a temporary path to write to; the file moves to `path`, or to what it links to, if no error occurs.

    Raises
    ------
    SettingsError
        If it cannot be made or written to.
    """
    target = Path(os.path.realpath(path) if os.path.islink(path) else path)
    with staged_folder(target.parent) as staging, _named(target):
        check_name(target)
        yield staging / target.name


@contextmanager
def _named(target: Path) -> Iterator[None]:
    """Name the output if the disk is full; the system's error has no file name then."""
    try:
        yield
    except OSError as error:
        full = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
        if error.errno not in full or error.filename:
            raise
        place = target.parents[1] / target.name if target.parent.name.startswith(STAGING) else target
        raise SettingsError(f"{place}: cannot be written ({os.strerror(error.errno)})") from error


def _move(staging: Path, target: Path) -> None:
    """Move files to their places, unless a stop was requested."""
    if _state.asked:
        raise Interrupted
    files = sorted(staging.iterdir())
    for place in (target / file.name for file in files):
        if place.is_dir():
            raise SettingsError(f"{place}: is a folder; expected a file to write")
    for file in files:
        file.replace(target / file.name)
    _state.written |= not target.name.startswith(STAGING)


def _discard(staging: Path, made: Iterable[Path]) -> None:
    """Remove the temporary folder and its empty parents, if they were made for it."""
    shutil.rmtree(staging, ignore_errors=True)
    with suppress(OSError):
        for folder in made:
            folder.rmdir()


def _undisturbed(act: Callable[[], None]) -> None:
    """Finish an action before a request to stop takes effect."""
    before, _state.held = _state.asked, True
    try:
        act()
    finally:
        _state.held = False
    if _state.asked and not before:
        raise Interrupted
