"""Compare `identify` with plain and ridge least squares: torque errors on the next log of real robots.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.baselines --save studies/baselines.json

Each log is the training log once; the errors are those on the robot's next log (a robot's only log is cut into halves),
as root mean squares over samples at which a joint moves, relative to `plain`, as geometric means over the joints:

- plain: inverse dynamics of the model, Coulomb and viscous friction, offset, and rotor inertia where torques are
  measured before the gears; ordinary least squares per joint
- ridge: the same with all inertial parameters, which have a weak prior around the model
- direct, default: `identify` with this method, and with the robot file's settings, with their corrected inertias

Rows are positions and torques smoothed by one Savitzky-Golay window, equally weighted. Curves that two logs identify
count as disjoint if their intervals are disjoint at the lowest or the highest speed that both contain.

The second table counts the points of a log's curve, at three such speeds, that are outside the interval of another log.
For the next log, the interval contains 25 %, the spread of `core.result.log_spread` for a single log. The spread is
also chosen without the robot's own logs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import interp1d
from scipy.signal import savgol_filter

from stribeck import Robot, identify, read_log
from stribeck.core.base.typing import Array
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.log import RobotLog
from stribeck.core.result import JointResult, Result
from studies.command import Row, command, of_estimates, real_robot, rounded
from studies.held_out import predicted_torque, with_torques
from studies.markdown import markdown_table

ROBOTS = (
    *("kuka-lwr4", "kinova-gen3-drive", "kinova-gen3", "tx40", "go2", "double-pendulum"),
    *("go2-ten-logs", "airbot-play", "aliengo", "dfki-pendulum"),
)
METHODS: dict[str, dict[str, object]] = {"direct": {"method": "direct", "law": "coulomb-viscous"}, "default": {}}
RATE, WINDOW = 100.0, 0.15
"""Rate of the rows [Hz], and length of their smoothing window [s]."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Smoothed motion and torque of a log, shape (T, n) each, and the regressor of inertial parameters."""

    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    needed: Array
    regressor: Array

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Mask of rows at which a joint moves."""
        speed = np.abs(self.velocity)
        return np.asarray(speed > np.maximum(0.02 * np.percentile(speed, 99, axis=0), 0.005))

    def friction(self, drive: bool, rise: float = 0.0) -> Array:
        """Compute columns of Coulomb and viscous friction, offset, and rotor inertia, shape (T, n, 3 or 4)."""
        v = self.velocity
        sign = np.tanh(v / rise) if rise else np.sign(v)
        return np.stack([sign, v, np.ones_like(v), *[self.acceleration][:drive]], axis=2)


def rows_of(robot: Robot, log: RobotLog) -> Rows:
    """Smooth a log and compute the model's torques."""
    model = robot.tree.model
    kept = np.append(True, np.diff(log.time) > 1e-9)
    grid = np.arange(log.time[0], log.time[-1], 1 / RATE)
    position, torque = (interp1d(log.time[kept], each[kept], axis=0)(grid) for each in (log.position, log.torque))
    window = round(WINDOW * RATE) | 1
    inner = slice(window + 2, -window - 2)
    q, v, a, tau = (
        np.asarray(savgol_filter(each, window, 4, deriv=k, delta=1 / RATE, axis=0)[inner], dtype=np.float64)
        for each, k in ((position, 0), (position, 1), (position, 2), (torque, 0))
    )
    data = model.createData()
    each = [pin.computeJointTorqueRegressor(model, data, *row).copy() for row in zip(q, v, a, strict=True)]
    regressor = np.reshape(each, (len(q), model.nv, -1))  # Pinocchio drops the axis of a single joint
    needed = regressor @ np.concatenate([inertia.toDynamicParameters() for inertia in model.inertias[1:]])
    return Rows(q, v, a, tau, needed, regressor)


def plain(train: Rows, test: Rows, drive: bool) -> Array:
    """Predict the test's torque by ordinary least squares per joint, shape (T, n)."""
    found, left = test.needed.copy(), train.torque - train.needed
    for k, at in enumerate(train.moving.T):
        own = np.linalg.lstsq(train.friction(drive)[at, k], left[at, k], rcond=None)[0]
        found[:, k] += test.friction(drive)[:, k] @ own
    return found


