"""What the law "lugre" finds of bristles that are known, and of friction that is another's.

    python -m studies.lugre --save studies/lugre.json
    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.lugre --real --save studies/lugre.json

Levers on drives, side by side on a bench, swing about a horizontal axis under computed torque, without knowledge of
their friction but for its level: so friction acts on the motion, and what the filter does to it is not known to the
fit. Each friction has `DRIVES` levers, whose aims, sums of sines, are drawn apart. A humanoid then walks by a
prescribed motion, with bristles in its legs. Encoder noise is 2e-5 rad, torque noise 0.05 N m; Coulomb friction
1.2 N m, viscous friction 0.3 N m s/rad, Stribeck gain 0.3 at 0.15 rad/s, offset 0.2 N m.

Printed are, over the joints that have a fit, of the travel Fc / sigma0, of the damping sigma1 and of the parameters of
steady sliding: how many are identified, their median error, and how many of their 95 % intervals cover; and the median
held-out residual with other laws. With --real, the published logs of real robots: verdicts, travels, and held-out
residuals over those without friction.
"""

import argparse
import json
import os
import runpy
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from stribeck import Result, Robot, RobotLog, Settings, identify
from stribeck.friction import get_law
from stribeck.outputs import whole_or_not_at_all
from stribeck.result import ParameterEstimate
from stribeck.settings import FilterSettings
from stribeck.typing import Array
from stribeck_simulation.friction import FrictionTruth, Instant, LawFriction, LuGre
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import POSTURES
from stribeck_simulation.sensors.measure import with_noise

ROOT = Path(__file__).parents[1]
SEED, DRIVES = 20261123, 5
STEADY = {"viscous": 0.3, "coulomb": 1.2, "stribeck_gain": 0.3, "stribeck_velocity": 0.15, "offset": 0.2}
ENCODER, TORQUE = 2e-5, 0.05
"""Noise [rad], [N m]."""
RATE, FINE, SECONDS = 1000.0, 5, 20.0
"""Of the log [Hz], steps of the simulation in its period [1], and its length [s]."""
MASS, ARM, INERTIA = 1.0, 0.1, 0.03
"""Of a lever [kg], [m], about its axis [kg m^2]."""
STIFF = 20.0
"""Natural frequency of the controllers [rad/s], critically damped."""
SIZE, SINES = 0.6, (0.1, 0.8)
"""Sum of the sines' sizes [rad], and the range of their frequencies [Hz]."""
SLIPS = ((600.0, 0.4), (200.0, 0.4), (66.0, 0.4))
"""Stiffness [N m/rad] and limit [N m] of the elements of generalised Maxwell slip."""
LAWS = ("lugre", "stribeck", "coulomb-viscous")
BRISTLES = {
    "LuGre, 300 N m/rad": {**STEADY, "bristle_stiffness": 300.0, "bristle_damping": 2.0},
    "LuGre, 1200 N m/rad": {**STEADY, "bristle_stiffness": 1200.0, "bristle_damping": 0.5},
    "LuGre, 6000 N m/rad": {**STEADY, "bristle_stiffness": 6000.0, "bristle_damping": 0.2},
    "Dahl, 300 N m/rad": {**STEADY, "stribeck_gain": 0.0, "bristle_stiffness": 300.0, "bristle_damping": 0.0},
}
MAXWELL, NONE, WALK = "Maxwell slip", "no bristles", "walk, 300 N m/rad"
FRICTIONS = (*BRISTLES, MAXWELL, NONE)
SLIDING = ("viscous", "coulomb", "stribeck_gain", "stribeck_velocity")
HEAD = """\
| friction | travel | damping | steady sliding | held out [N m]: lugre | stribeck | coulomb-viscous |
|---|---|---|---|---:|---:|---:|"""
REAL_HEAD = """\
| log | verdicts | travel identified | held out: lugre | stribeck | coulomb-viscous |
|---|---|---|---:|---:|---:|"""
REAL = ("tx40", "kinova-gen3", "double-pendulum", "go2")


