"""Harder conditions than the accuracy study's: sensors and models wrong in ways that the estimator does not know of.

All are made from walks that sensors without errors saw, as in `studies.accuracy_cases`; most are changes to the log
alone. The walks are ones that nothing was tuned on: diagonal, backwards, turning and pushed steps of other lengths and
durations.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from stribeck import Robot
from stribeck.base.typing import Array
from stribeck.log import RobotLog
from stribeck_simulation.run import Simulated
from stribeck_simulation.scenario import PushTable, StepsTable
from studies.accuracy_cases import NAMES, ROBOTS, Case, as_walked, kept_walks_of, measured, with_factors, wrong_model

CORNER = 10.0
"""Frequency [Hz] that coloured noise reaches to."""
PERIODS = 18
"""Of a torque ripple, a turn [1]: a motor with six slots, three times as many poles."""
LEVER = 0.1
"""Of a payload, ahead of the centre of the heaviest body [m]."""
ROTOR = 0.05
"""Inertia of every rotor, seen from the joint, where there are any [kg m^2]."""
SPIKES = 0.5, 20.0
"""How often a joint's torque has one [1/s], and how high it is [N m]."""


@dataclass(frozen=True, kw_only=True)
class Harder(Case):
    """What is wrong beside a case's errors.

    Attributes
    ----------
    bits
        Of an encoder, a turn [1]; 0 if it is not quantised.
    coloured
        Standard deviation of torque noise below `CORNER` [N m].
    ripple
        Torque that comes and goes over position, over the joint's Coulomb friction [1].
    gains
        Standard deviation of the torque sensors' gains [1].
    torque_delay, contact_delay
        Of torques and of contacts [s].
    tilt
        Of the IMU against the base [deg].
    payload
        That the model lacks [kg].
    decades
        Over how many the frictions of joints are spread [1].
    every
        One of how many samples is logged [1].
    standing
        Before the walk [s].
    spikes
        Whether torques have spikes.
    rotors
        How wrong rotor inertias are, at most [1].
    pushed
        Whether there is a walk that is pushed.
    """

    bits: int = 0
    coloured: float = 0.0
    ripple: float = 0.0
    gains: float = 0.0
    torque_delay: float = 0.0
    contact_delay: float = 0.0
    tilt: float = 0.0
    payload: float = 0.0
    decades: float = 0.0
    every: int = 1
    standing: float = 0.0
    spikes: bool = False
    rotors: float = 0.0
    pushed: bool = False


def _harder(**wrong: float) -> Harder:
    return Harder(encoder=2e-5, torque=0.1, **wrong)  # type: ignore[arg-type]


CONDITIONS: dict[str, Harder] = {
    "another gait": _harder(wrong_model=True),
    "14-bit encoders": _harder(bits=14),
    "16-bit encoders": _harder(bits=16),
    "coloured torque noise": _harder(coloured=0.3),
    "torque ripple": _harder(ripple=0.1),
    "gains 3 % wrong": _harder(gains=0.03),
    "torques 2 ms late": _harder(torque_delay=0.002),
    "IMU tilted by 1.5 deg": _harder(tilt=1.5),
    "contacts 20 ms late": _harder(contact_delay=0.02),
    "2 kg not in the model": _harder(payload=2.0),
    "frictions differ tenfold": _harder(wrong_model=True, decades=1.0),
    "250 Hz": _harder(every=4),
    "a minute of standing": _harder(standing=60.0),
    "spikes in torques": _harder(spikes=True),
    "rotor inertias 20 % wrong": _harder(rotors=0.2),
    "pushed": _harder(pushed=True),
    "several at once": _harder(
        wrong_model=True, bits=16, coloured=0.1, ripple=0.05, gains=0.01, torque_delay=0.001, tilt=0.5, rotors=0.1
    ),
}
"""All with the noise of A: 2e-5 rad and 0.1 N m."""


def _short(single_support: float, double_support: float, **kind: float) -> StepsTable:
    count = round(14 / (single_support + double_support))
    return StepsTable(count=count, single_support=single_support, double_support=double_support, **kind)


def other_walks(name: str) -> list[Simulated]:
    """Return four walks of about 15 s of a robot of the accuracy study, as sensors without errors see them."""
    size, width = (0.6, 0.14) if name == "G1" else (1.0, 0.18)
    ways = {
        "diagonal": _short(0.7, 0.2, forward=0.18 * size, sideways=0.12 * size, width=width),
        "backwards": _short(0.9, 0.3, forward=-0.15 * size),
        "turning": _short(0.8, 0.2, forward=0.1 * size, turn=0.2, width=width),
        "pushed": _short(0.7, 0.2, forward=0.2 * size),
    }
    side = 80.0 * size**2
    pushes = {"pushed": [PushTable(start=at, duration=0.1, force=[-side, way * side, 0.0]) for at, way in PUSHED]}
    return kept_walks_of(name, replace(ROBOTS[name], walks=ways), pushes)


PUSHED = (4.0, 1), (8.0, -1), (11.0, 1)
"""When a walk is pushed [s], and to which side."""


