"""Errors a user can meet: one sentence with the file, the place, what was found and what would be valid."""


class StribeckError(Exception):
    """The input or the settings are wrong; the command line prints the message and ends with exit code 2."""

    exit_code = 2


class RobotFileError(StribeckError):
    """A robot file, or the model it names, cannot be used."""


class LogError(StribeckError):
    """A log cannot be read, or what it holds cannot be used."""


class SettingsError(StribeckError):
    """A setting or a command line option is wrong."""


class NothingIdentifiedError(StribeckError):
    """The input is sound, but no joint's friction can be identified from it; exit code 3."""

    exit_code = 3
