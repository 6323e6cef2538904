"""Robot files: their bytes, words, keys and the types of their values."""

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.damage import bytes_damaged, nested, pick, text_damaged, value_damaged


def make(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a robot file that is damaged somewhere, beside a sound model."""
    (folder / "arm.urdf").write_bytes((seeds / "arm.urdf").read_bytes())
    text = (seeds / "robot.toml").read_text(encoding="utf-8")
    content: bytes
    match int(generator.integers(10)):
        case 0 | 1:
            content = bytes_damaged(generator, text.encode())
        case 2 | 3 | 4:
            for _ in range(int(generator.integers(1, 4))):
                text = text_damaged(generator, text)
            content = text.encode(errors="surrogatepass")
        case 5:
            content = (
                text + "\nx = " + nested(generator, *pick(generator, (("[", "1", "]"), ("{a=", "1", "}"))))
            ).encode()
        case _:
            document: Any = tomllib.loads(text)
            for _ in range(int(generator.integers(1, 4))):
                document = value_damaged(generator, document)
            content = as_toml(document).encode(errors="surrogatepass")
    (folder / "robot.toml").write_bytes(content)
    return ["inspect", str(seeds / "log.npz"), "-r", "robot.toml"]


def as_toml(document: Any) -> str:
    """Return plain data as TOML; what TOML cannot say is said as JSON says it."""
    if not isinstance(document, dict):
        return json.dumps(document)
    return "\n".join(f"{_key(key)} = {_value(value)}" for key, value in document.items())


def _key(name: str) -> str:
    return json.dumps(name)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value)
