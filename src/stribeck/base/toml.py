"""Values as TOML on one line, for messages that quote a robot file."""

import json
from collections.abc import Mapping
from typing import Any


def in_toml(value: Any) -> str:
    """Format a value; long tables are shortened, and numbers have six digits."""
    if isinstance(value, Mapping):
        most = 16  # entries of a table that a message shows
        shown = [f"{_key(key)} = {in_toml(own)}" for key, own in value.items()]
        return f"{{ {', '.join(shown[:most])}{', ...' if len(shown) > most else ''} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(in_toml, value))}]"
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    bare = name.isascii() and name.replace("-", "").replace("_", "").isalnum()
    return name if bare else json.dumps(name, ensure_ascii=False)
