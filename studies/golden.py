"""Freeze the results and arrays of logs, and print the numbers that differ.

    python -m studies.golden [--write] [CASE ...]

A change of the code's structure moves no number. With STRIBECK_EVERYDAY and STRIBECK_REAL_LOGS, everyday logs
and real robots are compared, too. `--write` freezes the present numbers of cases that differ; the commit says which
moved, and why. Saved studies of estimates are then stale.
"""

import argparse
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tests.arm import arm_log, write_arm
from tests.command_logs import clamped_quadruped
from tests.loops import leg, loop_log
from tests.models import STRIBECK

from stribeck import Robot, identify, read_log
from stribeck.core.errors import StribeckError
from stribeck.core.friction import Stribeck
from stribeck.core.result import Result
from stribeck.io.writers import write_log
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.run import POSTURES
from stribeck.simulation.sensors.measure import with_noise
from studies.changes import packaged
from studies.command import REAL, ROOT, real_robot

FILE = ROOT / "tests" / "golden.json"
Files = tuple[list[Path], Path]
"""Paths of logs, and of a robot file."""


def arm(folder: Path, logs: int = 1) -> Files:
    """Write noisy logs of the arm with three joints."""
    robot = Robot.from_file(write_arm(folder))
    paths = [folder / f"log_{k}.npz" for k in range(logs)]
    for k, path in enumerate(paths):
        write_log(with_noise(arm_log(robot, 8.0, 250.0, seed=k), position=2e-5, torque=0.02, seed=k), path)
    return paths, Path(robot.path)


def walk(robot_file: str, model: str, folder: Path) -> Files:
    """Write a noisy walk of a packaged robot."""
    path = folder / "robot.toml"
    path.write_text(packaged(robot_file, model))
    robot = Robot.from_file(path)
    truth = {name: STRIBECK for name in robot.joint_names if name not in robot.position_controlled}
    log, _ = exact_log(robot, Stribeck(), truth, duration=8.0, rate=250.0, posture=POSTURES.get(model.split(".")[0]))
    write_log(with_noise(log, position=2e-5, torque=0.05, seed=1), folder / "log.npz")
    return [folder / "log.npz"], path


def loops(folder: Path) -> Files:
    """Write a noisy log of a leg with closed loops."""
    robot = leg(folder, "fixed")
    write_log(with_noise(loop_log(robot), position=2e-5, torque=0.02, seed=1), folder / "log.npz")
    return [folder / "log.npz"], Path(robot.path)


def written(write: Callable[..., object], folder: Path, **settings: Any) -> Files:
    """Write a log with a function of the tests."""
    write(folder, **settings)
    return [folder / "log.npz"], folder / "robot.toml"


def shared(name: str, log: str, _: Path) -> Files:
    """Find an everyday log, or the log of a real robot."""
    folder = Path(os.environ["STRIBECK_EVERYDAY"]) / name if name in EVERYDAY else real_robot(name)
    return [folder / f"{log}.npz"], folder / "robot.toml"


QUICK: dict[str, Callable[[Path], Files]] = {
    "arm": arm,
    "loops": loops,
    "commands": partial(written, clamped_quadruped, seconds=8.0),
}
"""Logs that the repository makes and tests compare."""
CASES = QUICK | {
    "two logs": partial(arm, logs=2),
    "biped": partial(walk, "robot.toml", "biped.urdf"),
    "humanoid": partial(walk, "toro.toml", "toro.xml"),
    "quadruped": partial(walk, "quadruped.toml", "quadruped.urdf"),
}
"""All logs that the repository makes."""
EVERYDAY = {"trot": "trot", "payload": "log", "mobile": "log"}
METHODS = {"arm": ("curve-fit", "direct", "observer"), "humanoid": ("ground-reaction",)}
"""Methods besides the default."""


