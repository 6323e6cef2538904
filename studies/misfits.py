"""Measure the findings after the fit: how often each is reported on logs with its cause and with other causes.

    python -m studies.misfits --save studies/misfits.json

The logs are walks of 32 s of a TORO-like humanoid and of a G1, and 20 s of an arm's motion, identified with default
settings. Thresholds were chosen on the TORO-like humanoid only. The causes are the conditions of
`studies.harder_cases`, friction that no function of velocity describes, and sensor errors in some joints only. Added
friction is computed along the given motion and added to the motor torques.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace

import numpy as np

from stribeck import Robot, identify
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.sensors.measure import with_noise
from studies.accuracy import ALL_CASES, walks_of
from studies.accuracy_cases import CASES
from studies.changes import carrying, earlier, period_of, quantized
from studies.command import Row, command
from studies.harder_cases import as_seen
from studies.markdown import markdown_table

UNCLEAR = "friction-unclear"

CHOSEN_ON, SHOWN_ON = ("TORO-like",), ("G1", "arm")
CAUSES: dict[str, tuple[str, ...]] = {
    "passivity": ("sign",),
    "bodies-differ": ("payload",),
    "torque-delay": ("delay", "several"),
    "friction-load": ("load",),
    "friction-drift": ("drift",),
    "friction-presliding": ("presliding",),
    "friction-play": ("play",),
    "friction-delay": ("delay",),
    "friction-ripple": ("ripple", "several"),
    UNCLEAR: ("load", "drift", "presliding", "play", "delay", "ripple", "several"),
    "set-aside": ("pushed", "presliding"),
    "heterogeneity": ("pushed", "several"),
}
"""Causes that justify each check's finding."""
MISSES = {"torque-delay": ("one torque 5 ms late",), "friction-delay": ("torques 2 ms late", "all torques 4 ms late")}
"""Cases with a cause that another check reports; excluded from both counts."""
FRICTION = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2, "slope": 50}
"""Friction of all joints of the arm."""
Change = Callable[[RobotLog, Array, Array], Array]
"""Function that computes the torque a cause adds to a log from each joint's Coulomb friction and load [N m], (T, n)."""


def _sign(log: RobotLog) -> Array:
    return np.asarray(np.tanh(40.0 * np.gradient(log.position, log.time, axis=0)))


def load(log: RobotLog, _: Array, carried: Array) -> Array:
    """Add a tenth of the load, against the motion."""
    return np.asarray(0.1 * np.abs(carried) * _sign(log))


