"""Changes of friction in a fleet of one arm: how soon they are seen, and how often nothing is seen that did not happen.

    python -m studies.fleet --save studies/fleet.json

Ten robots have 20 logs of ten seconds each, a week apart. Friction differs by 8 % from robot to robot and by 2 % from
log to log. From the 13th log on, the elbow of r03 has 25 % more friction; from the 9th log on, the shoulder of r06 has
20 % more Coulomb friction; all friction of r07 is twice that of the others. Encoders and torque sensors have
white noise. Each log is identified by `curve-fit`, and `stribeck trends` reads the store.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from tests.arm import needed_torque, write_arm

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot
from stribeck.service.fleet import find_trends
from studies.command import Row, command
from studies.markdown import markdown_table

ROBOTS, LOGS, SECONDS, RATE = 10, 20, 10.0, 200.0
COULOMB, VISCOUS = np.array([1.2, 0.8, 2.0]), np.array([0.3, 0.2, 1.0])
WEAR = {("r03", "elbow"): 12, ("r06", "shoulder"): 8}
"""First log with more friction, of robot and joint."""
ODD = "r07"
SETTINGS = """
[identify]
method = "curve-fit"

[identify.filter]
kind = "savitzky-golay"
window = 31
"""


def write_fleet(folder: Path, seed: int) -> None:
    """Write model, robot file and each robot's logs."""
    robot, generator = Robot.from_file(write_arm(folder, SETTINGS)), np.random.default_rng(seed)
    for number in range(ROBOTS):
        name = f"r{number:02d}"
        own = (1 + 0.08 * generator.standard_normal((2, 3))) * (2 if name == ODD else 1)
        place = folder / "logs" / name
        place.mkdir(parents=True)
        for log in range(LOGS):
            friction = own * (1 + 0.02 * generator.standard_normal((2, 3)))
            friction[:, 1] *= 1.25 if name == "r03" and log >= WEAR[name, "elbow"] else 1
            friction[0, 0] *= 1.2 if name == "r06" and log >= WEAR[name, "shoulder"] else 1
            path = place / f"log_{log:02d}.npz"
            channels = _channels(robot, friction, generator) | {"joint_names": np.array(robot.joint_names)}
            np.savez(path, allow_pickle=False, **channels)
            start = 1767225600 + 7 * 86400 * log + 60 * number
            os.utime(path, (start, start))


def _channels(robot: Robot, friction: Array, generator: np.random.Generator) -> dict[str, Array]:
    """Simulate one log: sums of four sines per joint, with friction scaled by factors of shape (2, 3)."""
    time = np.arange(round(SECONDS * RATE)) / RATE
    omega = 2 * np.pi * generator.uniform(0.3, 1.6, (4, 1, 3))
    angle = omega * time[:, None] + generator.uniform(0, 2 * np.pi, (4, 1, 3))
    size = generator.uniform(0.3, 0.6, (4, 1, 3)) / omega
    q = np.sum(size * np.sin(angle), axis=0)
    v = np.sum(size * omega * np.cos(angle), axis=0)
    a = -np.sum(size * omega**2 * np.sin(angle), axis=0)
    torque = needed_torque(robot, q, v, a)
    torque += COULOMB * friction[0] * np.tanh(v / 0.01) + VISCOUS * friction[1] * v
    noise = generator.standard_normal((2, *q.shape))
    return {"time": time, "position": q + 1e-5 * noise[0], "torque": torque + 0.03 * noise[1]}


def measure(seed: int) -> Row:
    """Identify a fleet, and compare what `trends` finds with the truth."""
    with tempfile.TemporaryDirectory() as folder:
        write_fleet(Path(folder), seed)
        command = [sys.executable, "-m", "stribeck", "fleet", "logs", "-r", "robot.toml", "-o", "store"]
        subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, check=True)
        found = find_trends(Path(folder) / "store")
    seen, false = dict[str, int](), list[str]()
    for alarm in found.alarms:
        onset, name = WEAR.get((alarm.robot, alarm.joint)), f"{alarm.robot} {alarm.joint}"
        if onset is None or name in seen:
            false.append(alarm.line)
        else:
            seen[name] = int(Path(alarm.seen).stem[-2:]) - onset + 1
    odd = sorted({each.robot for each in found.odd})
    return {"seen": seen, "false": false, "odd": odd}


def tables(rows: list[Row]) -> list[str]:
    """Count changes that were seen, false alarms, and odd robots."""
    delays = [delay for row in rows for delay in row["seen"].values()]
    changes, logs = len(WEAR) * len(rows), ROBOTS * LOGS * len(rows)
    lines = [
        ["changes seen", f"{len(delays)} of {changes}"],
        ["of these within three logs", sum(delay <= 3 for delay in delays)],
        ["false alarms", f"{sum(len(row['false']) for row in rows)} in {logs:,} logs"],
        ["only the odd robot stands out", f"{sum(row['odd'] == [ODD] for row in rows)} of {len(rows)}"],
    ]
    return [markdown_table(["fleets of ten robots", f"{len(rows)} seeds"], lines)]


if __name__ == "__main__":
    command(__doc__, [{"seed": seed} for seed in range(10)], measure, tables)
