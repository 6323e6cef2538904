"""Sensor profiles of simulated robots, with the sources of all values.

Values marked "assumed" have no public source. Sources of the other values:

- AksIM: RLS AksIM off-axis absolute encoder, 20 bits per turn.
- DLR: the absolute joint position sensor of DLR's lightweight robot, whose drives TORO has, measures to 0.01 deg.
- Kinova: torque offsets identified on a Kinova Gen3 with joint torque sensors, roahmlab/RAPTOR: 0.15 to 2.5 N m,
  median 0.5 N m.
- MTi: Xsens MTi manual MT0100P: orientation repeatable to 0.2 deg, static accuracy of roll and pitch 0.5 deg, dynamic
  accuracy 2 deg RMS. MTi-1: 0.007 deg/s/sqrt(Hz), bias instability 10 deg/h, 120 ug/sqrt(Hz).
- MPU: InvenSense MPU-9250 PS-MPU-9250A-01: 0.01 deg/s/sqrt(Hz), +-5 deg/s at zero rate; 300 ug/sqrt(Hz), +-60 mg.
- Axia: ATI Axia80-M20, ranges 900 N and 20 N m.
- Cassie: time stamps at 2 kHz of DAIRLab/cassie_impact_dataset are off by 0.022 ms RMS, 1 % of them by 0.1 ms or more.
"""

from dataclasses import dataclass

import numpy as np

from stribeck.core.errors import SettingsError

DEGREE, MILLI_G = np.pi / 180, 9.81e-3
"""One degree [rad] and one thousandth of standard gravity [m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class SensorProfile:
    """Sensor errors; standard deviations unless stated otherwise. Biases and offsets are drawn once per run.

    Attributes
    ----------
    position_resolution
        Step of the encoders [rad]; not a standard deviation.
    position_noise, position_bias
        White noise and zero error of positions [rad].
    torque_noise, torque_offset
        White noise and zero error of torques [N m].
    torque_drift
        Constant drift rate of the offset, drawn once per run [N m/min].
    orientation_bias, orientation_noise
        Constant and slowly varying error about each axis of the IMU [rad].
    gyroscope_noise, accelerometer_noise
        White noise density [rad/s/sqrt(Hz)], [m/s^2/sqrt(Hz)].
    gyroscope_bias, accelerometer_bias
        Bias of gyroscope [rad/s] and accelerometer [m/s^2].
    force_noise, force_bias, moment_noise, moment_bias
        Noise and bias of foot forces [N] and moments [N m].
    delay
        Delay of IMU and feet relative to the joints [s]; not a standard deviation.
    jitter
        Jitter of time stamps [s].
    """

    position_resolution: float = 0.0
    position_noise: float = 0.0
    position_bias: float = 0.0
    torque_noise: float = 0.0
    torque_offset: float = 0.0
    torque_drift: float = 0.0
    orientation_bias: float = 0.0
    orientation_noise: float = 0.0
    gyroscope_noise: float = 0.0
    gyroscope_bias: float = 0.0
    accelerometer_noise: float = 0.0
    accelerometer_bias: float = 0.0
    force_noise: float = 0.0
    force_bias: float = 0.0
    moment_noise: float = 0.0
    moment_bias: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0

    def only(self, *errors: str) -> "SensorProfile":
        """Keep only the named errors."""
        return SensorProfile(**{error: getattr(self, error) for error in errors})


REALISTIC = SensorProfile(
    position_resolution=2 * np.pi / 2**20,  # AksIM
    position_noise=1e-5,  # assumed: two steps
    position_bias=0.01 * DEGREE,  # DLR
    torque_noise=0.1,  # assumed: 0.1 % of 100 N m
    torque_offset=0.5,  # Kinova, median
    torque_drift=0.05,  # assumed: a tenth of the offset per minute
    orientation_bias=0.2 * DEGREE,  # MTi, repeatability
    orientation_noise=0.1 * DEGREE,  # assumed: half of it
    gyroscope_noise=0.007 * DEGREE,  # MTi-1
    gyroscope_bias=10 * DEGREE / 3600,  # MTi-1
    accelerometer_noise=0.12 * MILLI_G,  # MTi-1
    accelerometer_bias=2 * MILLI_G,  # assumed: leveled to 0.1 deg
    force_noise=0.9,  # assumed: 0.1 % of Axia's range
    force_bias=4.5,  # assumed: 0.5 %
    moment_noise=0.02,  # assumed: 0.1 %
    moment_bias=0.1,  # assumed: 0.5 %
    delay=0.001,  # assumed: one cycle of a 1 kHz bus
    jitter=0.022e-3,  # Cassie
)

PROFILES = {
    "ideal": SensorProfile(),
    "calibrated": REALISTIC.only(  # only noise remains
        *("position_resolution", "position_noise", "torque_noise", "gyroscope_noise"),
        *("accelerometer_noise", "force_noise", "moment_noise"),
    ),
    "realistic": REALISTIC,
    "harsh": SensorProfile(
        position_resolution=2 * np.pi / 2**16,  # assumed: 16 bits per turn
        position_noise=1e-4,  # assumed: one step
        position_bias=0.1 * DEGREE,  # assumed: ten times DLR
        torque_noise=1.0,  # assumed: 1 % of 100 N m
        torque_offset=2.5,  # Kinova, largest
        torque_drift=0.5,  # assumed
        orientation_bias=0.5 * DEGREE,  # MTi, static accuracy
        orientation_noise=2.0 * DEGREE,  # MTi, dynamic accuracy
        gyroscope_noise=0.01 * DEGREE,  # MPU
        gyroscope_bias=0.5 * DEGREE,  # assumed: a tenth of MPU's after zeroing at rest
        accelerometer_noise=0.3 * MILLI_G,  # MPU
        accelerometer_bias=60 * MILLI_G,  # MPU
        force_noise=9.0,  # assumed: 1 % of Axia's range
        force_bias=45.0,  # assumed: 5 %
        moment_noise=0.2,  # assumed: 1 %
        moment_bias=1.0,  # assumed: 5 %
        delay=0.005,  # assumed
        jitter=0.1e-3,  # Cassie, one in a hundred
    ),
}
"""Profiles by name."""


def get_profile(name: str) -> SensorProfile:
    """Return a profile by name.

    Raises
    ------
    SettingsError
        If the name is unknown; the message lists all names.
    """
    if name not in PROFILES:
        raise SettingsError(f"sensors: found '{name}', expected one of {', '.join(PROFILES)}")
    return PROFILES[name]
