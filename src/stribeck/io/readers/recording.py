"""Output of every reader: channels that a file contains, and a function that loads some of their columns.

The page "Extending stribeck" explains how to add a format. To add a type of message, write a function in `messages.py`.
"""

import errno
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stribeck.core.errors import LogError, StribeckError, one_line
from stribeck.core.log.storage import too_large

Arrays = dict[str, NDArray[np.generic]]
Wanted = Mapping[str, Sequence[int]]
"""Numbers of the columns to load, by channel."""
Loaded = tuple[Arrays, list[str]]
"""Loaded columns by channel, shape (T, columns) each, and notes on changes."""


@dataclass(frozen=True)
class Channel:
    """Columns of a channel in a file: their number, and their names in the log if it has names."""

    columns: int
    labels: tuple[str, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Opened log.

    Attributes
    ----------
    path
        Path of the file, for messages.
    channels
        Channels in the file, by the names of RobotLog; `foot_wrench` has six columns per foot.
    load
        Function that loads columns: {channel: column numbers} to arrays of shape (T, columns), in the log's units.
        Arrays are float64, except that an integer `time` stays integer (nanoseconds since 1970 do not fit float64). A
        column number of -1 gives zeros.
    others
        Names of other content in the file.
    wide
        Names in `others` with several columns each.
    rivals
        {channel: {topic: frame of its messages}} if several topics contain the same columns of a channel, and `[log]`
        chooses none of them.
    time_unit
        Unit of `time` if the file defines it; settings do not change it.
    torque_source
        Source of the torque if the file defines it.
    motor_orders
        {robot: its joints by number} if the file numbers its joints `motor_0`, `motor_1`, ... and belongs to one of
        these.
    expected
        {channel: its place in this format}, for messages about missing channels.
    """

    path: str
    channels: Mapping[str, Channel]
    load: Callable[[Wanted], Loaded]
    others: tuple[str, ...] = ()
    wide: frozenset[str] = frozenset()
    rivals: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    time_unit: str | None = None
    torque_source: str | None = None
    motor_orders: Mapping[str, Sequence[str]] = field(default_factory=dict)
    expected: Mapping[str, str] = field(default_factory=dict)


@contextmanager
def foreign(path: str, what: str) -> Iterator[None]:
    """Turn any exception of a foreign library on a damaged file into a LogError of one line."""
    try:
        yield
    except StribeckError:
        raise
    except MemoryError as error:
        raise LogError(too_large(path)) from error
    except Exception as error:  # parsers raise anything on damaged bytes, from KeyError to zlib.error
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:
            raise LogError(too_large(path)) from error
        unreadable = (errno.EACCES, errno.EPERM, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ESTALE, errno.ENOTCONN)
        if isinstance(error, OSError) and error.errno in unreadable:
            place = one_line(str(error.filename or path))
            raise LogError(f"{place}: cannot be read ({os.strerror(error.errno)}); expected a readable log") from error
        reason = one_line(str(error))[:160] or type(error).__name__
        raise LogError(f"{path}: cannot be read as {what}; it is damaged or of another kind ({reason})") from error