class Share(TypedDict):
    """Of parameters: how many, how many are identified, their median error [%], and how many intervals hold."""

    of: int
    identified: int
    error: float | None
    holds: int


class Found(TypedDict):
    """Of one friction: the parameters, and the median held-out residual by law [N m]."""

    friction: str
    joints: int
    travel: Share
    damping: Share
    sliding: Share
    held_out: dict[str, float]


class Real(TypedDict):
    """Of a real robot's log: joints by verdict, travels identified [rad], held-out residual over zero friction's."""

    log: str
    verdicts: dict[str, int]
    travels: list[float]
    held_out: dict[str, float]


class MaxwellSlip:
    """Springs in parallel that slip at a limit each (Lampaert, Al-Bender, Swevers 2003, without memory of sliding)."""

    def __init__(self, columns: Sequence[int]) -> None:
        self.columns: NDArray[np.int64] = np.array(columns)
        self.parameters: Mapping[str, Mapping[str, float]] = {}
        self._stiffness, self._limit = np.array(SLIPS).T[:, :, None]
        self._bend = np.zeros((len(SLIPS), len(columns)))
        self._step = 0.0

    def linearise(self, instant: Instant) -> tuple[Array, Array]:
        """Return D and c of these joints, shape (k,) each."""
        self._step = instant.step
        ahead = self._stiffness * (self._bend + instant.step * instant.velocity[self.columns])
        held = np.abs(ahead) < self._limit
        force = np.where(held, self._stiffness * self._bend, np.clip(ahead, -self._limit, self._limit))
        damping = (self._stiffness * held).sum(axis=0) * instant.step + STEADY["viscous"]
        return damping, force.sum(axis=0) + STEADY["offset"]

    def advance(self, velocity: Array) -> None:
        """Bend the springs by the step's velocity."""
        most = self._limit / self._stiffness
        self._bend = np.clip(self._bend + self._step * velocity, -most, most)


def bench(count: int, folder: Path) -> Robot:
    """Return a robot of that many levers on one frame."""
    link = '<link name="lever{0}"><inertial><origin xyz="{1} 0 0"/><mass value="{2}"/><inertia ixx="0.01" ixy="0" '
    link += 'ixz="0" iyy="{3}" iyz="0" izz="0.02"/></inertial></link><joint name="drive{0}" type="continuous">'
    link += '<parent link="frame"/><child link="lever{0}"/><axis xyz="0 1 0"/></joint>'
    levers = "".join(link.format(k, ARM, MASS, INERTIA - MASS * ARM**2) for k in range(count))
    (folder / "bench.urdf").write_text(f'<robot name="bench"><link name="frame"/>{levers}</robot>')
    (folder / "bench.toml").write_text('[robot]\nmodel = "bench.urdf"\nbase = "fixed"\n')
    return Robot.from_file(folder / "bench.toml")


def friction_of(names: Sequence[str]) -> FrictionTruth:
    """Return the friction of all levers, `DRIVES` of each kind in turn."""
    of = {kind: names[DRIVES * k : DRIVES * (k + 1)] for k, kind in enumerate(FRICTIONS)}
    bristles = {name: values for kind, values in BRISTLES.items() for name in of[kind]}
    sharp = {name: {**STEADY, "exponent": 2.0} for name in of[NONE]}
    slips = MaxwellSlip([names.index(name) for name in of[MAXWELL]])
    return FrictionTruth(
        len(names), [LuGre(names, bristles), LawFriction(names, get_law("stribeck-exponent"), sharp), slips]
    )