def frozen(make: Callable[[Path], Files], methods: tuple[str, ...] = ()) -> dict[str, Any]:
    """Read logs, identify them by all methods, and list all numbers."""
    with tempfile.TemporaryDirectory() as folder:
        paths, path = make(Path(folder))
        robot = Robot.from_file(path)
        arrays = {name: array for name, array in vars(read_log(paths[0], robot)).items() if hasattr(array, "dtype")}
        numbers: dict[str, Any] = {"log": {name: digest(array) for name, array in arrays.items()}}
        for method in (robot.settings.method, *methods):
            try:
                settings = robot.settings.model_copy(update={"method": method})
                numbers[method] = of_result(identify(paths, robot, settings))
            except StribeckError as error:
                numbers[method] = str(error).replace(folder, "")
    rounded: dict[str, Any] = json.loads(json.dumps(numbers), parse_float=lambda text: float(f"{float(text):.12g}"))
    return rounded


def digest(array: np.ndarray) -> list[object]:
    """Summarize an array: sum, and hash."""
    return [float(np.nansum(array)), hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]]


def of_result(result: Result) -> dict[str, Any]:
    """List the numbers, verdicts and findings of a result."""
    document = json.loads(replace(result, evidence=None).to_json())
    joints = document["joints"] | document.get("couplings", {})
    kept = ("verdict", "reason", "torque_r2", "validation")
    corrections = document.get("corrections") or {}
    corrections.pop("correlation", None)
    corrections["bodies"] = {name: list(body.values())[:3] for name, body in corrections.get("bodies", {}).items()}
    return {
        "joints": {
            name: {key: joint.get(key) for key in kept}
            | {key: list(estimate.values())[:2] for key, estimate in joint["parameters"].items()}
            | {"curve": [list(point.values())[1:3] for point in joint["curve"]]}
            for name, joint in joints.items()
        },
        "corrections": corrections,
        "findings": [finding["text"] for finding in document.get("findings", [])],
    }


def differences(before: object, now: object, tolerance: float, place: str = "") -> Iterator[str]:
    """List the places where numbers differ by more than a share of their size, or other values differ."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys([*before, *now]):
            yield from differences(before.get(key), now.get(key), tolerance, f"{place} / {key}")
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for k, pair in enumerate(zip(before, now, strict=True)):
            yield from differences(*pair, tolerance, f"{place} / {k}")
    elif isinstance(before, float) and isinstance(now, float):
        if abs(before - now) > tolerance * max(abs(before), abs(now)) + 1e-12:
            yield f"{place}: {before:.12g} -> {now:.12g}"
    elif before != now:
        yield f"{place}: {before} -> {now}"


def read() -> dict[str, Any]:
    """Read the frozen numbers."""
    numbers: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return numbers


def main() -> int:
    """Compare or freeze all cases with available logs; return 1 if a number differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="freeze the present numbers of cases that differ")
    parser.add_argument("cases", nargs="*", metavar="CASE")
    options = parser.parse_args()
    cases = dict(CASES)
    everyday, real = "STRIBECK_EVERYDAY" in os.environ, "STRIBECK_REAL_LOGS" in os.environ
    cases |= {name: partial(shared, name, log) for name, log in EVERYDAY.items() if everyday}
    cases |= {name: partial(shared, name, log) for name, log in REAL.items() if real}
    before = read() if FILE.exists() else {}
    count = 0
    for name in options.cases or cases:
        now = frozen(cases[name], METHODS.get(name, ()))
        changes = list(differences(before.get(name), now, 1e-9, name))
        count += len(changes)
        before[name] = now if changes else before[name]
        print(f"{name}: {len(changes)} differences", *changes[:20], sep="\n  ", flush=True)
    if options.write and count:
        rows = ",\n".join(f"{json.dumps(name)}: {json.dumps(numbers)}" for name, numbers in before.items())
        FILE.write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")
    return int(bool(count))


if __name__ == "__main__":
    sys.exit(main())
