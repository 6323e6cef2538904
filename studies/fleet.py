"""Changes of friction in a fleet of one arm: how soon they are seen, and how often nothing is seen that did not happen.

    python -m studies.fleet --save studies/fleet.json

Ten robots have 20 logs of ten seconds each, a week apart. Friction differs by 8 % from robot to robot and by 2 % from
log to log. From the 13th log on, the elbow of r03 has 25 % more friction; from the 9th log on, the shoulder of r06 has
20 % more Coulomb friction; all friction of r07 is twice that of the others. Encoders and torque sensors have
white noise. Five logs are damaged, one needs more memory than allowed, one would take an hour. Each log is identified
by `curve-fit`, and `stribeck trends` reads the store.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import pinocchio as pin
from tests.arm import write_arm

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot
from stribeck.service.fleet import connect, find_trends
from studies.command import Row, command, rounded
from studies.markdown import markdown_table

ROBOTS, LOGS, SECONDS, RATE = 10, 20, 10.0, 200.0
COULOMB, VISCOUS = np.array([1.2, 0.8, 2.0]), np.array([0.3, 0.2, 1.0])
WEAR = {("r03", "elbow"): 12, ("r06", "shoulder"): 8}
"""First log with more friction, of robot and joint."""
ODD = "r07"
TIMEOUT, MEMORY = 20.0, 1.0
"""Limits of each log [s], [GB]."""
WRONG = {"refused": 5, "memory": 1, "timeout": 1}
"""Number of logs without a result, by status."""
SETTINGS = """
[identify]
method = "curve-fit"

[identify.filter]
kind = "savitzky-golay"
window = 31
"""


def write_fleet(folder: Path, seed: int) -> Path:
    """Write model, robot file and logs, and return the robot file."""
    robot_file = write_arm(folder, SETTINGS)
    robot, generator = Robot.from_file(robot_file), np.random.default_rng(seed)
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
    _damage(folder / "logs")
    return robot_file


def _damage(logs: Path) -> None:
    """Damage one log of each of five robots; let one more need several gigabytes, and one an hour."""
    paths = [logs / name / "log_05.npz" for name in ("r00", "r01", "r02", "r04", "r05", "r08", "r09")]
    start = [path.stat().st_mtime for path in paths]
    whole = dict(np.load(paths[0]))
    paths[0].write_bytes(paths[0].read_bytes()[:5000])
    np.savez(paths[1], allow_pickle=False, **whole | {"torque": np.full_like(whole["torque"], np.nan)})
    np.savez(paths[2], allow_pickle=False, **whole | {"joint_names": np.array(["j1", "j2", "j3"])})
    np.savez(paths[3], allow_pickle=False, **whole | {"time": 0 * whole["time"]})
    np.savez(paths[4], allow_pickle=False, **{name: whole[name] for name in ("time", "position", "joint_names")})
    large = {name: np.zeros((20_000_000, 3)) for name in ("position", "torque")} | {"time": np.arange(2e7) / RATE}
    np.savez_compressed(paths[5], allow_pickle=False, **large, joint_names=whole["joint_names"])
    os.truncate(paths[6], 1 << 40)  # reading a terabyte takes longer than anyone waits
    for path, own in zip(paths, start, strict=True):
        os.utime(path, (own, own))


def _channels(robot: Robot, friction: Array, generator: np.random.Generator) -> dict[str, Array]:
    """Simulate one log: sums of four sines per joint, with friction scaled by factors of shape (2, 3)."""
    time = np.arange(round(SECONDS * RATE)) / RATE
    omega = 2 * np.pi * generator.uniform(0.3, 1.6, (4, 1, 3))
    angle = omega * time[:, None] + generator.uniform(0, 2 * np.pi, (4, 1, 3))
    size = generator.uniform(0.3, 0.6, (4, 1, 3)) / omega
    q = np.sum(size * np.sin(angle), axis=0)
    v = np.sum(size * omega * np.cos(angle), axis=0)
    a = -np.sum(size * omega**2 * np.sin(angle), axis=0)
    model, data = robot.tree.model, robot.tree.model.createData()
    torque = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    torque += COULOMB * friction[0] * np.tanh(v / 0.01) + VISCOUS * friction[1] * v
    noise = generator.standard_normal((2, *q.shape))
    return {"time": time, "position": q + 1e-5 * noise[0], "torque": torque + 0.03 * noise[1]}


def measure(seed: int) -> Row:
    """Identify a fleet, and compare what `trends` finds with the truth."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        options = ["--timeout", str(TIMEOUT), "--memory", str(MEMORY), "--json"]
        options += ["-r", str(write_fleet(place, seed)), "-o", str(place / "store")]
        run = [sys.executable, "-m", "stribeck", "fleet", str(place / "logs"), *options]
        done = subprocess.run(run, stdout=subprocess.PIPE, check=False)
        wrong = [(each["status"], each["error"].partition(": ")[2]) for each in json.loads(done.stdout)["failed"]]
        with connect(place / "store") as store:
            counts = dict(store.execute("SELECT status, count(*) FROM logs GROUP BY 1 ORDER BY 1").fetchall())
            longest, most = store.execute("SELECT max(seconds), max(peak_memory) FROM logs").fetchall()[0]
        found = find_trends(place / "store")
    seen, false = dict[str, int](), list[str]()
    for alarm in found.alarms:
        onset, name = WEAR.get((alarm.robot, alarm.joint)), f"{alarm.robot} {alarm.joint}"
        if onset is None or name in seen:
            false.append(alarm.line)
        else:
            seen[name] = int(Path(alarm.seen).stem[-2:]) - onset + 1
    limits = {"exit": done.returncode, "seconds": rounded(longest), "memory": rounded(most)}
    odd = sorted({each.robot for each in found.odd})
    return {"logs": counts, "wrong": wrong, **limits, "seen": seen, "false": false, "odd": odd}


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
    kept = sum(row["exit"] == 3 and Counter(each for each, _ in row["wrong"]) == WRONG for row in rows)
    lines += [
        ["exit code 3, and the seven wrong logs are rows of their kind", f"{kept} of {len(rows)}"],
        [f"longest time of a log, allowed are {TIMEOUT:g} s", f"{max(row['seconds'] for row in rows):.3g} s"],
        [f"most memory of a log, allowed is {MEMORY:g} GB", f"{max(row['memory'] for row in rows):.2g} GB"],
    ]
    wrong = [[status, error] for status, error in rows[0]["wrong"]] if rows else []
    return [
        markdown_table(["fleets of ten robots", f"{len(rows)} seeds"], lines),
        markdown_table(["status of wrong logs, first seed", "error"], wrong),
    ]


if __name__ == "__main__":
    command(__doc__, ({"seed": seed} for seed in range(20)), measure, tables)