def swung(robot: Robot, seed: int = SEED, seconds: float = SECONDS) -> RobotLog:
    """Return the noisy log of the levers, which follow sines under computed torque."""
    generator, count = np.random.default_rng(seed), len(robot.joint_names)
    time, step = np.arange(round(seconds * RATE * FINE)) / (RATE * FINE), 1 / (RATE * FINE)
    omega = 2 * np.pi * generator.uniform(*SINES, (5, 1, count))
    size = generator.uniform(0.5, 1.0, (5, 1, count)) * SIZE / 5
    phase = omega * time[:, None] + generator.uniform(0, 2 * np.pi, (5, 1, count))
    aim, speed, push = (
        (size * wave).sum(axis=0) for wave in (np.sin(phase), omega * np.cos(phase), -(omega**2) * np.sin(phase))
    )
    friction, position, velocity = friction_of(robot.joint_names), aim[0], speed[0]
    kept = np.empty((2, *aim.shape))
    for k, now in enumerate(time):
        weight = -MASS * 9.81 * ARM * np.cos(position)
        feedback = STIFF**2 * (aim[k] - position) + 2 * STIFF * (speed[k] - velocity)
        torque = INERTIA * (push[k] + feedback) + weight + STEADY["coulomb"] * np.tanh(20 * speed[k])
        damping, rest = friction.before(Instant(float(now), step, position, velocity, torque))
        after = (INERTIA / step * velocity + torque - weight - rest) / (INERTIA / step + damping)
        friction.after(after)
        kept[:, k] = position, torque
        position, velocity = position + step * after, after
    log = RobotLog(
        time=time[::FINE],
        joint_names=robot.joint_names,
        position=kept[0, ::FINE],
        torque=kept[1, ::FINE],
        torque_source=robot.torque_source,
    )
    return with_noise(log, position=ENCODER, torque=TORQUE, seed=seed + 1)


def walked(robot: Robot, seed: int = SEED, seconds: float = SECONDS) -> RobotLog:
    """Return the noisy log of a humanoid's prescribed walk, with bristles in its legs."""
    log, _ = exact_log(robot, get_law("coulomb-viscous"), {}, duration=seconds, seed=seed, posture=POSTURES["toro"])
    assert log.velocity is not None
    legs = dict.fromkeys(robot.joint_names, BRISTLES["LuGre, 300 N m/rad"])
    friction, torque = FrictionTruth(len(legs), [LuGre(log.joint_names, legs)]), np.empty_like(log.position)
    ends = np.concatenate([log.velocity[:1], log.velocity])
    for k, position in enumerate(log.position):
        for part in (np.arange(FINE) + 0.5) / FINE:
            now = (1 - part) * ends[k] + part * ends[k + 1]
            friction.before(Instant(float(log.time[k]), 1 / (RATE * FINE), position, now, now))
            torque[k] = friction.after(now)
    log = replace(log, torque=log.torque + torque, velocity=None, acceleration=None)
    return with_noise(log, position=ENCODER, torque=TORQUE, seed=seed + 1)


def share(results: Sequence[tuple[ParameterEstimate, float | None]]) -> Share:
    """Return the share of parameters, each with its truth if it has one."""
    good = [(each, true) for each, true in results if each.verdict == "identified"]
    known = [(each, true) for each, true in good if true is not None]
    errors = [100 * abs(each.value - true) / true for each, true in known if true]
    return Share(
        of=len(results),
        identified=len(good),
        error=float(f"{median(errors):.2g}") if errors else None,
        holds=sum(each.interval_95[0] <= true <= each.interval_95[1] for each, true in known),
    )


def found(kind: str, names: Sequence[str], results: Mapping[str, Result]) -> Found:
    """Return what was found of joints with one friction."""
    joints = [results["lugre"].joints[name] for name in names if results["lugre"].joints[name].parameters]
    truth = BRISTLES.get("LuGre, 300 N m/rad" if kind == WALK else kind, STEADY if kind == NONE else {})
    if "bristle_stiffness" in truth:
        truth = {**truth, "bristle_travel": truth["coulomb"] / truth["bristle_stiffness"]}

    def of(*parameters: str) -> Share:
        return share([(joint.parameters[name], truth.get(name)) for joint in joints for name in parameters])

    held_out = {}
    for law, result in results.items():
        checks = [result.joints[name].validation for name in names]
        held_out[law] = float(f"{median([each.rms for each in checks if each]):.2g}")
    return Found(
        friction=kind,
        joints=len(joints),
        travel=of("bristle_travel"),
        damping=of("bristle_damping"),
        sliding=of(*SLIDING),
        held_out=held_out,
    )