def ridge(robot: Robot, train: Rows, test: Rows, drive: bool) -> Array:
    """Predict the test's torque by least squares with all inertial parameters, shape (T, n)."""
    model, left = robot.tree.model, train.torque - train.needed
    n = model.nv
    mass = np.array([max(inertia.mass, 0.3) for inertia in model.inertias[1:]])
    scale = 1 / np.sqrt(np.mean(left**2, axis=0))
    own = train.friction(drive, 0.02)
    k = own.shape[2]
    design = np.zeros((len(left), n, (10 + k) * n))
    design[:, :, : 10 * n] = train.regressor
    for j in range(n):
        design[:, j, 10 * n + k * j : 10 * n + k * (j + 1)] = own[:, j]
    flat = (design * scale[:, None]).reshape(-1, design.shape[2])
    spread = np.append(np.outer(mass, [1, *3 * [0.1], *6 * [0.05]]).ravel(), np.full(k * n, 1e3))
    prior = np.diag((0.05 * np.sqrt(len(flat)) / spread) ** 2)
    found = np.linalg.solve(flat.T @ flat + prior, flat.T @ (left * scale).ravel())
    friction = np.einsum("tjk,jk->tj", test.friction(drive, 0.02), found[10 * n :].reshape(n, k))
    return np.asarray(test.needed + test.regressor @ found[: 10 * n] + friction)


def found(robot: Robot, result: Result | None, test: Rows) -> Array:
    """Predict the test's torque by a result, shape (T, n); NaN for joints without friction."""
    if result is None:
        return np.full_like(test.needed, np.nan)
    predicted, said = predicted_torque(robot, result, test.position, test.velocity, test.acceleration)
    return np.where(said, predicted, np.nan)


def ends_of(a: JointResult, b: JointResult) -> tuple[float, float]:
    """Find the slowest and the fastest speed that two curves contain [rad/s]."""
    return max(a.curve[0].velocity, b.curve[0].velocity), min(a.curve[-1].velocity, b.curve[-1].velocity)


def curve_at(joint: JointResult, speeds: Sequence[float] | Array) -> tuple[Array, Array]:
    """Interpolate a curve and half of its interval [N m]."""
    own, rows = [point.velocity for point in joint.curve], [(point.value, point.half_width) for point in joint.curve]
    value, half = (np.interp(speeds, own, each) for each in zip(*rows, strict=True))
    return value, half


def disjoint_curves(a: JointResult, b: JointResult) -> bool:
    """Check whether the intervals of two curves are disjoint at the slowest or the fastest speed of both."""
    (one, half), (other, other_half) = (curve_at(joint, ends_of(a, b)) for joint in (a, b))
    return bool(np.any(np.abs(one - other) > half + other_half))


def beyond(a: JointResult, b: JointResult) -> Array:
    """Compute how far curve b is beyond the interval of curve a, relative to a, at three speeds, shape (3,) [1].

    With the difference d and half of the interval h, it is the root of d^2 - h^2: the spread between logs that would
    have to be added to h^2. Zero inside the interval.
    """
    (value, half), (other, _) = (curve_at(joint, np.linspace(*ends_of(a, b), 3)) for joint in (a, b))
    return np.asarray(np.sqrt(np.maximum((other - value) ** 2 - half**2, 0.0)) / value)


def logs_of(robot: str) -> tuple[Robot, list[RobotLog]]:
    """Read a real robot and its logs, or the halves of its only log."""
    folder = real_robot(robot)
    machine = Robot.from_file(folder / "robot.toml")
    logs = [read_log(path, machine) for path in sorted(folder.glob("log*.npz"))]
    middle = len(logs[0].time) // 2
    halves = [logs[0].take(slice(middle)), logs[0].take(slice(middle, None))]
    return machine, logs if len(logs) > 1 else halves


