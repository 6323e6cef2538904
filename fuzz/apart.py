"""Work in a child process: threads that a library starts in a process would be missing in those forked off it."""

import os
import pickle  # nosec B403 - of what a child of this process has sent
import traceback
from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")


def apart(work: Callable[[], Value]) -> Value:
    """Return what a function returns in a child process.

    Raises
    ------
    RuntimeError
        If it raises anything; what it was is on stderr.
    """
    receiving, sending = os.pipe()
    child = os.fork()
    if not child:
        code = 1
        try:
            with open(sending, "wb") as pipe:
                pickle.dump(work(), pipe)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(sending)
    with open(receiving, "rb") as pipe:
        found = pipe.read()
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise RuntimeError("work in a child process failed")
    value: Value = pickle.loads(found)  # nosec B301 - the same
    return value
