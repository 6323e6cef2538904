"""All kinds of input: each function writes one into an empty folder and returns the words of the command that reads it.

It draws all numbers from the generator; `seeds` is a folder with a sound input of every format. Outputs are named `out`
or `out.*`.
"""

import gc
import json
import os
import shutil
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import h5py
import numpy as np
from rosbags.typesys import Stores, get_typestore
from tests.fuzz.arguments import arguments
from tests.fuzz.damage import (
    NUMBERS,
    VALUES,
    WORDS,
    bytes_damaged,
    document_damaged,
    nested,
    number_damaged,
    pick,
    text_damaged,
    value_damaged,
)
from tests.fuzz.settings import settings_file
from tests.fuzz.stores import make_store, manifest, store
from tests.log.readers.formats import WRITERS, arrays_of, messages_of, synthetic_log, write_messages

import stribeck
import stribeck_simulation
from stribeck.cli import main
from stribeck.cli.options import FORMATS
from stribeck.errors import StribeckError
from stribeck.friction import get_law
from stribeck.log.readers import read_log
from stribeck.log.writers import write_log
from stribeck.report import write_report
from stribeck.robot import Robot
from stribeck.settings import Settings, flat
from stribeck_simulation.prescribed.exact import exact_log

SCENARIO = """robot = "{robot}"
simulator = "{simulator}"
sensors = "realistic"
seed = 1
duration = 0.3
[friction]
law = "stribeck"
[friction.joints."*{joint}"]
viscous = 0.2
coulomb = 0.5
stribeck_gain = 0.2
stribeck_velocity = 0.2
"""
WALK = "[[walk]]\ncount = 0\nstand = 0.1\nforward = 0.1\n"
TENDON = '<tendon><fixed name="belt" frictionloss="0.3"><joint joint="shoulder" coef="1"/></fixed></tendon></mujoco>'
CHECKED = ("npz", "parquet", "mcap", "mcap of ROS 1")
"""Formats whose checksums, as they are written here, cover all samples: other ones must never be read."""
CHOICES = (
    *("true", "savitzky-golay", "butterworth", "log", "kinematics", "forces", "imu", "flat", "fit", "soft_l1"),
    *(
        "cauchy",
        "none",
        "inertia",
        "calibration",
        "coulomb-viscous",
        "stribeck",
        "curve-fit",
        '["elbow"]',
        "[1.0, 2.0]",
    ),
)
RUNS = (
    *(("curve-fit", law) for law in ("coulomb-viscous", "stribeck", "stribeck-exponent", "asymmetric")),
    *(("observer", law) for law in ("coulomb-viscous", "stribeck", "asymmetric")),
    *(("direct", law) for law in ("coulomb-viscous", "asymmetric")),
    *(("whole-log", law) for law in ("auto", "coulomb-viscous", "stribeck")),
)


NUMERIC = (0.0, -0.0, 1e-300, 1e12, 1e300, -1e300, np.nan, np.inf, -np.inf, 2.0**63, 1e15)


def make_seeds(folder):
    """Write an arm's models, its robot file, a log in every format, and the result of a longer one."""
    for path in (Path(__file__).parent / "models").iterdir():
        shutil.copy(path, folder)
    robot = Robot.from_file(folder / "robot.toml")
    truth = {name: {"viscous": 0.2, "coulomb": 0.5, "offset": 0.1} for name in robot.joint_names}
    log, _ = exact_log(robot, get_law("coulomb-viscous"), truth, duration=8.0)
    write_log(log.between(stop=1.0), folder / "log.npz")
    for name, write in WRITERS.items():
        (folder / "logs" / name).mkdir(parents=True)
        write(folder / "logs" / name, synthetic_log(200, joints=robot.joint_names))
    write_log(log, folder / "whole.npz")
    whole = [str(folder / "whole.npz"), "-r", str(folder / "robot.toml"), "-o", str(folder / "saved")]
    sys.argv = ["stribeck", "identify", *whole, "--quiet"]
    with suppress(SystemExit):
        main()
    shutil.copy(folder / "saved/result.json", folder)
    make_store(folder / "store", folder / "result.json")


def import_all():
    """Import all modules once for all inputs, and keep their memory shared with children."""
    for package in (stribeck, stribeck_simulation):
        for module in walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                import_module(module.name)
    gc.freeze()


def robot_file(generator, folder, seeds):
    shutil.copy(seeds / "arm.urdf", folder)
    text = (seeds / "robot.toml").read_text(encoding="utf-8")
    (folder / "robot.toml").write_bytes(document_damaged(generator, text, "toml"))
    return ["inspect", str(seeds / "log.npz"), "-r", "robot.toml"]


