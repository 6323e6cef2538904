"""Robot files in which any key of any table has a value that is wrong, extreme or of another type."""

import shutil
import tomllib
from types import UnionType
from typing import Annotated, Literal, Union, get_args, get_origin

from tests.fuzz.damage import NUMBERS, VALUES, WORDS, as_toml, pick

from stribeck.settings import RobotFile, Table

EXTREMES = (0, 1, -1, 0.5, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, -1e12, 1e12, 3, 5, 99_999)
NAMES = (
    "link0",
    "base",
    "upper_arm",
    "forearm",
    "shoulder",
    "elbow",
    "log",
    "log.npz",
    "A",
    "deg",
    "ns",
    "Nm",
    "position",
    "x",
    "",
)


def settings_file(generator, folder, seeds):
    """Give a sound robot file one to three other values, of any of its keys."""
    shutil.copy(seeds / "arm.urdf", folder)
    document = tomllib.loads((seeds / "robot.toml").read_text(encoding="utf-8"))
    if generator.random() < 0.3:
        document["contacts"] = {"foot": {"frame": pick(generator, NAMES)}}
    for _ in range(int(generator.integers(1, 4))):
        change(generator, document, RobotFile)
    (folder / "robot.toml").write_text(as_toml(document), encoding="utf-8", errors="replace")
    log = str(seeds / "log.npz")
    if generator.random() < 0.15:  # these take longer
        method = pick(generator, ("whole-log", "curve-fit", "direct"))
        return ["identify", log, "-r", "robot.toml", "-o", "out", "--force", "--method", method]
    return ["inspect", log, "-r", "robot.toml", *pick(generator, ([], [], ["-o", "out.html"], ["--json"]))]


def change(generator, document, table):
    """Give one key of a table, or of one of its tables, a value; its type is mostly the right one."""
    name = pick(generator, tuple(table.model_fields))
    inner = table.model_fields[name].annotation
    if isinstance(inner, type) and issubclass(inner, Table) and generator.random() < 0.95:
        if isinstance(document.setdefault(name, {}), dict):
            change(generator, document[name], inner)
    else:
        document[name] = value_of(generator, inner)


def value_of(generator, kind):
    """Draw a value of a type, at the edge of what the type allows, or rarely of another type."""
    if generator.random() < 0.1:
        return pick(generator, (*VALUES, *NUMBERS, *WORDS))
    if kind is None or kind is type(None) or kind is str:
        return pick(generator, NAMES)
    if kind is bool:
        return bool(generator.integers(2))
    if kind in (float, int):
        return pick(generator, EXTREMES)
    if isinstance(kind, type) and issubclass(kind, Table):
        inner = {name: value_of(generator, each.annotation) for name, each in kind.model_fields.items()}
        return {key: value for key, value in inner.items() if generator.random() < 0.8}
    origin, own = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return value_of(generator, own[0])
    if origin in (UnionType, Union):
        return value_of(generator, pick(generator, own))
    if origin is Literal:
        return pick(generator, own)
    if origin is dict:
        return {pick(generator, NAMES): value_of(generator, own[1]) for _ in range(int(generator.integers(3)))}
    if origin is tuple:
        return [value_of(generator, each) for each in own]
    return [value_of(generator, own[0]) for _ in range(int(generator.integers(4)))]
