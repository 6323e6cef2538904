"""Measure how often the 95 % intervals of the default method cover the truth under errors that no setting describes.

    python -m studies.coverage --save studies/coverage.json

Exact logs of random motions, `SEEDS` per case, get noise and one error: coarse encoders, a slow log, or friction and
torques that no law describes. Every joint has other Coulomb and viscous friction and a Stribeck effect. The table
counts the points of identified curves inside the interval for this log, and points that are confidently wrong: outside
the interval and more than 15 % off. No constant of the estimator was chosen on these logs.

Four days of an arm have 0, 1.2, 0 and 2 kg at its flange and friction of 85 to 115 %.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from stribeck import Robot, identify
from stribeck.core.base.typing import Array
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.result import Result
from stribeck.core.settings import PayloadTable
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.prescribed.gait import Gait
from stribeck.simulation.run import POSTURES
from stribeck.simulation.sensors.measure import with_noise
from studies.changes import EXAMPLES, UR5, carrying, known, packaged, quantized, robot_from
from studies.command import Row, command, rounded
from studies.lugre import bristles_along
from studies.markdown import markdown_table, percent
from studies.misfits import Change, load, ripple
from studies.remedies import WRONG

SEEDS = 1
ENCODER, TORQUE = 2e-5, 0.1
"""Standard deviations of the noise [rad], [N m]."""
TRUTH = {"coulomb": 1.0, "viscous": 0.2, "offset": 0.5, "stribeck_gain": 0.2, "stribeck_velocity": 0.2, "slope": 40.0}
"""Friction of every joint, in the units of the law `stribeck`."""
LEGS = ("FL", "FR", "RL", "RR")


@dataclass(frozen=True)
class Machine:
    """Text of the robot file, and motion of the robot."""

    robot_file: str
    posture: dict[str, float] = field(default_factory=dict)
    gait: Gait = "walk"


ARM, BIPED = Machine(UR5), Machine(packaged("robot.toml", "biped.urdf"), dict(POSTURES["biped"]))
QUADRUPED = Machine(
    f'[robot]\nmodel = "{EXAMPLES}/go2_description/urdf/go2.urdf"\n'
    + "".join(f'[contacts.{leg}]\nframe = "{leg}_foot"\nkind = "point"\n' for leg in LEGS),
    {f"{leg}_{joint}_joint": q for leg in LEGS for joint, q in (("hip", 0.0), ("thigh", 0.8), ("calf", -1.6))},
)


@dataclass(frozen=True)
class Dirt:
    """Errors of a log of the default method.

    Attributes
    ----------
    machine
        Robot and motion.
    rate
        Rate of the log [Hz].
    bits
        Encoder bits per turn [1]; 0 without quantization.
    bristles
        Stiffness of LuGre bristles relative to Coulomb friction [1/rad]; 0 without.
    change
        Torque that is added to the log.
    carried
        Coulomb friction relative to the mean load [1] that `change` adds.
    late
        Delay of the torques [ms].
    """

    machine: Machine = ARM
    rate: float = 1000.0
    bits: int = 0
    bristles: float = 0.0
    change: Change | None = None
    carried: float = 0.0
    late: int = 0


def warming(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Let Coulomb friction settle exponentially, 40 % lower, around its mean."""
    level = np.exp(-3 * (log.time - log.time[0]) / (log.time[-1] - log.time[0]))
    return np.asarray(0.4 * (level - level.mean())[:, None] * coulomb * np.tanh(TRUTH["slope"] * known(log.velocity)))


