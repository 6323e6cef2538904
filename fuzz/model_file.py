"""Models in URDF and MJCF: their bytes, words, numbers and elements."""

import os
from pathlib import Path

import numpy as np

from fuzz.damage import bytes_damaged, nested, pick, text_damaged, xml_damaged

TENDON = (
    '<tendon><fixed name="belt" frictionloss="0.3" damping="0.1"><joint joint="shoulder" coef="1"/>'
    '<joint joint="elbow" coef="-1"/></fixed></tendon></mujoco>'
)
"""Friction on a sum of joint speeds, and the end of an MJCF."""


def make(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a model that is damaged somewhere, under a sound robot file."""
    name = pick(generator, ("arm.urdf", "arm.xml"))
    base = pick(generator, ("fixed", "fixed", "floating"))
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "{name}"\nbase = "{base}"\ntorque_source = "command"\n')
    _write_damaged(generator, folder / name, (seeds / name).read_text(encoding="utf-8"))
    return ["inspect", str(seeds / "log.npz"), "-r", "robot.toml"]


def make_other(generator: np.random.Generator, folder: Path, seeds: Path) -> list[str]:
    """Write a model that is damaged somewhere, beside that of a sound robot, to replay its log with."""
    name = pick(generator, ("arm.urdf", "arm.xml"))
    text = (seeds / name).read_text(encoding="utf-8").replace("</mujoco>", TENDON)
    _write_damaged(generator, folder / name, text)
    return ["replay", str(seeds / "log.npz"), "-r", str(seeds / "robot.toml"), "-m", name, "-o", "out"]


def _write_damaged(generator: np.random.Generator, model: Path, text: str) -> None:
    """Write a model's text, damaged somewhere."""
    match int(generator.integers(20)):
        case 0:
            tag = pick(generator, ("link", "body", "robot", "model", "joint", "x"))
            model.write_text(nested(generator, f"<{tag}>", "", f"</{tag}>"), encoding="utf-8")
        case 1:
            tag = pick(generator, ("link", "body", "joint", "frame"))
            many = f'<{tag} name="x"/>' * int(10 ** generator.uniform(1, 5))
            place = pick(generator, [end for end in range(len(text)) if text[end] == "<"][2:])
            model.write_text(text[:place] + many + text[place:], encoding="utf-8")
        case 2:
            encoding = pick(generator, ("latin-1", "utf-16", "utf-8-sig", "utf-32", "ascii", "klingon"))
            text = text.replace('version="1.0"', f'version="1.0" encoding="{encoding}"')
            model.write_bytes(
                text.replace("elbow", "café").encode("utf-8" if encoding == "klingon" else encoding, "replace")
            )
        case 3:
            _make_no_file(generator, model)
        case 4 | 5 | 6:
            model.write_bytes(bytes_damaged(generator, text.encode()))
        case 7 | 8 | 9 | 10 | 11:
            for _ in range(int(generator.integers(1, 4))):
                text = text_damaged(generator, text)
            model.write_bytes(text.encode(errors="surrogatepass"))
        case _:
            for _ in range(int(generator.integers(1, 4))):
                text = xml_damaged(generator, text)
            model.write_bytes(text.encode(errors="surrogatepass"))


def _make_no_file(generator: np.random.Generator, path: Path) -> None:
    """Make a folder, a named pipe, a link to a device, or nothing."""
    match int(generator.integers(4)):
        case 0:
            path.mkdir()
        case 1:
            os.mkfifo(path)
        case 2:
            path.symlink_to("/dev/zero")
