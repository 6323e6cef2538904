"""Changes of friction in a fleet of one arm: how soon they are seen, and how often nothing is seen that did not happen.

    python -m studies.fleet --save studies/fleet.json

Ten robots have 20 logs of ten seconds each, a week apart. Friction differs by 8 % from robot to robot and by 2 % from
log to log. From the 13th log on, the elbow of r03 has 25 % more friction; from the 9th log on, the shoulder of r06 has
20 % more Coulomb friction; all friction of r07 is twice that of the others. Encoders and torque sensors have
white noise. Each log is identified by `curve-fit`, and `stribeck trends` reads the store.

The run "ray" (`--only ray`) identifies 300 shorter logs on a Ray cluster of two nodes, which is found by its address.
The run is killed and repeated, and its rows are compared with those of processes of this machine.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from tests.arm import write_arm

from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot
from stribeck.service.fleet import connect, find_trends
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


def write_fleet(folder: Path, seed: int, logs: int = LOGS, seconds: float = SECONDS) -> Path:
    """Write model, robot file and each robot's logs, and return the robot file."""
    robot_file = write_arm(folder, SETTINGS)
    robot, generator = Robot.from_file(robot_file), np.random.default_rng(seed)
    for number in range(ROBOTS):
        name = f"r{number:02d}"
        own = (1 + 0.08 * generator.standard_normal((2, 3))) * (2 if name == ODD else 1)
        place = folder / "logs" / name
        place.mkdir(parents=True)
        for log in range(logs):
            friction = own * (1 + 0.02 * generator.standard_normal((2, 3)))
            friction[:, 1] *= 1.25 if name == "r03" and log >= WEAR[name, "elbow"] else 1
            friction[0, 0] *= 1.2 if name == "r06" and log >= WEAR[name, "shoulder"] else 1
            path = place / f"log_{log:02d}.npz"
            channels = _channels(robot, friction, generator, seconds) | {"joint_names": np.array(robot.joint_names)}
            np.savez(path, allow_pickle=False, **channels)
            start = 1767225600 + 7 * 86400 * log + 60 * number
            os.utime(path, (start, start))
    return robot_file


def _channels(robot: Robot, friction: Array, generator: np.random.Generator, seconds: float) -> dict[str, Array]:
    """Simulate one log: sums of four sines per joint, with friction scaled by factors of shape (2, 3)."""
    time = np.arange(round(seconds * RATE)) / RATE
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


def measure(seed: int = 0, engine: str = "") -> Row:
    """Identify a fleet, and compare what `trends` finds with the truth."""
    if engine:
        return resumed()
    with tempfile.TemporaryDirectory() as folder:
        write_fleet(Path(folder), seed)
        subprocess.run(fleet(Path(folder)), stdout=subprocess.DEVNULL, check=True)
        found = find_trends(Path(folder) / "loky")
    seen, false = dict[str, int](), list[str]()
    for alarm in found.alarms:
        onset, name = WEAR.get((alarm.robot, alarm.joint)), f"{alarm.robot} {alarm.joint}"
        if onset is None or name in seen:
            false.append(alarm.line)
        else:
            seen[name] = int(Path(alarm.seen).stem[-2:]) - onset + 1
    odd = sorted({each.robot for each in found.odd})
    return {"seen": seen, "false": false, "odd": odd}


def fleet(folder: Path, backend: str = "loky") -> list[str]:
    """Make the command that identifies the logs of a folder into a store there, which is named after the backend."""
    command = [sys.executable, "-m", "stribeck", "fleet", str(folder / "logs"), "-r", str(folder / "robot.toml")]
    return [*command, "-o", str(folder / backend), "--backend", backend]


def resumed() -> Row:
    """Kill and resume a run on a Ray cluster of two nodes, and compare its rows with those of processes."""
    from ray.cluster_utils import Cluster

    cluster, count = Cluster(initialize_head=True, head_node_args={"num_cpus": 1}), 0
    cluster.add_node(num_cpus=1)
    os.environ["RAY_ADDRESS"] = cluster.address
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_fleet(folder, 0, 30, 6.0)
        with subprocess.Popen(fleet(folder, "ray"), stdout=subprocess.DEVNULL) as run:
            while run.poll() is None and (count := len(list(folder.glob("ray/robot=*/*.parquet")))) < 100:
                time.sleep(0.1)
            run.kill()
        for backend in ("ray", "loky"):
            subprocess.run(fleet(folder, backend), stdout=subprocess.DEVNULL, check=True)
        logs, same = rows_of(folder / "ray"), rows_of(folder / "loky")
    cluster.shutdown()  # type: ignore[no-untyped-call]
    return {"logs": len(logs), "killed": count, "identical": logs == same}


def rows_of(store: Path) -> list[Any]:
    """Read each log's row with its curves, except times and memory."""
    columns = "logs.* EXCLUDE (finished, seconds, peak_memory), list(curves ORDER BY joint, velocity)"
    with connect(store) as connection:
        query = f"SELECT {columns} FROM logs JOIN curves USING (key) GROUP BY ALL ORDER BY key"
        return connection.execute(query).fetchall()


def tables(rows: list[Row]) -> list[str]:
    """Count changes that were seen, false alarms, and odd robots."""
    runs, rows = [row for row in rows if "engine" in row], [row for row in rows if "seed" in row]
    delays = [delay for row in rows for delay in row["seen"].values()]
    changes, logs = len(WEAR) * len(rows), ROBOTS * LOGS * len(rows)
    lines = [
        ["changes seen", f"{len(delays)} of {changes}"],
        ["of these within three logs", sum(delay <= 3 for delay in delays)],
        ["false alarms", f"{sum(len(row['false']) for row in rows)} in {logs:,} logs"],
        ["only the odd robot stands out", f"{sum(row['odd'] == [ODD] for row in rows)} of {len(rows)}"],
        *([f"{run['logs']} logs on Ray, killed after {run['killed']}: identical", run["identical"]] for run in runs),
    ]
    return [markdown_table(["fleets of ten robots", f"{len(rows)} seeds"], lines)]


if __name__ == "__main__":
    command(__doc__, [*({"seed": seed} for seed in range(10)), {"engine": "ray"}], measure, tables)