def uneven(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Add an offset that changes at random every 1.6 s, with a standard deviation of 20 % of Coulomb friction."""
    stretch = (log.time / 1.6).astype(int)
    drawn = np.random.default_rng(1).standard_normal((stretch[-1] + 1, len(coulomb)))
    return np.asarray(0.2 * coulomb * drawn[stretch])


def pushes(log: RobotLog, coulomb: Array, _: Array) -> Array:
    """Add pushes by a hand of 0.3 s, every 2.1 s."""
    times = log.time - log.time[0]
    drawn = np.random.default_rng(1).choice([-8.0, 8.0], (int(times[-1] / 2.1) + 1, len(coulomb)))
    return np.asarray(drawn[(times / 2.1).astype(int)] * (times % 2.1 < 0.3)[:, None])


TROT = replace(QUADRUPED, gait="trot")
DIRT = {
    "walk, no dirt": Dirt(BIPED),
    "arm, no dirt": Dirt(),
    "10-bit encoders": Dirt(bits=10),
    "12-bit encoders": Dirt(bits=12),
    "14-bit encoders": Dirt(bits=14),
    "arm at 50 Hz": Dirt(rate=50.0),
    "trot at 100 Hz": Dirt(TROT, rate=100.0),
    "LuGre": Dirt(bristles=300.0),
    "LuGre, trot": Dirt(TROT, bristles=300.0),
    "friction grows with the load": Dirt(change=load, carried=0.1),
    "torque ripple": Dirt(change=ripple(18)),
    "friction settles within the log": Dirt(change=warming),
    "offset changes every 1.6 s": Dirt(change=uneven),
    "pushed every 2.1 s": Dirt(change=pushes),
    "torques 8 ms late": Dirt(late=8),
}
DAYS = {"four days, payloads declared": True, "four days, payloads unknown": False}
PAYLOADS, FLANGE, REACH = (0.0, 1.2, 0.0, 2.0), "tool0", (0.0, 0.0, 0.05)
"""Masses on four days [kg], the link that carries them, and their center in its frame [m]."""
Curve = Callable[[str, float], float]
"""True resisting torque of a joint at a speed."""


def friction_of(robot: Robot, seed: int) -> dict[str, dict[str, float]]:
    """Draw the friction of all joints that are not position-controlled."""
    drawn = np.random.default_rng([seed, 2])
    factors = {joint: np.exp(0.3 * drawn.standard_normal(2)).tolist() for joint in robot.joint_names}
    return {
        joint: TRUTH | {"coulomb": own[0] * TRUTH["coulomb"], "viscous": 2 * own[1] * TRUTH["viscous"], "slope": 60.0}
        for joint, own in factors.items()
        if joint not in robot.position_controlled
    }


def sliding(own: dict[str, float], speed: float) -> float:
    """Compute the resisting torque of the law `stribeck`, and of LuGre in steady sliding, above the rise [N m]."""
    effect = own["stribeck_gain"] * np.exp(-((speed / own["stribeck_velocity"]) ** 2))
    return float(own["viscous"] * speed + own["coulomb"] * (1 + effect))


def dirty(case: Dirt, robot: Robot, seed: int) -> tuple[RobotLog, Curve]:
    """Make a dirty log and its truth."""
    truth, law = friction_of(robot, seed), get_law("stribeck")
    seconds = 20.0 if case.machine.gait == "trot" else 30.0
    log, known = exact_log(
        robot, law, truth, duration=seconds, seed=seed, gait=case.machine.gait, posture=case.machine.posture
    )
    carried = log.torque - known.friction_torque
    coulomb = np.array([truth.get(joint, {}).get("coulomb", 0.0) for joint in log.joint_names])
    if case.bristles:
        bristles = {}
        for joint, own in truth.items():
            steady = {name: value for name, value in own.items() if name != "slope"}
            stiffness = case.bristles * own["coulomb"]
            bristles[joint] = steady | {"bristle_stiffness": stiffness, "bristle_damping": 2.0}
        log = replace(log, torque=carried + bristles_along(log, bristles))
    if case.change:
        log = replace(log, torque=log.torque + case.change(log, coulomb, carried) * (coulomb > 0))
    log = replace(log, torque=np.roll(log.torque, case.late, axis=0)).take(slice(case.late, None))
    loads = dict(zip(log.joint_names, np.abs(carried).mean(axis=0).tolist(), strict=True))
    log = with_noise(replace(log, foot_wrench=None), position=ENCODER, torque=TORQUE, seed=seed)
    log = quantized(log.take(slice(None, None, round(1000 / case.rate))), case.bits)
    return log, lambda joint, speed: sliding(truth[joint], speed) + case.carried * loads[joint]


def four_days(robot: Robot, seed: int) -> tuple[list[RobotLog], Curve]:
    """Make the logs of four days of an arm and their mean friction."""
    truth, law, logs = friction_of(robot, seed), get_law("stribeck"), []
    factors = np.random.default_rng([seed, 3]).uniform(0.85, 1.15, (len(PAYLOADS), len(truth)))
    model = robot.tree.model
    frame = model.frames[model.getFrameId(FLANGE)]
    for day, (mass, row) in enumerate(zip(PAYLOADS, factors.tolist(), strict=True)):
        heavier = carrying(robot, frame.parentJoint, mass, frame.placement.act(np.array(REACH)))
        scaled = {
            joint: own | {name: factor * own[name] for name in ("coulomb", "viscous")}
            for (joint, own), factor in zip(truth.items(), row, strict=True)
        }
        log, _ = exact_log(heavier, law, scaled, duration=15.0, seed=10 * seed + day)
        logs.append(with_noise(replace(log, path=f"day{day}"), position=ENCODER, torque=TORQUE, seed=10 * seed + day))
    means = dict(zip(truth, factors.mean(axis=0).tolist(), strict=True))
    return logs, lambda joint, speed: means[joint] * sliding(truth[joint], speed)


def points_of(result: Result, joints: Iterable[str], curve: Curve) -> list[list[float]]:
    """List the points of curves: whether the joint is identified, whether the interval covers the truth, error [1]."""
    points = []
    for name in joints:
        for point in result.joints[name].curve:
            (low, high), true = point.interval_95, curve(name, point.velocity)
            covered, error = low <= true <= high, rounded(abs(point.value / true - 1))
            points.append([result.joints[name].verdict == "identified", covered, error])
    return points


def counts(points: list[list[float]]) -> list[int]:
    """Count points: all, covered, and confidently wrong."""
    sure, covered, error = np.array(points).reshape(-1, 3).T
    return [len(sure), int(covered.sum()), int(np.sum((sure == 1) & (covered == 0) & (error > WRONG)))]


def judged(result: Result, curve: Curve) -> Row:
    """Count the points of identified curves: all, inside their interval, confidently wrong; and their median width."""
    joints = [name for name, joint in result.joints.items() if joint.verdict == "identified"]
    widths = [p.half_width / curve(name, p.velocity) for name in joints for p in result.joints[name].curve]
    return {
        "joints": [len(joints), sum(bool(joint.curve) for joint in result.joints.values())],
        "points": counts(points_of(result, joints, curve)),
        "width": rounded(float(np.median(widths)) if widths else 0.0),
    }


def made(case: str, seed: int) -> tuple[list[RobotLog], Robot, Curve]:
    """Make the logs of a case, their robot, and their true friction."""
    if case in DIRT:
        robot = robot_from(DIRT[case].machine.robot_file)
        log, curve = dirty(DIRT[case], robot, seed)
        return [log], robot, curve
    logs, curve = four_days(robot := robot_from(UR5), seed)
    tables = [
        PayloadTable(link=FLANGE, mass=mass, com=REACH, spans=[(log.path, 0.0, 1e3)])
        for mass, log in zip(PAYLOADS, logs, strict=True)
        if mass
    ]
    return logs, replace(robot, payloads=tuple(tables)) if DAYS[case] else robot, curve


def run(case: str, seed: int) -> Row:
    """Compute the row of a case."""
    logs, robot, curve = made(case, seed)
    return judged(identify(logs, robot), curve)


def tables(rows: list[Row]) -> list[str]:
    """Format the table."""
    cells = []
    for case in dict.fromkeys(row["case"] for row in rows):
        own = [row for row in rows if row["case"] == case]
        good, joints = np.sum([row["joints"] for row in own], axis=0)
        count, inside, wrong = np.sum([row["points"] for row in own], axis=0)
        width = np.median([row["width"] for row in own])
        shares = percent(inside / max(count, 1)), wrong, percent(float(width), 1)
        cells.append((case, f"{good} of {joints}", count, *shares))
    head = ("logs", "joints identified", "points", "inside", "confidently wrong", "median ±")
    return [markdown_table(head, cells)]


if __name__ == "__main__":
    keys = [{"case": case, "seed": seed} for case in (*DIRT, *DAYS) for seed in range(SEEDS)]
    command(__doc__, keys, run, tables)
