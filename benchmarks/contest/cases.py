"""Robots of the benchmark, their motions, and the errors of each condition; one seed determines all logs."""

from dataclasses import dataclass, replace

from studies.accuracy_cases import DOUBLE_SUPPORT

from stribeck.simulation.prescribed.gait import Gait
from stribeck.simulation.sensors.profiles import PROFILES, SensorProfile
from stribeck.simulation.walking.footsteps import Steps

SEED = 20261
RATE = 1000.0
"""Rate of the simulation [Hz]."""
EVERY = 2
"""Stride of the published samples [1]."""
SECONDS = 15.0
"""Duration of prescribed motions [s]."""
SLOPE = 100.0
"""Slope a of simulated Coulomb friction, tanh(a v) [s/rad]."""
SPREAD = 0.3
"""Standard deviation of the logarithms of Coulomb and viscous friction [1]."""
VISCOUS = 0.2
"""Median of viscous friction [N m s/rad]."""
COULOMB = 0.5
"""Median of Coulomb friction in joints with a prescribed motion [N m]."""
LOAD_SHARE = 0.05
"""Share of the torque that is lost in a gear [1]."""
BRISTLES = {"bristle_stiffness": 300.0, "bristle_damping": 2.0, "stribeck_gain": 0.2, "stribeck_velocity": 0.2}
"""LuGre parameters [N m/rad], [N m s/rad], [1], [rad/s]: friction of 0.75 N m builds up within about 3 mrad."""


def _steps(single_support: float = 0.8, **sizes: float) -> list[Steps]:
    """Describe seven steps straight on and four to each side."""
    common = {"single_support": single_support, "double_support": DOUBLE_SUPPORT}
    forward, sideways = sizes["forward"], sizes["sideways"]
    straight = Steps(count=7, forward=forward, **common)
    return [straight, *(Steps(count=4, sideways=way, width=sizes["width"], **common) for way in (sideways, -sideways))]


WALKS = {
    "TORO-like": _steps(forward=0.3, sideways=0.25, width=0.16),
    "TALOS": _steps(forward=0.3, sideways=0.2, width=0.17),
    "G1": _steps(0.6, forward=0.2, sideways=0.1, width=0.12),
}
"""Walks of the humanoids in studies/accuracy_cases.py, with the same Coulomb friction and sizes of steps."""
PRESCRIBED: dict[str, Gait] = {"quadruped": "trot", "arm": "stand"}
"""Robots whose motion is prescribed, and the gait of those with feet."""
WRENCHES = ("TORO-like", "TALOS")
"""Robots whose feet have force and torque sensors."""
COMMANDED = ("hobby-arm", "clamped-quadruped")
"""Robots whose logs have position commands instead of torques; MuJoCo simulates them."""
LATENCIES = {"5ms": 0.005, "20ms": 0.02}
"""Conditions of robots with position commands: delay between a command's stamp and the drive's reaction [s]."""
COMMANDED_SECONDS = 30.0
"""Duration of logs with position commands [s]."""
ROBOTS = (*WALKS, *PRESCRIBED, *COMMANDED)


@dataclass(frozen=True)
class Condition:
    """Errors of a benchmark case.

    Attributes
    ----------
    says
        Description in words.
    sensors
        Sensor errors.
    wrong_model
        Whether masses are off by up to 5 %, centers of mass by 5 to 10 mm, and principal moments by up to 20 %.
    gains
        Standard deviation of the torque sensors' gains [1].
    late
        Delay of torques [s].
    load
        Share of the torque that a joint loses in addition to Coulomb friction [1].
    bristles
        Whether friction follows the LuGre model.
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
"""Conditions by name. All but the first two have 20-bit encoders with 1e-5 rad of noise, and 0.1 N m torque noise."""
