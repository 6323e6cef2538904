"""A quadruped that trots in MuJoCo under a policy of 50 Hz, on late position commands or on ramps between them."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation
from tests.commanded import LEGS, QUADRUPED, STEP, leg_drives, with_drives

LINK, OUTER = 0.213, 0.0955
"""Length of thigh and calf, and distance of a leg's plane from its hip [m]."""
HIPS = np.array([[0.1934, 0.0465, 0], [0.1934, -0.0465, 0], [-0.1934, 0.0465, 0], [-0.1934, -0.0465, 0]])
SIDES, PHASES = np.sign(HIPS[:, 1]), np.array([0, 0.5, 0.5, 0])
WEIGHT = 9.81 * (6.921 + 4 * (0.678 + 1.152 + 0.241))
POLICY, STRIDES = 50.0, 2.0
"""Rate of the policy and of strides [Hz]."""
HEIGHT, LIFT = 0.268, 0.06
"""Height of the hips above the feet' centers, and clearance of a swinging foot [m]."""
START = 1.5
"""Time after which the robot trots [s]; the log starts later still."""


def leg_angles(foot, side):
    """Compute a leg's joint angles from the place of its foot relative to the hip [m]."""
    x, y, z = foot
    reach = np.sqrt(max(y * y + z * z - OUTER**2, 1e-4))
    calf = -np.arccos(np.clip((x * x + reach**2) / (2 * LINK**2) - 1, -1, 1))
    return np.array([np.arctan2(y, -z) - np.arctan2(side * OUTER, reach), np.arctan2(-x, reach) - calf / 2, calf])


class Policy:
    """Footholds follow speed; commands of stance legs carry the weight and keep the trunk level."""

    def __init__(self, generator, kp):
        self.kp, self.offset = kp, np.zeros((4, 2))
        self.waves = [(f, a, generator.uniform(0, 6)) for f, a in ((0.07, 0.3), (0.11, 0.12), (0.05, 0.4))]

    def __call__(self, time, pose, velocity):
        """Choose commands [rad] from the pose of the base (MuJoCo's order) and its velocity."""
        ramp = np.clip(time - 0.5, 0, 1)
        forward, left, turn = (ramp * a * np.sin(2 * np.pi * f * time + p) for f, a, p in self.waves)
        rotation = Rotation.from_quat(pose[3:7], scalar_first=True).as_matrix()
        pitch, roll = -np.arcsin(rotation[2, 0]), np.arctan2(rotation[2, 1], rotation[2, 2])
        level = np.array(  # base to a frame that is level
            [
                [np.cos(pitch), np.sin(pitch) * np.sin(roll), np.sin(pitch) * np.cos(roll)],
                [0, np.cos(roll), -np.sin(roll)],
                [-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)],
            ]
        )
        speed, commands = (rotation.T @ velocity[:3])[:2], []
        for leg, (hip, side) in enumerate(zip(HIPS, SIDES, strict=True)):
            round_trip = np.array([-hip[1], hip[0]])
            wanted, actual = np.array([forward, left]) + turn * round_trip, speed + velocity[5] * round_trip
            share = 2 * ((STRIDES * time + PHASES[leg]) % 1.0)
            foot = np.array([0, side * (OUTER + 0.01), -HEIGHT])
            if share < 1:  # stance
                foot[:2] += wanted * (1 - 2 * share) / (4 * STRIDES) + self.offset[leg]
                carried = 0.5 * np.clip(min(share, 1 - share) / 0.08, 0, 1)
            else:
                share, carried = share - 1, 0.0
                self.offset[leg] = (0.04 + 0.25 / STRIDES) * (actual - wanted)
                foot[:2] += -wanted * np.cos(np.pi * share) / (4 * STRIDES) + self.offset[leg] * share
                foot[2] += LIFT * np.sin(np.pi * share) ** 2 * ramp
                foot = level.T @ (hip + foot) - hip
            fore = np.sign(hip[0])
            upright = fore * (200 * pitch + 15 * velocity[4]) - side * (200 * roll + 15 * velocity[3])
            force = (ramp * carried + (1 - ramp) * 0.25) * ((1 + 0.1 * fore) * WEIGHT + upright)
            commands.append(self.carrying(foot, side, rotation[2] * max(force, 0.0)))
        return np.concatenate(commands)

    def carrying(self, foot, side, force):
        """Choose a leg's commands so that its foot pushes with a force [N]."""
        angles, delta = leg_angles(foot, side), 1e-5
        inverse = np.stack([(leg_angles(foot + row, side) - angles) / delta for row in delta * np.eye(3)], axis=1)
        return angles - np.linalg.solve(inverse.T, force) / self.kp


def trot(seed=11, latency=0.006, seconds=10.0, rate=500.0, kp=30.0, kd=0.7, noise=6.0, threshold=22.0, ramps=False):
    """Simulate a trot, and return its log and truth; flags of contact compare noisy forces [N] with a threshold.

    With `ramps` between commands, torques are logged instead of commands.
    """
    generator, drives = np.random.default_rng(seed), leg_drives(seed, latency, kp, kd)
    spec, policy = with_drives(QUADRUPED, drives, clamped=False), Policy(generator, kp)
    for site, kind in [("imu", "GYRO"), ("imu", "ACCELEROMETER"), *((leg, "TOUCH") for leg in LEGS)]:
        sensor = spec.add_sensor(type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"), objname=site)
        sensor.objtype = mujoco.mjtObj.mjOBJ_SITE
    model = spec.compile()
    data = mujoco.MjData(model)
    standing = np.concatenate([leg_angles(np.array([0, side * (OUTER + 0.01), -HEIGHT]), side) for side in SIDES])
    data.qpos[:] = [0, 0, HEIGHT + 0.027, 1, 0, 0, 0, *standing]
    data.ctrl[:] = standing
    late, hold, every = round(latency / STEP), round(1 / POLICY / STEP), round(1 / rate / STEP)
    sent, rows = [standing], []
    for k in range(round((START + seconds) / STEP)):
        if k % hold == 0:
            sent.append(policy(k * STEP, data.qpos, data.qvel))
        if ramps:
            data.ctrl[:] = sent[-2] + (sent[-1] - sent[-2]) * (k % hold) / hold
        elif k % hold == late:
            data.ctrl[:] = sent[-1]
        state = np.concatenate([data.qpos, data.qvel, sent[-1]])
        mujoco.mj_step(model, data)  # whose sensors are of the step's begin
        if k % every == 0 and k * STEP >= START:
            rows.append(np.concatenate([state, data.sensordata, data.actuator_force]))
    pose, position, _, velocity, command, turning, acceleration, force, torque = np.split(
        np.array(rows), np.cumsum([7, 12, 6, 12, 12, 3, 3, 4]), axis=1
    )
    normal = generator.standard_normal
    sent_or_measured = {"torque": torque + 0.08 * normal(torque.shape)} if ramps else {"desired_position": command}
    log = {
        "time": np.arange(len(rows)) / rate,
        "position": position + 1.5e-4 * normal(position.shape),
        "velocity": velocity + 0.02 * normal(velocity.shape),
        "base_orientation": pose[:, [4, 5, 6, 3]],
        "angular_velocity": turning + 3e-3 * normal(turning.shape),
        "linear_acceleration": acceleration + 0.05 * normal(acceleration.shape),
        "foot_names": np.array(LEGS),
        "contact": (force + noise * normal(force.shape) > threshold).astype(float),
        **sent_or_measured,
    }
    return log, drives