def run_pair(
    robot: Robot, train: RobotLog, test: RobotLog, methods: Mapping[str, Mapping[str, object]] = METHODS
) -> tuple[Row, dict[str, Result | None]]:
    """Fit a log by some methods, and predict another one."""
    drive, results = robot.torque_source != "link_side_sensor", dict[str, Result | None]()
    for method, settings in methods.items():
        try:
            results[method] = identify(train, robot, robot.settings.model_copy(update=settings))
        except NothingIdentifiedError:
            results[method] = None
    (train,), test = with_torques([train], test, robot)
    seen, unseen = rows_of(robot, train), rows_of(robot, test)
    predictions = {"plain": plain(seen, unseen, drive), "ridge": ridge(robot, seen, unseen, drive)}
    predictions |= {method: found(robot, result, unseen) for method, result in results.items()}
    square = {name: (unseen.torque - own) ** 2 for name, own in predictions.items()}
    errors = {
        name: [rounded(float(np.sqrt(np.mean(own[at, k])))) for k, at in enumerate(unseen.moving.T)]
        for name, own in square.items()
    }
    spread = [rounded(float(np.std(unseen.torque[at, k]))) for k, at in enumerate(unseen.moving.T)]
    return {"errors": errors, "spread": spread}, results


def run(robot: str) -> Row:
    """Compare the methods on all logs of a robot."""
    machine, logs = logs_of(robot)
    pairs = [run_pair(machine, log, logs[(k + 1) % len(logs)]) for k, log in enumerate(logs)]
    row: Row = {"joints": list(machine.joint_names), "pairs": [pair for pair, _ in pairs]}
    for method in METHODS:
        results = [results[method] for _, results in pairs]
        verdicts = [{} if each is None else {n: j.verdict for n, j in each.joints.items()} for each in results]
        row[f"identified {method}"] = [sum(v == "identified" for v in own.values()) for own in verdicts]
        both = [
            (a.joints[name], b.joints[name])
            for a, b in combinations([each for each in results if each], 2)
            for name in a.joints
            if a.joints[name].verdict == b.joints[name].verdict == "identified"
        ]
        row[f"disjoint {method}"] = [sum(disjoint_curves(*pair) for pair in both), len(both)]
        points = [beyond(*each) for pair in both for each in (pair, pair[::-1])]
        row[f"beyond {method}"] = [rounded(float(each)) for each in np.concatenate([*points, []])]
    return row


def means(row: Row, method: str) -> tuple[float, float]:
    """Compute the geometric mean of the errors relative to `plain`, and the share of joints that it covers [1]."""
    pairs = [(pair["errors"][method], pair["errors"]["plain"]) for pair in row["pairs"]]
    own, base = (np.concatenate([pair[k] for pair in pairs]) for k in range(2))
    there = np.isfinite(own)
    return float(np.exp(np.mean(np.log(own[there] / base[there])))) if there.any() else np.nan, float(there.mean())


def spread(rows: list[Row]) -> float:
    """Find the spread between logs [1] beyond which 5 % of the points are, on average over robots."""
    shares = np.arange(0.0, 1.0, 0.005)
    outside = [[np.mean(np.array(row["beyond default"]) > share) for share in shares] for row in rows]
    return float(shares[np.argmin(np.abs(np.mean(outside, axis=0) - 0.05))])


def spreads(rows: list[Row]) -> str:
    """Format the share of points that are outside the intervals, for the next log also without the robot's own logs."""
    rows = [row for row in rows if row["beyond default"]]
    head = ("robot", "outside this log's", "outside the next log's", "spread without the robot", "outside with it")
    cells = [("all", "", "", f"{100 * spread(rows):.1f} %", "")]
    for row in rows:
        others = spread([other for other in rows if other is not row])
        shares = [f"{np.mean(np.array(row['beyond default']) > own):.0%}" for own in (0.0, 0.25, others)]
        cells.append((row["robot"], *shares[:2], f"{100 * others:.1f} %", shares[2]))
    return markdown_table(head, cells)


def tables(rows: list[Row]) -> list[str]:
    """Format the table of errors and verdicts, and that of the intervals of another log."""
    names = ("ridge", *METHODS)
    judged = [f"{kind} {method}" for method in METHODS for kind in ("identified", "disjoint")]
    cells = []
    for row in rows:
        errors = [f"{means(row, name)[0]:.2f}" for name in names]
        counts = []
        for method in METHODS:
            of_logs = row[f"identified {method}"]
            counts.append(f"{sum(of_logs)} of {len(row['joints']) * len(of_logs)}")
            counts.append("{} of {}".format(*row[f"disjoint {method}"]))
        cells.append((row["robot"], *errors, f"{means(row, 'default')[1]:.0%}", *counts))
    return [markdown_table(("robot", *names, "joints with friction", *judged), cells), spreads(rows)]


if __name__ == "__main__":
    command(__doc__, [{"robot": robot} for robot in ROBOTS], run, tables, of_estimates)
