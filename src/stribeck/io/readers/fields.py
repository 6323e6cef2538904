"""Numbers in messages of any type, which `[log] <channel>.name` gives as `<topic>.<field>`."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from stribeck.core.errors import LogError
from stribeck.core.log.channels import COMMAND, JOINT_CHANNELS
from stribeck.core.settings import LogTable
from stribeck.io.readers.messages import Part


def asked_fields(table: LogTable) -> dict[str, dict[str, list[str]]]:
    """Collect {topic: {name in `[log]`: channels}}."""
    fields: dict[str, dict[str, list[str]]] = {}
    roles = COMMAND | {"external_torque": "torque"}  # read as another channel until their role is known
    for channel in JOINT_CHANNELS:
        asked = getattr(table, channel).name or []
        for name in [asked] if isinstance(asked, str) else asked:
            fields.setdefault(name.partition(".")[0], {}).setdefault(name, []).append(roles.get(channel, channel))
    return fields


def parts_of_fields(message: Any, names: Mapping[str, Sequence[str]], place: str) -> Iterator[Part]:
    """Read the fields that `[log]` names in a message: a number is a joint of this name, an array the message's joints.

    Without `joint_names` in the message, the joints of an array are numbered. The field of a topic without a field is
    `data`, as of `std_msgs/Float64MultiArray`.
    """
    for name, channels in names.items():
        field = name.partition(".")[2] or "data"
        try:
            values = _read(message, field)
        except AttributeError as error:
            fields = ", ".join(list_numbers(message))
            raise LogError(f"{place} has no field '{field}'; expected one of {fields}") from error
        labels = tuple(map(str, range(len(values)))) if np.ndim(values) else (name,)
        labels = tuple(joints) if len(joints := getattr(message, "joint_names", ())) == len(labels) else labels
        yield Part("joints", labels, dict.fromkeys(channels, np.atleast_1d(values)), name)


def list_numbers(message: Any, prefix: str = "") -> Iterator[str]:
    """List the fields of a message that are numbers or arrays of them, except stamps."""
    for key, value in vars(message).items():
        value = value[0] if isinstance(value, list) and value and hasattr(value[0], "__dict__") else value
        if hasattr(value, "__dict__"):
            yield from list_numbers(value, f"{prefix}{key}.")
        elif not key.startswith("_") and key not in ("sec", "nanosec", "nsec", "seq", "data_offset"):
            with suppress(TypeError, ValueError):  # text
                if not isinstance(value, (str, bytes, bool)) and np.asarray(value, dtype=float).size:
                    yield f"{prefix}{key}"


def _read(message: Any, field: str) -> Any:
    """Read a field by its path, in every element of arrays of messages."""
    value = message
    for key in field.split("."):
        value = [getattr(entry, key) for entry in value] if isinstance(value, list) else getattr(value, key)
    return value