def as_seen(walks: list[Simulated], case: Case, seed: int) -> tuple[list[Simulated], Robot, list[RobotLog]]:
    """Return walks with a case's friction, the robot as the estimators believe it to be, and what its sensors log."""
    if isinstance(case, Harder):
        walks = walks if case.pushed else walks[:-1]
        walks = [_spread_out(walk, case.decades, seed) if case.decades else walk for walk in walks]
    walks = as_walked(walks, case, seed)
    robot = wrong_model(walks[0].robot, seed) if case.wrong_model else walks[0].robot
    if not isinstance(case, Harder):
        return walks, robot, [measured(walk.log, case, seed, number) for number, walk in enumerate(walks)]
    if case.rotors:
        walks, robot = [_with_rotors(walk) for walk in walks], _other_rotors(robot, case.rotors, seed)
    if case.payload:
        robot = _without_payload(robot, case.payload)
    return walks, robot, [_logged(walk, case, seed, number) for number, walk in enumerate(walks)]


def _spread_out(walk: Simulated, decades: float, seed: int) -> Simulated:
    """Return a walk whose joints' frictions, all of a joint's alike, are spread over so many decades."""
    factors = np.ones((len(walk.truth.parameters), len(NAMES)))
    shuffled = np.random.default_rng([seed, 4]).permutation(len(factors)) / (len(factors) - 1) - 0.5
    scaled = [NAMES.index(name) for name in ("viscous", "coulomb", "offset")]
    factors[:, scaled] = 10 ** (decades * shuffled)[:, None]
    return with_factors(walk, factors)


def _with_rotors(walk: Simulated) -> Simulated:
    """Return a walk whose motors have moved rotors as well, of which the simulated robot has none."""
    acceleration = np.gradient(np.gradient(walk.log.position, walk.log.time, axis=0), walk.log.time, axis=0)
    return replace(walk, log=replace(walk.log, torque=walk.log.torque + ROTOR * acceleration))


def _other_rotors(robot: Robot, most: float, seed: int) -> Robot:
    """Return the robot with rotors that are as large as the walks', but for an error; its torques are the motors'."""
    model = pin.Model(robot.tree.model)
    factors = 1 + most * np.random.default_rng([seed, 5]).uniform(-1, 1, len(robot.joint_names))
    model.armature[-len(factors) :] = ROTOR * factors
    return replace(robot, tree=replace(robot.tree, model=model), torque_source="motor_current")


def _without_payload(robot: Robot, mass: float) -> Robot:
    """Return the robot without a point mass, which its heaviest body is given as to have: it may exist without."""
    model = pin.Model(robot.tree.model)
    joint = max(range(1, model.njoints), key=lambda k: float(model.inertias[k].mass))
    body = model.inertias[joint]
    away = body.lever + LEVER * np.eye(3)[0]
    left = body.toDynamicParameters() - pin.Inertia(mass, away, np.zeros((3, 3))).toDynamicParameters()
    model.inertias[joint] = pin.Inertia.FromDynamicParameters(left)
    return replace(robot, tree=replace(robot.tree, model=model))


def _logged(walk: Simulated, case: Harder, seed: int, number: int) -> RobotLog:
    """Return a walk as the sensors of a case see it; what is fixed to the robot is the same in all walks."""
    log, names = walk.log, walk.log.joint_names
    fixed, drawn = np.random.default_rng([seed, 6]), np.random.default_rng([seed, 7, number])
    log = _stood(log, case.standing)
    coulomb = np.array([walk.truth.parameters.get(joint, {}).get("coulomb", 0.0) for joint in names])
    phase = fixed.uniform(0, 2 * np.pi, len(names))
    torque = log.torque + case.ripple * coulomb * np.sin(PERIODS * log.position + phase)
    torque = torque * (1 + case.gains * fixed.standard_normal(len(names)))
    period = float(np.median(np.diff(log.time)))
    torque = torque[_earlier(log, case.torque_delay)] + _coloured(drawn, torque.shape, case.coloured, period)
    axis = np.append(Rotation.from_euler("z", fixed.uniform(0, 2 * np.pi)).apply([1.0, 0.0, 0.0])[:2], 0.0)
    turn = Rotation.from_rotvec(np.deg2rad(case.tilt) * axis)
    assert log.base_orientation is not None
    assert log.contact is not None
    log = replace(
        log,
        torque=torque,
        base_orientation=(Rotation.from_quat(log.base_orientation) * turn).as_quat(),
        contact=log.contact[_earlier(log, case.contact_delay)],
    )
    log = measured(log, case, seed, number)
    if case.bits:
        step = 2 * np.pi / 2**case.bits
        log = replace(log, position=step * np.round(log.position / step))
    if case.spikes:
        rate, height = SPIKES
        there = drawn.random(log.torque.shape) < rate * period
        log = replace(log, torque=log.torque + height * there * drawn.choice([-1.0, 1.0], log.torque.shape))
    return log.take(slice(None, None, case.every))


def _stood(log: RobotLog, seconds: float) -> RobotLog:
    """Return a log that begins with its first sample for so long."""
    period = float(np.median(np.diff(log.time)))
    count = round(seconds / period)
    whole = log.take(np.concatenate([np.zeros(count, dtype=np.int64), np.arange(len(log.time))]))
    return replace(whole, time=log.time[0] + period * np.arange(len(whole.time))) if count else log


def _earlier(log: RobotLog, late: float) -> NDArray[np.int64]:
    """Return the rows that a sensor shows which is so late [s]."""
    rows = np.arange(len(log.time))
    return np.maximum(rows - round(late / float(np.median(np.diff(log.time)))), 0)


def _coloured(generator: np.random.Generator, shape: tuple[int, ...], deviation: float, period: float) -> Array:
    """Return first-order Gauss-Markov noise, shape (T, n)."""
    memory = np.exp(-2 * np.pi * CORNER * period)
    white = generator.standard_normal(shape)
    return np.asarray(deviation * lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], white, axis=0))
