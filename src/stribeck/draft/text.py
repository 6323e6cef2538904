"""A robot file as text: TOML tables with comments."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

WIDTH = 110
"""[1] letters of a line that a list or a comment is broken at."""


def write_toml(document: Mapping[str, Any], notes: Mapping[str, list[str]], heading: list[str]) -> str:
    """Return a TOML document.

    Parameters
    ----------
    document
        Tables, at most three deep; a table that holds no table may stand in one line.
    notes
        Comments by dotted key, which stand above it.
    heading
        Comments at the beginning.
    """
    lines = list(_comments(heading))
    for name, table in document.items():
        lines += _table(name, table, notes)
    return "\n".join(lines) + "\n"


def _table(place: str, table: Mapping[str, Any], notes: Mapping[str, list[str]]) -> Iterator[str]:
    inner = {key: value for key, value in table.items() if isinstance(value, dict)}
    plain = {key: value for key, value in table.items() if key not in inner}
    if plain or place in notes or not inner:
        yield ""
        yield from _comments(notes.get(place, []))
        yield f"[{place}]"
    for key, value in plain.items():
        yield from _comments(notes.get(f"{place}.{key}", []))
        yield f"{_key(key)} = {_value(value)}"
    for key, value in inner.items():
        yield from _table(f"{place}.{_key(key)}", value, notes)


def _comments(texts: list[str]) -> Iterator[str]:
    for text in texts:
        line = "#"
        for word in text.split():
            if len(line) + len(word) > WIDTH:
                yield line
                line = "#"
            line += f" {word}"
        yield line


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list):
        items = [_value(item) for item in value]
        line = ", ".join(items)
        return f"[{line}]" if len(line) < WIDTH else "[\n" + "".join(f"    {item},\n" for item in items) + "]"
    return repr(value)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
