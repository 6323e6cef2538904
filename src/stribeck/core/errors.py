"""Errors that users meet: one sentence with the file, the place, the wrong value and the valid choices."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from importlib.util import find_spec


class StribeckError(Exception):
    """The input or the settings are wrong. The command line prints the message and ends with exit code 2.

    The message is one line, even if it quotes names with line breaks. Findings from before the error are its notes
    (`__notes__`), which a traceback shows too.

    Examples
    --------
    >>> try:
    ...     read_log("nowhere.npz")
    ... except StribeckError as error:
    ...     print(error, error.exit_code)
    nowhere.npz: no such file; expected a log 2
    """

    exit_code = 2

    option = ""
    """Options of the command line that avoid the error, which the command line adds to the message."""

    def __init__(self, message: str, option: str = "") -> None:
        super().__init__(_printable(message))
        self.option = option


class RobotFileError(StribeckError):
    """A robot file or its model cannot be used.

    Examples
    --------
    >>> Robot.from_urdf("arm.urdf", base="fixed", position_controlled=["knee"])
    Traceback (most recent call last):
    stribeck.core.errors.RobotFileError: arm.urdf: [robot] position_controlled names joint 'knee'; expected ...
    """


class LogError(StribeckError):
    """A log cannot be read, or its content cannot be used.

    Examples
    --------
    >>> read_log("robot.toml")
    Traceback (most recent call last):
    stribeck.core.errors.LogError: robot.toml: unknown suffix '.toml'; expected ...
    """


class SettingsError(StribeckError):
    """A setting or a command line option is wrong.

    Examples
    --------
    >>> Settings(law="stribek")
    Traceback (most recent call last):
    stribeck.core.errors.SettingsError: Settings: key 'law' is 'stribek': input should be ...; did you mean 'stribeck'?
    """


class UnknownJointError(SettingsError, KeyError):
    """A result has no joint of this name.

    Examples
    --------
    >>> result["elbw"]
    Traceback (most recent call last):
    stribeck.core.errors.UnknownJointError: arm: the result has no joint 'elbw'; it has ...; did you mean 'elbow'?
    """

    __str__ = Exception.__str__  # a KeyError quotes its message


class NothingIdentifiedError(StribeckError):
    """The input is valid, but shows no joint's friction, e.g. because no joint moves; exit code 3.

    Examples
    --------
    >>> still = RobotLog(
    ...     time=log.time, joint_names=log.joint_names, position=0 * log.position, torque=log.torque
    ... )
    >>> identify(still, robot)
    Traceback (most recent call last):
    stribeck.core.errors.NothingIdentifiedError: no joint can be identified from this log: ...
    """

    exit_code = 3


def require_extra(extra: str, *packages: str) -> None:
    """Raise SettingsError if packages of an optional dependency group are not installed."""
    if missing := [name for name in packages if find_spec(name) is None]:
        raise SettingsError(f"{extra} needs {' and '.join(missing)}: pip install 'stribeck[{extra}]'")


def did_you_mean(word: str, valid: Iterable[str]) -> str:
    """Suggest the valid name nearest to an unknown one, as the end of a message; empty if none is near.

    >>> did_you_mean("stribek", ["coulomb-viscous", "stribeck"])
    "; did you mean 'stribeck'?"
    """
    near = get_close_matches(word, valid, n=1)
    return f"; did you mean '{near[0]}'?" if near else ""


@contextmanager
def findings_kept(found: Sequence[str] = ()) -> Iterator[list[str]]:
    """Provide a list that collects findings; an error raised inside gets each of them as a note."""
    findings = list(found)
    try:
        yield findings
    except StribeckError as error:
        known = getattr(error, "__notes__", [])
        for finding in dict.fromkeys(map(_printable, findings)):
            if finding not in known:
                error.add_note(finding)
        raise


@contextmanager
def errors_about(path: str) -> Iterator[None]:
    """Replace "log: ..." by the log's path in the messages of errors raised inside."""
    try:
        yield
    except LogError as error:
        message = str(error)
        if not path or not message.startswith("log: "):
            raise
        about = LogError(path + message.removeprefix("log"), error.option)
        about.__notes__ = getattr(error, "__notes__", [])
        raise about from error


def listed(names: Sequence[str], most: int = 6) -> str:
    """Quote names for a message, at most `most` of them."""
    shown = ", ".join(f"'{one_line(name)[:80]}'" for name in names[:most])
    return (shown + (f" and {len(names) - most} more" if len(names) > most else "")) or "nothing"


def one_line(text: str) -> str:
    """Convert text from a file to one printable line."""
    return _printable(" ".join(text.split()))


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in text)
