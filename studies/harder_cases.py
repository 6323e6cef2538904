"""Conditions harder than the accuracy study's: sensor and model errors that the estimator does not model.

All are made from walks with perfect sensors, as in `studies.accuracy_cases`; most change only the log. No constant was
tuned on these walks: diagonal, backwards, turning and pushed steps with other lengths and durations.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from stribeck import Robot
from stribeck.core.base.typing import Array
from stribeck.core.log import RobotLog
from stribeck.simulation.run import Simulated
from stribeck.simulation.walking.footsteps import Push
from studies.accuracy_cases import NAMES, Case, as_walked, exact_walks, measured, steps_for, with_factors, wrong_model
from studies.changes import earlier, heaviest, known, period_of, quantized, with_body, with_model

CORNER = 10.0
"""Bandwidth of coloured noise [Hz]."""
PERIODS = 18
"""Periods of the torque ripple per turn [1]: a motor with six slots and 18 poles."""
LEVER = 0.1
"""Distance of the payload in front of the heaviest body's center [m]."""
ROTOR = 0.05
"""Rotor inertia of every joint, reflected to the joint side [kg m^2], in cases with rotors."""
SPIKES = 0.5, 20.0
"""Rate of spikes in a joint's torque [1/s], and their height [N m]."""


@dataclass(frozen=True, kw_only=True)
class Harder(Case):
    """Errors in addition to the errors of `Case`; zero means none.

    Attributes
    ----------
    bits
        Encoder bits per turn [1]; 0 without quantization.
    coloured
        Standard deviation of torque noise below `CORNER` [N m].
    ripple
        Amplitude of a torque that is periodic in position, relative to the joint's Coulomb friction [1].
    gains
        Standard deviation of the torque sensors' gains [1].
    torque_delay, contact_delay
        Delays of torques and of contacts [s].
    tilt
        Angle between the IMU and the base [deg].
    payload
        Mass that is missing in the model [kg].
    decades
        Decades over which the friction of different joints is spread [1].
    every
        Decimation factor of the log [1].
    standing
        Duration of standing before the walk [s].
    spikes
        Whether torques have spikes.
    rotors
        Maximum relative error of rotor inertias [1].
    pushed
        Whether one walk is pushed.
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
"""Conditions by name. All include the noise of case A: 2e-5 rad and 0.1 N m."""


def other_walks(name: str) -> list[Simulated]:
    """Simulate four walks of about 15 s, of one robot of the accuracy study, with perfect sensors."""
    size, width = (0.6, 0.14) if name == "G1" else (1.0, 0.18)
    ways = {
        "diagonal": steps_for(14, 0.7, 0.2, forward=0.18 * size, sideways=0.12 * size, width=width),
        "backwards": steps_for(14, 0.9, 0.3, forward=-0.15 * size),
        "turning": steps_for(14, 0.8, 0.2, forward=0.1 * size, turn=0.2, width=width),
        "pushed": steps_for(14, 0.7, 0.2, forward=0.2 * size),
    }
    side = 80.0 * size**2
    pushes = {"pushed": [Push(start=at, duration=0.1, force=[-side, way * side, 0.0]) for at, way in PUSHED]}
    return exact_walks(name, ways, pushes)


PUSHED = (4.0, 1), (8.0, -1), (11.0, 1)
"""Time [s] and direction of each push."""


def as_seen(walks: list[Simulated], case: Case, seed: int) -> tuple[list[Simulated], Robot, list[RobotLog]]:
    """Apply a case: walks with its friction, the robot model that the estimators get, and the measured logs."""
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
    """Scale the friction of each joint by a random factor; the factors spread over so many decades."""
    factors = np.ones((len(walk.truth.parameters), len(NAMES)))
    shuffled = np.random.default_rng([seed, 4]).permutation(len(factors)) / (len(factors) - 1) - 0.5
    scaled = [NAMES.index(name) for name in ("viscous", "coulomb", "offset")]
    factors[:, scaled] = 10 ** (decades * shuffled)[:, None]
    return with_factors(walk, factors)


def _with_rotors(walk: Simulated) -> Simulated:
    """Add the torques that accelerate rotors to a walk that was simulated without rotors."""
    acceleration = np.gradient(np.gradient(walk.log.position, walk.log.time, axis=0), walk.log.time, axis=0)
    return replace(walk, log=replace(walk.log, torque=walk.log.torque + ROTOR * acceleration))


def _other_rotors(robot: Robot, most: float, seed: int) -> Robot:
    """Give the robot rotors with an error relative to the walks' rotors; its torques are measured at the motors."""
    factors = 1 + most * np.random.default_rng([seed, 5]).uniform(-1, 1, len(robot.joint_names))

    def change(model: pin.Model) -> None:
        model.armature[-len(factors) :] = ROTOR * factors

    return replace(with_model(robot, change), torque_source="motor_current")