def model_file(generator, folder, seeds):
    """Damage a model under a sound robot file, or one that a log is replayed with; rarely a model that is no file."""
    name = pick(generator, ("arm.urdf", "arm.xml"))
    text = (seeds / name).read_text(encoding="utf-8")
    (folder / name).write_bytes(document_damaged(generator, text.replace("</mujoco>", TENDON), "xml"))
    if generator.random() < 0.05:
        (folder / name).unlink()
        pick(generator, ((folder / name).mkdir, partial(os.mkfifo, folder / name), lambda: None))()
    if generator.random() < 0.2:
        return ["replay", str(seeds / "log.npz"), "-r", str(seeds / "robot.toml"), "-m", name, "-o", "out"]
    base = pick(generator, ("fixed", "floating"))
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "{name}"\nbase = "{base}"\ntorque_source = "command"\n')
    return ["inspect", str(seeds / "log.npz"), "-r", "robot.toml"]


def set_option(generator, folder, seeds):
    for name in ("robot.toml", "arm.urdf"):
        shutil.copy(seeds / name, folder)
    words = ["inspect", str(seeds / "log.npz"), "-r", "robot.toml"]
    if generator.random() < 0.05:  # these take longer
        words = ["identify", str(seeds / "log.npz"), "-r", "robot.toml", "-o", "out", "--method", "curve-fit"]
    for _ in range(pick(generator, (1, 1, 1, 2, 3))):
        key = pick(generator, (*flat(Settings()), pick(generator, WORDS)))
        if generator.random() < 0.1:
            key += f".{pick(generator, ('x', 'kind', '', '.'))}" * int(10 ** generator.uniform(0, 3))
        number, large = str(10 ** generator.uniform(-3, 9)), str(int(10 ** generator.uniform(0, 4)))
        of_json, deep = json.dumps(pick(generator, VALUES)), nested(generator, "[", "1", "]")
        value = pick(
            generator, (number, large, of_json, deep, *(pick(generator, own) for own in (CHOICES, NUMBERS, WORDS)))
        )
        words += ["--set", f"{key}={value}".replace("\0", "").encode(errors="replace").decode()[:100_000]]
    return words


def result_file(generator, folder, seeds):
    """Damage a result, to be compared or exported."""
    text = (seeds / "result.json").read_text(encoding="utf-8")
    (folder / "result.json").write_bytes(document_damaged(generator, text, "json"))
    if generator.random() < 0.7:
        pair = generator.permutation(["result.json", str(seeds / "result.json")]).tolist()
        return ["compare", *pick(generator, (["result.json"], pair, ["result.json", "result.json"], [*pair, "--json"]))]
    target = ["--to", pick(generator, tuple(FORMATS)), "-o", "out"]
    more = pick(generator, (["--include-weak"], ["--samples", "2"], ["--ranges"], ["--strict"], []))
    return ["export", "result.json", "-r", str(seeds / "robot.toml"), *target, *more]


def saved_result(generator, folder, seeds):
    """Damage numbers and structure of a result, or the table next to it, for its report."""
    for name in ("result.json", "friction_torque.parquet"):
        shutil.copy(seeds / "saved" / name, folder)
    if generator.random() < 0.1:
        table = folder / "friction_torque.parquet"
        table.write_bytes(bytes_damaged(generator, table.read_bytes()))
    else:
        document = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        for _ in range(int(generator.integers(1, 4))):
            change = pick(generator, (value_damaged, number_damaged, number_damaged))
            document = change(generator, document)
        (folder / "result.json").write_text(json.dumps(document), encoding="utf-8", errors="replace")
    return ["result.json", "out.html"]


def write_saved_report():
    """Write a report as the command line does, which reports no saved results."""
    try:
        write_report(*sys.argv[1:])
    except StribeckError as error:
        print(f"stribeck: {error}", file=sys.stderr)
        sys.exit(error.exit_code)


def scenario_file(generator, folder, seeds):  # noqa: ARG001 - made from nothing
    exact = SCENARIO.format(robot="arm", simulator="exact", joint="")
    walk = SCENARIO.format(robot="biped", simulator="constrained", joint="_knee") + WALK
    text = pick(generator, (exact, exact, exact, walk))
    (folder / "scenario.toml").write_bytes(document_damaged(generator, text, "toml"))
    return ["simulate", "scenario.toml", "-o", pick(generator, ("out.npz", "out.npz", "out", "out.csv"))]


