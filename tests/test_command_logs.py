"""Logs of position commands have the friction and the latency that their ground truth states."""

import numpy as np
import pytest
from tests.commanded import ARM, QUADRUPED, STEP, acting, arm_drives, leg_drives, logged, multisine

from stribeck import Robot
from stribeck.dynamics.rooted import rooted_inverse_dynamics

POLICY = 50.0  # [Hz]


@pytest.mark.parametrize(
    ("path", "drives"), [(ARM, arm_drives(1, 0.012)), (QUADRUPED, leg_drives(1, 0.006))], ids=["arm", "quadruped"]
)
def test_torques_of_late_commands_move_links_and_rotors_and_overcome_friction(path, drives):
    center = (0.0, -0.3, 0.6, 0.3, 0.0, 0.4) if path == ARM else (0.0, 0.8, -1.6) * 4
    command = multisine(np.random.default_rng(0), np.arange(40) / POLICY, center, (0.5,) * len(drives), (0.5, 1.0))
    log = logged(path, command, drives, POLICY, 1 / STEP)
    names = ("kp", "kd", "coulomb", "viscous", "armature")
    kp, kd, coulomb, viscous, armature = np.array([[getattr(one, name) for one in drives.values()] for name in names])
    q = log["position"]
    v, a = np.gradient(q, STEP, axis=0), np.zeros_like(q)
    a[1:-1] = np.diff(q, 2, axis=0) / STEP**2
    torque = kp * (acting(command, drives, 1 / POLICY, len(q)) - q) - kd * v
    robot = Robot.from_model(path, base="fixed")
    rigid = rooted_inverse_dynamics(robot.tree, q, v, a)[1] + armature * a
    moving = (np.abs(v) > 0.2) & (a != 0)  # without the ends
    left = torque - rigid - viscous * v - coulomb * np.sign(v)
    for k, joint in enumerate(drives):
        assert np.sqrt(np.mean(left[moving[:, k], k] ** 2)) < 0.05 * coulomb[k], joint