def identified(log: RobotLog, robot: Robot) -> dict[str, Result]:
    """Return what each law finds in a log, by the curve fit."""
    return {law: identify(log, robot, Settings(law=law, method="curve-fit")) for law in LAWS}


def simulated() -> list[Found]:
    """Return what is found of the simulated joints."""
    walker = Robot.from_file(MODELS / "toro.toml")
    walks = identified(walked(walker), walker)
    with tempfile.TemporaryDirectory() as folder:
        robot = bench(DRIVES * len(FRICTIONS), Path(folder))
        results = identified(swung(robot), robot)
    names = robot.joint_names
    rows = [found(kind, names[DRIVES * k : DRIVES * (k + 1)], results) for k, kind in enumerate(FRICTIONS)]
    return [*rows, found(WALK, list(walks["lugre"].joints), walks)]


def real() -> list[Real]:
    """Return what is found of the published logs of real robots, their settings but the filter."""
    data = Path(os.environ.get("STRIBECK_REAL_LOGS", ROOT.parent / "shared" / "real-logs"))
    convert = runpy.run_path(str(ROOT / "examples" / "real_robots" / "convert.py"))["convert"]
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for name in REAL:
            folder = convert(name, data, Path(scratch))
            robot = Robot.from_file(folder / "curve-fit.toml")
            logs = sorted(folder.glob("log*.npz"))
            settings = robot.settings.model_copy(update={"filter": FilterSettings()})
            results = {law: identify(logs, robot, settings, law=law, method="curve-fit") for law in LAWS}
            joints = results["lugre"].joints.values()
            verdicts = [joint.verdict for joint in joints]
            travels = [joint.parameters["bristle_travel"] for joint in joints if "bristle_travel" in joint.parameters]
            held_out = {}
            for law, result in results.items():
                checks = [joint.validation for joint in result.joints.values() if joint.validation]
                held_out[law] = float(f"{median([each.rms / each.rms_zero_friction for each in checks]):.2g}")
            rows.append(
                Real(
                    log=robot.name,
                    verdicts={verdict: verdicts.count(verdict) for verdict in dict.fromkeys(verdicts)},
                    travels=[float(f"{each.value:.2g}") for each in travels if each.verdict == "identified"],
                    held_out=held_out,
                )
            )
    return rows


def _shown(own: Share) -> str:
    count = f"{own['identified']} of {own['of']}"
    return count if own["error"] is None else f"{count}, {own['error']:g} %, {own['holds']}"


def table(rows: Sequence[Found]) -> str:
    """Return the table of the simulated joints for the docs."""
    lines = []
    for row in rows:
        shares = " | ".join(_shown(own) for own in (row["travel"], row["damping"], row["sliding"]))
        residuals = " | ".join(f"{row['held_out'][law]:g}" for law in LAWS)
        lines.append(f"| {row['friction']} | {shares} | {residuals} |")
    return "\n".join([HEAD, *lines])


def real_table(rows: Sequence[Real]) -> str:
    """Return the table of the real robots for the docs."""
    lines = []
    for row in rows:
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in row["verdicts"].items())
        travels = ", ".join(f"{1e3 * each:.2g}" for each in row["travels"])
        shares = " | ".join(f"{row['held_out'][law]:g}" for law in LAWS)
        lines.append(f"| {row['log']} | {verdicts} | {f'{travels} mrad' if travels else 'none'} | {shares} |")
    return "\n".join([REAL_HEAD, *lines])


def main() -> None:
    """Print the tables, and save the figures, beside those of the other run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--real", action="store_true", help="the real robots' logs")
    parser.add_argument("--save", type=Path, metavar="FILE", help="save the figures as JSON")
    options = parser.parse_args()
    before = json.loads(options.save.read_text(encoding="utf-8")) if options.save and options.save.exists() else {}
    if options.real:
        now: dict[str, object] = {"real": real()}
        print(real_table(now["real"]))  # type: ignore[arg-type]
    else:
        now = {"simulated": simulated()}
        print(table(now["simulated"]))  # type: ignore[arg-type]
    if options.save:
        with whole_or_not_at_all(options.save) as temporary:
            temporary.write_text(json.dumps({**before, **now}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