def drift(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Reduce Coulomb friction by 40 % during the log."""
    share = (log.time - log.time[0]) / (log.time[-1] - log.time[0])
    return np.asarray(-0.4 * share[:, None] * coulomb * _sign(log))


def presliding(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Let Coulomb friction build up within 6 mrad of travel."""
    sign = _sign(log)
    kept = np.exp(-np.abs(np.diff(log.position, axis=0, prepend=log.position[:1])) / 0.006)
    z = np.zeros_like(sign)
    for k in range(1, len(z)):  # the state depends on the previous sample
        z[k] = sign[k] + (z[k - 1] - sign[k]) * kept[k]
    return np.asarray(coulomb * (z - sign))


def play(log: RobotLog, _: Array, carried: Array) -> Array:
    """Remove the link's torque from the motor for 20 ms after its sign changes, as backlash does."""
    changed = np.diff(np.sign(carried), axis=0, prepend=np.sign(carried[:1])) != 0
    span = round(0.02 / period_of(log))
    crossing = np.apply_along_axis(np.convolve, 0, changed.astype(float), np.ones(span))[: len(log.time)] > 0
    reached = np.abs(np.roll(carried, -span, axis=0)) + np.abs(carried)
    return np.asarray(crossing * np.sign(carried) * np.minimum(reached, 2.0))


def ripple(periods: float) -> Change:
    """Make a torque that is periodic in position, with so many periods per turn."""
    return lambda log, coulomb, _: 0.3 * coulomb * np.sin(periods * log.position + np.arange(len(coulomb)))


def late(log: RobotLog, _: Array, __: Array) -> Array:
    """Delay torques by 5 ms."""
    return log.torque[earlier(log, 0.005)] - log.torque


IN_SOME: dict[str, tuple[str, Change]] = {
    "load": ("load", load),
    "drift": ("drift", drift),
    "presliding": ("presliding", presliding),
    "play": ("play", play),
    "ripple, 18 a turn": ("ripple", ripple(18)),
    "ripple, 60 a turn": ("ripple", ripple(60)),
    "one torque 5 ms late": ("delay", late),
    "wrong sign": ("sign", lambda log, _, __: -2 * log.torque),
}
"""Causes in some joints only, by case: the cause, and the torque that it adds to these joints."""
ENTIRE = {
    **dict.fromkeys(("A", "B", "A, joints differ"), ""),
    "A, wrong model and calibration": "model",
    **dict.fromkeys(("14-bit encoders", "16-bit encoders"), "quantisation"),
    "coloured torque noise": "noise",
    "torque ripple": "ripple",
    "gains 3 % wrong": "gains",
    "torques 2 ms late": "delay",
    "IMU tilted by 1.5 deg": "tilt",
    "contacts 20 ms late": "contacts",
    "2 kg not in the model": "payload",
    "spikes in torques": "spikes",
    "rotor inertias 20 % wrong": "rotors",
    "pushed": "pushed",
    "several at once": "several",
}
"""Causes in the entire robot, by case of the walks."""
ON_THE_ARM = {
    **dict.fromkeys(("A", "B"), ""),
    **dict.fromkeys(IN_SOME, ""),
    **dict.fromkeys(("14-bit encoders", "10-bit encoders"), "quantisation"),
    "all torques 4 ms late": "delay",
    "1 kg not in the model": "payload",
}
Logs = tuple[str, tuple[str, ...], Robot, list[RobotLog]]
"""Cause, the joints that have it (empty if all have it), the robot model that the estimator gets, and its logs."""


def added(log: RobotLog, change: Change, friction: dict[str, float], carried: Array) -> RobotLog:
    """Add a cause to the joints whose Coulomb friction is given."""
    coulomb = np.array([friction.get(name, 0.0) for name in log.joint_names])
    return replace(log, torque=log.torque + change(log, coulomb, carried) * (coulomb > 0))


def of_walks(name: str, case: str, seed: int) -> Logs:
    """Make the logs of two of a humanoid's walks."""
    diagonal, _, turning, pushed = walks_of(name, True)
    walks = [diagonal, turning, pushed]
    if case in ENTIRE:
        _, robot, logs = as_seen(walks, ALL_CASES[case], seed)
        return ENTIRE[case], (), robot, logs[:2] if case != "pushed" else logs[::2]
    cause, change = IN_SOME[case]
    joints = tuple(walks[0].truth.parameters)[seed % 3 :: 3]
    changed = []
    for walk in walks[:2]:
        friction = {joint: walk.truth.parameters[joint]["coulomb"] for joint in joints}
        log = added(walk.log, change, friction, walk.log.torque - walk.truth.friction_torque)
        changed.append(replace(walk, log=log))
    _, robot, logs = as_seen(changed, CASES["A"], seed)
    return cause, joints, robot, logs


def of_the_arm(case: str, seed: int) -> Logs:
    """Make a log of 20 s of the arm."""
    robot, cause = Robot.from_file(MODELS / "arm.toml"), ON_THE_ARM[case]
    joints: tuple[str, ...] = ()
    last = robot.tree.model.njoints - 1
    heavier = carrying(robot, last, 1.0, np.array([0.0, 0.0, 0.08])) if cause == "payload" else robot
    truth = dict.fromkeys(robot.joint_names, FRICTION)
    log, known = exact_log(heavier, get_law("stribeck"), truth, duration=20.0, seed=seed)
    if case in IN_SOME:
        cause, change = IN_SOME[case]
        joints = robot.joint_names[seed % 3 :: 3]
        log = added(log, change, dict.fromkeys(joints, FRICTION["coulomb"]), log.torque - known.friction_torque)
    elif cause == "delay":
        log = replace(log, torque=log.torque[earlier(log, 0.004)])
    noise = CASES["B" if case == "B" else "A"]
    log = with_noise(log, position=noise.encoder, torque=noise.torque, seed=seed)
    return cause, joints, robot, [quantized(log, int(case[:2]) if cause == "quantisation" else 0)]


def runs() -> Iterator[Row]:
    """Yield the keys of all runs."""
    for robot in ("TORO-like", "G1"):
        yield from ({"robot": robot, "case": case, "seed": 0} for case in (*ENTIRE, *IN_SOME))
    for seed in (0, 1):
        yield from ({"robot": "arm", "case": case, "seed": seed} for case in ON_THE_ARM)


def run(robot: str, case: str, seed: int) -> Row:
    """List the findings of a log, and the joints that each names."""
    cause, joints, machine, logs = of_the_arm(case, seed) if robot == "arm" else of_walks(robot, case, seed)
    findings = {finding.check: list(finding.joints) for finding in identify(logs, machine).findings}
    return {"cause": cause, "joints": list(joints), "findings": findings}


def rates(rows: Collection[Row], check: str) -> tuple[int, int, int, int]:
    """Count, for logs with a check's cause and for logs without it, the logs that the check reports and all logs."""
    counted = [row for row in rows if row["case"] not in MISSES.get(check, ())]
    having, others = ([r for r in counted if (r["cause"] in CAUSES[check]) == kind] for kind in (True, False))
    hit, false = (sum(check in row["findings"] for row in each) for each in (having, others))
    return hit, len(having), false, len(others)


def tables(rows: list[Row]) -> list[str]:
    """Format the table; its last row sums up."""
    groups = [[row for row in rows if row["robot"] in robots] for robots in (CHOSEN_ON, SHOWN_ON)]
    counts = np.array([[rates(group, check) for group in groups] for check in CAUSES])
    counts[list(CAUSES).index(UNCLEAR), :, :2] = 0  # a finding that names the cause is better than an unclear one
    cells = []
    for name, pair in zip((*(f"`{check}`" for check in CAUSES), "all"), [*counts, counts.sum(axis=0)], strict=True):
        parts = [(f"{hit} of {having}" if having else "–", f"{false} of {rest}") for hit, having, false, rest in pair]
        cells.append([name, *parts[0], *parts[1]])
    return [markdown_table(("check", *2 * ("with its cause", "without")), cells)]


if __name__ == "__main__":
    command(__doc__, runs(), run, tables)
