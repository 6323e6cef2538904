"""TOML: parse a document, and format values on one line for messages that quote a robot file."""

import json
import tomllib
from collections.abc import Mapping
from typing import Any


def in_toml(value: Any, most: int = 16) -> str:
    """Format a value; tables of more than `most` entries are shortened, and numbers have six digits."""
    if isinstance(value, Mapping):
        shown = [f"{_key(key)} = {in_toml(entry)}" for key, entry in value.items()]
        return f"{{ {', '.join(shown[:most])}{', ...' if len(shown) > most else ''} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(in_toml, value))}]"
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    bare = name.isascii() and name.replace("-", "").replace("_", "").isalnum()
    return name if bare else json.dumps(name, ensure_ascii=False)


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a TOML document.

    Raises
    ------
    ValueError
        If the text is not TOML (as its subclass TOMLDecodeError), has a too long integer, or is nested too deeply.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