def _without_payload(robot: Robot, mass: float) -> Robot:
    """Subtract a point mass from the heaviest body: the walking robot carries it, the estimators' model does not."""

    def change(body: pin.Inertia) -> pin.Inertia:
        payload = pin.Inertia(mass, body.lever + LEVER * np.eye(3)[0], np.zeros((3, 3)))
        return pin.Inertia.FromDynamicParameters(body.toDynamicParameters() - payload.toDynamicParameters())

    return with_body(robot, heaviest(robot), change)


def _logged(walk: Simulated, case: Harder, seed: int, number: int) -> RobotLog:
    """Add the sensor errors of a case to a walk; errors that belong to the robot are the same in all walks."""
    log, names = walk.log, walk.log.joint_names
    fixed, drawn = np.random.default_rng([seed, 6]), np.random.default_rng([seed, 7, number])
    log = _stood(log, case.standing)
    coulomb = np.array([walk.truth.parameters.get(joint, {}).get("coulomb", 0.0) for joint in names])
    phase = fixed.uniform(0, 2 * np.pi, len(names))
    torque = log.torque + case.ripple * coulomb * np.sin(PERIODS * log.position + phase)
    torque = torque * (1 + case.gains * fixed.standard_normal(len(names)))
    period = period_of(log)
    torque = torque[earlier(log, case.torque_delay)] + _coloured(drawn, torque.shape, case.coloured, period)
    axis = np.append(Rotation.from_euler("z", fixed.uniform(0, 2 * np.pi)).apply([1.0, 0.0, 0.0])[:2], 0.0)
    turn = Rotation.from_rotvec(np.deg2rad(case.tilt) * axis)
    log = replace(
        log,
        torque=torque,
        base_orientation=(Rotation.from_quat(known(log.base_orientation)) * turn).as_quat(),
        contact=known(log.contact)[earlier(log, case.contact_delay)],
    )
    log = quantized(measured(log, case, seed, number), case.bits)
    if case.spikes:
        rate, height = SPIKES
        there = drawn.random(log.torque.shape) < rate * period
        log = replace(log, torque=log.torque + height * there * drawn.choice([-1.0, 1.0], log.torque.shape))
    return log.take(slice(None, None, case.every))


def _stood(log: RobotLog, seconds: float) -> RobotLog:
    """Repeat the first sample of a log for so many seconds before the log starts."""
    period = period_of(log)
    count = round(seconds / period)
    whole = log.take(np.concatenate([np.zeros(count, dtype=np.int64), np.arange(len(log.time))]))
    return replace(whole, time=log.time[0] + period * np.arange(len(whole.time))) if count else log


def _coloured(generator: np.random.Generator, shape: tuple[int, ...], deviation: float, period: float) -> Array:
    """Draw first-order Gauss-Markov noise, shape (T, n)."""
    memory = np.exp(-2 * np.pi * CORNER * period)
    white = generator.standard_normal(shape)
    return np.asarray(deviation * lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], white, axis=0))