def damaged_log(name, generator, folder, seeds):
    """Damage the bytes or words of a log; rarely make it a pipe, or longer by a hole of a terabyte."""
    sound = next((seeds / "logs" / name).iterdir())
    path = folder / sound.name
    (shutil.copytree if sound.is_dir() else shutil.copy)(sound, path)
    file = pick(generator, sorted(path.iterdir())) if path.is_dir() else path
    content = file.read_bytes()
    for _ in range(int(generator.geometric(0.7))):
        if file.suffix in (".csv", ".yaml") and generator.random() < 0.3:
            content = text_damaged(generator, content.decode(errors="replace")).encode(errors="surrogatepass")
        else:
            content = bytes_damaged(generator, content)
    file.write_bytes(content)
    if generator.random() < 0.02:
        os.truncate(file, len(content) + (1 << 40))
    if generator.random() < 0.01:
        file.unlink()
        os.mkfifo(file)
    return ["inspect", path.name, "-r", str(seeds / "robot.toml")]


def other_samples(name, command, folder, seeds):
    """Return whether a log that was accepted has other samples than were written."""
    robot = Robot.from_file(seeds / "robot.toml")
    paths = seeds / "logs" / name / command[1], folder / command[1]
    written, read = (read_log(path, robot).channels() for path in paths)
    return any(
        name in read and not np.array_equal(read[name], channel, equal_nan=True)
        for name, channel in written.items()
        if channel.dtype.kind == "f"
    )


def strange_log(generator, folder, seeds):
    """Write a whole file that contains what no log means: arrays or messages changed, lost or exchanged."""
    log = synthetic_log(200, joints=Robot.from_file(seeds / "robot.toml").joint_names)
    path = folder / pick(generator, ("log.npz", "log.h5", "log.mcap"))
    if path.suffix == ".mcap":
        sent = [list(message) for message in messages_of(log, get_typestore(Stores.ROS2_HUMBLE))]
        for _ in range(int(10 ** generator.uniform(0, 2.5))):
            change_message(generator, pick(generator, sent))
        write_messages(path, map(tuple, sent))
    else:
        arrays = arrays_of(log)
        for _ in range(int(generator.integers(1, 4))):
            change_array(generator, arrays)
        write_arrays(path, arrays)
    return ["inspect", path.name, "-r", str(seeds / "robot.toml")]


def write_arrays(path, arrays):
    if path.suffix == ".npz":
        np.savez(path, **arrays)
        return
    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file[name] = np.asarray(array).astype("S") if np.asarray(array).dtype.kind == "U" else array


@np.errstate(all="ignore")
def change_array(generator, arrays):
    """Give one of the arrays other values, another type or shape, or that of another name."""
    name, other = (pick(generator, sorted(arrays)) for _ in range(2))
    array, number = np.array(arrays[name]), pick(generator, NUMERIC)
    kind = pick(generator, ("f2", "i8", "u1", "S8", "?", "c16", "U4"))
    changes = (
        lambda: array.astype(kind, casting="unsafe"),
        lambda: array[: int(generator.integers(0, len(array) + 1))],
        lambda: pick(generator, (array.T, array[..., None], array[0], np.repeat(array, 2, axis=0))),
        lambda: array[generator.permutation(len(array))],
        lambda: np.where(generator.random(array.shape) < 0.01, number, array),
        lambda: array * number,
        lambda: arrays[other],
    )
    try:
        arrays[name] = pick(generator, changes)()
    except (TypeError, ValueError, IndexError):  # such a change is not possible
        del arrays[name]


def change_message(generator, sent):
    """Give a message another stamp, or other names or numbers of joints."""
    _, _, _, message = sent
    match int(generator.integers(4)):
        case 0:
            sent[2] = int(pick(generator, (0, 1, 2**62, 2**64 - 1)))
        case 1 if hasattr(message, "header"):
            message.header.stamp.sec = int(pick(generator, (0, -1, 2**31 - 1, -(2**31))))
        case 2 if hasattr(message, "name"):
            message.name = pick(generator, (["", "x", "\x00"], message.name[:1] * 3, message.name[::-1]))
        case 3 if hasattr(message, "name"):
            channel = pick(generator, ("position", "velocity", "effort"))
            part = getattr(message, channel)[: int(generator.integers(4))]
            setattr(message, channel, part * pick(generator, NUMERIC))


