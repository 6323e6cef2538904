"""Results that are read back: their bytes, words, and the types of their values."""

import json
from pathlib import Path

import numpy as np

from fuzz.damage import bytes_damaged, nested, pick, text_damaged, value_damaged
from stribeck.cli.app import FORMATS


def make(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a result that is damaged somewhere, to be compared or exported."""
    text = (seeds / "result.json").read_text(encoding="utf-8")
    match int(generator.integers(10)):
        case 0:
            content = bytes_damaged(generator, text.encode())
        case 1 | 2:
            content = text_damaged(generator, text).encode(errors="surrogatepass")
        case 3:
            inner = nested(generator, *pick(generator, (("[", "1", "]"), ('{"a":', "1", "}"))))
            content = text.replace('"schema": 1', f'"schema": 1, "x": {inner}').encode()
        case _:
            document = json.loads(text)
            for _ in range(int(generator.integers(1, 4))):
                document = value_damaged(generator, document)
            content = json.dumps(document).encode()
    (folder / "result.json").write_bytes(content)
    match int(generator.integers(5)):
        case 0:
            return ["compare", "result.json"]
        case 1:
            return ["compare", "result.json", str(seeds / "result.json")]
        case 2:
            return ["compare", str(seeds / "result.json"), "result.json", "--json"]
        case 3:
            return ["compare", "result.json", "result.json"]
    words = ["export", "result.json", "-r", str(seeds / "robot.toml"), "--to", pick(generator, FORMATS), "-o", "out"]
    return words + pick(generator, (["--include-weak"], ["--samples", "2"], ["--ranges"], ["--strict"], []))
