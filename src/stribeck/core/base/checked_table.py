"""Tables of a file or of options, validated by pydantic: numbers within limits, and errors that name the key."""

from collections.abc import Iterator
from difflib import get_close_matches
from math import inf
from re import findall
from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError

from stribeck.core.errors import SettingsError, did_you_mean

Positive = Annotated[float, Field(ge=1e-9, le=1e9, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Finite = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False)]  # wide enough for offsets of time stamps
Cutoff = Annotated[float, Field(ge=0.5, le=1e5, allow_inf_nan=False)]
"""Cutoff frequency [Hz]. Below 0.5 Hz, no robot moves and the filter would be seconds long."""
Prior = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False)]
"""Standard deviation. Outside these limits, its square is lost in rounding."""
Relative = Annotated[float, Field(ge=1e-6, le=10.0, allow_inf_nan=False)]
"""Standard deviation of a logarithm or a share. Above ten, exponentials of it overflow."""


class Table(BaseModel):
    """Table of a settings file. Unknown keys and wrong types are errors, in Python a SettingsError."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    if not TYPE_CHECKING:  # the type checker knows the fields

        def __init__(self, **values: object) -> None:
            try:
                super().__init__(**values)
            except ValidationError as error:
                place = getattr(type(self), "options", type(self).__name__)
                raise SettingsError(f"{place}: {describe(error, type(self))}") from error

        __init__.__pydantic_base_init__ = True  # tables in files and in tables are validated without it


def rule(text: str) -> PydanticCustomError:
    """Make the error of a rule about several keys; `describe` returns its text unchanged."""
    return PydanticCustomError("rule", "{text}", {"text": text})


def flat(table: Table, prefix: str = "") -> dict[str, object]:
    """Flatten settings to dotted keys, as typed after `--set`."""
    settings: dict[str, object] = {}
    for key, value in table:
        settings |= flat(value, f"{prefix}{key}.") if isinstance(value, Table) else {prefix + key: value}
    return settings


def describe(error: ValidationError, table: type[BaseModel] | None = None) -> str:
    """Describe pydantic's first error in one sentence: the key, its value, and the valid choices.

    `table` is the validated class; it provides a suggestion for an unknown key. Unknown keys come first, because a
    missing key may be a misspelled one.
    """
    first = min(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
    key = ".".join(str(part) for part in first["loc"])
    message = str(first["msg"])
    if first["type"] == "extra_forbidden":
        return f"unknown key '{key}'" + (_nearest([str(part) for part in first["loc"]], table) if table else "")
    if first["type"] == "rule" or not key:  # the error concerns several keys, or the whole document
        return message
    if first["type"] == "missing":
        return f"key '{key}' is missing"
    if first["type"].startswith(("greater_than", "less_than", "finite_number")) and table:
        return f"key '{key}' is {_shown(first['input'])}; expected {_range(list(first['loc']), table)}"
    names = findall("'(.+?)'", first["ctx"]["expected"]) if first["type"] == "literal_error" else []
    near = did_you_mean(str(first["input"]), names)
    return f"key '{key}' is {_shown(first['input'])}: {message[0].lower()}{message[1:]}{near}"


def _nearest(loc: list[str], table: type[BaseModel]) -> str:
    """Suggest keys that an unknown one may mean: a similar one, the same one in another table, or any in its table."""
    *tables, last = loc
    parent = table
    for part in tables:
        if part in parent.model_fields:
            parent = _table_of(parent, part) or parent
    if near := get_close_matches(last, parent.model_fields, n=1):
        return f"; did you mean '{'.'.join([*tables, *near])}'?"
    elsewhere = [key for key in _dotted(table) if key.rpartition(".")[2] == last]
    return f"; did you mean '{elsewhere[0]}'?" if elsewhere else f"; expected one of {', '.join(parent.model_fields)}"


def _range(loc: list[object], table: type[BaseModel]) -> str:
    """Describe the range of the number at a location."""
    inner: type[BaseModel] | None = table
    notes: list[Any] = []
    for part in loc:
        if inner is not None and part in inner.model_fields:
            field = inner.model_fields[part]
            notes, inner = [*field.metadata, field.annotation], _table_of(inner, part)
    bounds: dict[str, float] = {}
    while notes:
        note = notes.pop()
        notes += [*get_args(note), *getattr(note, "metadata", ())]
        for name in ("ge", "gt", "le", "lt"):
            if getattr(note, name, None) is not None:
                bounds[name[0]] = getattr(note, name)
    return f"a number from {bounds.get('g', -inf):g} to {bounds.get('l', inf):g}"


def _table_of(table: type[BaseModel], key: str) -> type[BaseModel] | None:
    """Find the table class of a key; None if the key has a plain value."""
    annotation = table.model_fields[key].annotation
    inner = [annotation, *get_args(annotation)]
    return next((part for part in inner if isinstance(part, type) and issubclass(part, BaseModel)), None)


def _dotted(table: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """Yield the dotted keys of a table and of its inner tables, as typed after `--set`."""
    for key in table.model_fields:
        inner = table.model_fields[key].annotation
        yield prefix + key
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from _dotted(inner, f"{prefix}{key}.")


def _shown(value: object) -> str:
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # deep tables, and integers with more digits than Python prints
        return f"a value of type {type(value).__name__} too large to show"
    return text if len(text) < 80 else text[:77] + "..."