def extreme_run(generator, folder, seeds):  # noqa: ARG001 - made from nothing
    """Identify an arm of grams or tonnes, with joints that stand, no or much friction, no noise, coarse encoders."""
    mass, size = 10 ** generator.uniform(-4, 4), 10 ** generator.uniform(-2, 1)
    inertia = " ".join(
        f'i{axes}="{0.2 * mass * size**2 * (axes[0] == axes[1])}"' for axes in ["xx", "xy", "xz", "yy", "yz", "zz"]
    )
    body = f'<inertial><origin xyz="0 0 {size / 3}"/><mass value="{mass}"/><inertia {inertia}/></inertial>'
    text = f'<robot name="extreme"><link name="link0">{body}</link>'
    joints = int(generator.integers(2, 4))
    for k in range(1, joints + 1):
        kind = pick(generator, ("revolute", "continuous", "prismatic"))
        axis = pick(generator, ("1 0 0", "0 1 0", "0 0 1"))
        empty = k < joints and generator.random() < 0.1
        text += (
            f'<link name="link{k}">{body * (not empty)}</link><joint name="joint{k}" type="{kind}">'
            f'<parent link="link{k - 1}"/><child link="link{k}"/><origin xyz="0 0 {size}"/><axis xyz="{axis}"/>'
            f'<limit lower="{-3 * size}" upper="{3 * size}" effort="{1e3 * mass * size}" velocity="10"/></joint>'
        )
    (folder / "model.urdf").write_text(text + "</robot>", encoding="utf-8")
    (folder / "robot.toml").write_text('[robot]\nmodel = "model.urdf"\nbase = "fixed"\n', encoding="utf-8")
    robot = Robot.from_file(folder / "robot.toml")
    level = pick(generator, (0.3, 0.3, 0.0, 1e-6, 1e4)) * mass * size
    truth = {name: {"viscous": level, "coulomb": level, "offset": 0.1 * level} for name in robot.joint_names}
    log, _ = exact_log(robot, get_law("coulomb-viscous"), truth, duration=4.0, rate=pick(generator, (50.0, 250.0)))
    position, torque, column = log.position.copy(), log.torque.copy(), int(generator.integers(joints))
    torque += pick(generator, (0.0, 1e-4, 0.1)) * torque.std(axis=0) * generator.normal(size=torque.shape)
    position[:, column] = pick(generator, (position[:, column], 0 * log.time, log.time, 1e-4 * position[:, column]))
    torque[:, column] *= pick(generator, (1, 1, 0))
    step = pick(generator, (1e-9, 1e-5, 1e-2))
    coarse = replace(log, position=np.round(position / step) * step, torque=torque, velocity=None, acceleration=None)
    write_log(coarse, folder / "log.npz")
    method, law = pick(generator, RUNS)
    words = ["identify", "log.npz", "-r", "robot.toml", "-o", "out", "--force", "--method", method, "--law", law]
    return words + ["--set", "block=0.2"] * (generator.random() < 0.8)


def inconsistent(command, folder, seeds):  # noqa: ARG001 - of one kind of command
    """Return whether a result has an interval that is none."""
    found = json.loads((folder / "out/result.json").read_text(encoding="utf-8"))
    parts = [
        part for joint in found["joints"].values() for part in (*joint["parameters"].values(), *(joint["curve"] or ()))
    ]
    return not all(part["standard_error"] >= 0 and np.diff(part["interval_95"]) >= 0 for part in parts)


@dataclass(frozen=True)
class Kind:
    """How an input is made, its share of all, and whether one that was accepted is wrong."""

    make: Callable
    share: float
    wrong: Callable | None = None
    main: Callable | None = None  # instead of the command line


KINDS = {
    "robot-file": Kind(robot_file, 1.0),
    "model-file": Kind(model_file, 1.8),
    "set-option": Kind(set_option, 0.7),
    "result-file": Kind(result_file, 1.0),
    "saved-result": Kind(saved_result, 0.3, main=write_saved_report),
    "settings": Kind(settings_file, 1.0),
    "store": Kind(store, 0.4),
    "manifest": Kind(manifest, 0.3),
    "arguments": Kind(arguments, 0.7),
    "scenario-file": Kind(scenario_file, 0.3),
    "log-strange": Kind(strange_log, 1.0),
    "run-extreme": Kind(extreme_run, 0.1, inconsistent),
    **{
        f"log-{name.replace(' ', '-')}": Kind(
            partial(damaged_log, name), 0.3, partial(other_samples, name) if name in CHECKED else None
        )
        for name in WRITERS
    },
}
