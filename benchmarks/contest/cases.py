"""Robots that walk or move, and what is wrong in each condition; everything follows from one seed."""

from dataclasses import dataclass, replace

from studies.accuracy_cases import DOUBLE_SUPPORT

from stribeck_simulation.prescribed.gait import Gait
from stribeck_simulation.scenario import StepsTable
from stribeck_simulation.sensors.profiles import PROFILES, SensorProfile

SEED = 20261
RATE = 1000.0
"""Of the simulation [Hz]."""
EVERY = 2
"""One of how many of its samples is published [1]."""
SECONDS = 15.0
"""Of the robots whose motion is prescribed."""
SLOPE = 100.0
"""Friction turns round as tanh(100 v) does, v in [rad/s]."""
SPREAD = 0.3
"""Standard deviation of the logarithms of Coulomb and viscous friction about the table's [1]."""
VISCOUS = 0.2
"""[N m s/rad]"""
COULOMB = 0.5
"""Of joints whose motion is prescribed [N m]."""
LOAD_SHARE = 0.05
"""Of the torque that a gear loses [1]."""
BRISTLES = {"bristle_stiffness": 300.0, "bristle_damping": 2.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2}
"""[N m/rad], [N m s/rad], [1], [rad/s]: friction of 0.75 N m comes within some 3 mrad."""


def _steps(single_support: float = 0.8, **sizes: float) -> list[StepsTable]:
    """Return seven steps straight on and four to each side."""
    common = {"single_support": single_support, "double_support": DOUBLE_SUPPORT}
    forward, sideways = sizes["forward"], sizes["sideways"]
    straight = StepsTable(count=7, forward=forward, **common)
    return [
        straight,
        *(StepsTable(count=4, sideways=way, width=sizes["width"], **common) for way in (sideways, -sideways)),
    ]


WALKS = {
    "TORO-like": _steps(forward=0.3, sideways=0.25, width=0.16),
    "TALOS": _steps(forward=0.3, sideways=0.2, width=0.17),
    "G1": _steps(0.6, forward=0.2, sideways=0.1, width=0.12),
}
"""Of the humanoids of studies/accuracy_cases.py, with Coulomb friction of the joints and sizes of steps from there."""
PRESCRIBED: dict[str, Gait] = {"quadruped": "trot", "arm": "stand"}
"""Robots whose motion is prescribed, and the gait of those with feet."""
WRENCHES = ("TORO-like", "TALOS")
"""Robots whose feet have force and torque sensors."""
COMMANDED = ("hobby-arm", "clamped-quadruped")
"""Robots whose logs have position commands instead of torques; MuJoCo simulates them."""
LATENCIES = {"5ms": 0.005, "20ms": 0.02}
"""Conditions of these robots: time from a command's stamp until the drive acts on it [s]."""
COMMANDED_SECONDS = 30.0
"""Duration of their logs [s]."""
ROBOTS = (*WALKS, *PRESCRIBED, *COMMANDED)


@dataclass(frozen=True)
class Condition:
    """What is wrong, or not as usual.

    Attributes
    ----------
    says
        For people.
    sensors
        Their errors.
    wrong_model
        Whether masses are off by up to 5 %, centres of mass by 5 to 10 mm, principal moments by up to 20 %.
    gains
        Standard deviation of the torque sensors' gains [1].
    late
        How late torques are [s].
    load
        Share of its torque that a joint loses beside Coulomb friction [1].
    bristles
        Whether friction is LuGre's.
    """

    says: str
    sensors: SensorProfile = PROFILES["calibrated"]
    wrong_model: bool = False
    gains: float = 0.0
    late: float = 0.0
    load: float = 0.0
    bristles: bool = False


NOISY = replace(PROFILES["calibrated"], position_noise=1e-4, torque_noise=0.3)

CONDITIONS = {
    "clean": Condition("sensors without errors", PROFILES["ideal"]),
    "noisy": Condition("white noise of 1e-4 rad and 0.3 N m", NOISY),
    "inertias": Condition("masses, centres of mass and moments of inertia wrong", wrong_model=True),
    "gains": Condition("torque gains 3 % off", gains=0.03),
    "delay": Condition("torques 3 ms late", late=0.003),
    "load": Condition("friction grows with the load, 5 % of it", load=LOAD_SHARE),
    "LuGre": Condition("LuGre friction, with Stribeck effect and presliding", bristles=True),
}
"""Encoders of 20 bits with 1e-5 rad of noise and torque sensors with 0.1 N m in all but the first two."""
