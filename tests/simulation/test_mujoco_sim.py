"""The contact simulator and its humanoids, compared with Pinocchio, their tables and the laws of mechanics."""

from collections.abc import Callable

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from studies.walking_cases import WALKERS, robot_of
from tests.models import leg_friction

from stribeck.core.base.typing import Array
from stribeck.simulation.friction import FrictionTruth
from stribeck.simulation.mujoco.model import compile_body
from stribeck.simulation.mujoco.simulator import MujocoSim, foot_wrenches
from stribeck.simulation.robots import MODELS, TORO_MODEL
from stribeck.simulation.robots.toro import toro_links, toro_mjcf
from stribeck.simulation.walking.balance.terms import Dynamics
from stribeck.simulation.walking.start import start_standing


def as_mujoco_has_it(sim: MujocoSim) -> tuple[Array, Array]:
    """The state now with positions half a step ahead of velocities."""
    now, ahead = sim.now(), 0.5 * float(sim.body.model.opt.timestep)
    configuration, velocity = now.configuration, now.velocity
    turn = pin.Quaternion(configuration[3:7])
    linear = turn.toRotationMatrix() @ velocity[:3]
    turn = turn * pin.Quaternion(pin.exp3(ahead * velocity[3:6]))
    configuration[:3] += ahead * linear
    configuration[3:7] = turn.coeffs()
    configuration[7:] += ahead * velocity[6:]
    velocity[:3] = turn.toRotationMatrix().T @ linear
    return configuration, velocity


@pytest.mark.parametrize("name", WALKERS)
def test_both_engines_have_one_equation_of_motion(name: str) -> None:
    robot = robot_of(name)
    body = compile_body(robot, WALKERS[name].soles)
    model, data = robot.tree.model, robot.tree.model.createData()
    generator = np.random.default_rng(1)
    q = pin.neutral(model)
    q[:3] = generator.normal(size=3)
    q[3:7] = generator.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] = generator.uniform(-0.5, 0.5, model.nq - 7)
    sim = MujocoSim(body, FrictionTruth(model.nq - 7), q)
    v = 0.3 * generator.normal(size=model.nv)
    rotation = pin.Quaternion(q[3:7]).toRotationMatrix()
    sim.data.qvel[:3], sim.data.qvel[3:6], sim.data.qvel[body.velocity_index] = rotation @ v[:3], v[3:6], v[6:]
    configuration, velocity = as_mujoco_has_it(sim)
    np.testing.assert_allclose(configuration, q, atol=1e-12)
    np.testing.assert_allclose(velocity, v, atol=1e-12)
    # With MuJoCo's world-frame acceleration of the base, J a + J' v turns one into the other.
    a = generator.normal(size=model.nv)
    sim.data.qacc[:3] = rotation @ (a[:3] + np.cross(v[3:6], v[:3]))
    sim.data.qacc[3:6], sim.data.qacc[body.velocity_index] = a[3:6], a[6:]
    acceleration = sim.data.qacc.copy()
    body.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    mujoco.mj_forward(body.model, sim.data)
    sim.data.qacc[:] = acceleration
    mujoco.mj_inverse(body.model, sim.data)
    force = pin.rnea(model, data, q, v, a)
    np.testing.assert_allclose(rotation.T @ sim.data.qfrc_inverse[:3], force[:3], atol=1e-9)
    np.testing.assert_allclose(sim.data.qfrc_inverse[3:6], force[3:6], atol=1e-9)
    np.testing.assert_allclose(sim.data.qfrc_inverse[body.velocity_index], force[6:], atol=1e-9)


def as_pinocchio_has_them(
    sim: MujocoSim, configuration: Array, velocity: Array, acceleration: Array
) -> tuple[Array, Array]:
    """Velocity and acceleration, in MuJoCo's coordinates, in those of Pinocchio."""
    turn = pin.Quaternion(configuration[3:7]).toRotationMatrix()
    joints = sim.body.velocity_index
    v = np.concatenate([turn.T @ velocity[:3], velocity[3:6], velocity[joints]])
    a = np.concatenate([turn.T @ acceleration[:3] - np.cross(v[3:6], v[:3]), acceleration[3:6], acceleration[joints]])
    return v, a


def test_ground_gravity_and_friction_are_all_that_acts() -> None:
    """The foot wrenches, the torques and R give the acceleration that the simulator has, joint by joint.

    Coriolis and centrifugal torques are those of the velocity that the last change foresees for a step's middle.
    """
    robot = robot_of("TORO-like")
    body = compile_body(robot)
    dynamics = Dynamics(robot, body.soles)
    start = start_standing(robot, dynamics, WALKERS["TORO-like"].posture)
    sim = MujocoSim(body, leg_friction(robot, 1.0), start.configuration, period=body.model.opt.timestep)
    generator = np.random.default_rng(2)
    model, data = dynamics.model, dynamics.data
    step, change = sim.period, np.zeros(model.nv)
    for _ in range(100):
        before, _ = as_mujoco_has_it(sim)
        velocity = sim.data.qvel.copy()
        torque, touch, _ = sim.advance(3 * generator.normal(size=model.nv - 6))
        wrenches = foot_wrenches(sim.body, touch)
        resisting = sim.now().friction_torque
        middle, change = velocity + 0.5 * change, sim.data.qvel - velocity
        v, a = as_pinocchio_has_them(sim, before, middle, change / step)
        force = pin.rnea(model, data, before, v, a)
        force[6:] += resisting - torque
        for name, wrench in zip(robot.contacts, wrenches, strict=True):
            frame = model.getFrameId(robot.contacts[name].frame)
            jacobian = pin.computeFrameJacobian(model, data, before, frame, pin.LOCAL)
            force -= jacobian.T @ wrench
        np.testing.assert_allclose(force, 0.0, atol=1e-8)
    assert np.abs(resisting).max() > 0.5


def free_leg(step: float, control_period: float) -> tuple[MujocoSim, int]:
    """A robot that falls freely, and the number of a knee."""
    robot = robot_of("TORO-like")
    names = list(robot.tree.model.names)[2:]
    start = pin.neutral(robot.tree.model)
    start[2] = 100.0
    start[7:] = [WALKERS["TORO-like"].posture.get(name, 0.0) for name in names]
    sim = MujocoSim(compile_body(robot, step=step), leg_friction(robot, 1.0), start, control_period)
    return sim, names.index("left_knee")


def test_positions_and_velocities_are_of_one_instant() -> None:
    """The velocity is the slope of the positions to second order, joints and base alike."""
    sim, knee = free_leg(0.00025, 1e-3)
    snapshots = []
    for k in range(300):
        torque = np.zeros(27)
        torque[knee] = 10.0 * np.sin(2 * np.pi * 3 * k * 1e-3)
        sim.advance(torque)
        snapshots.append(sim.now())
    configuration = np.array([now.configuration for now in snapshots])
    velocity = np.array([now.velocity for now in snapshots])
    slope = (configuration[2:] - configuration[:-2]) / 2e-3
    assert np.abs(velocity[:, 6 + knee]).max() > 1.0
    np.testing.assert_allclose(slope[:, 7:], velocity[1:-1, 6:], atol=2e-3)
    turns = Rotation.from_quat(configuration[:, 3:7])
    np.testing.assert_allclose(slope[:, :3], turns[1:-1].apply(velocity[1:-1, :3]), atol=2e-3)
    spin = (turns[:-2].inv() * turns[2:]).as_rotvec() / 2e-3
    np.testing.assert_allclose(spin, velocity[1:-1, 3:6], atol=2e-3)


def test_the_packaged_file_is_made_of_the_table() -> None:
    assert TORO_MODEL.read_text(encoding="utf-8") == toro_mjcf()
    compiled = mujoco.MjModel.from_xml_path(str(TORO_MODEL))
    for link in toro_links():
        effort = link.drive.effort
        np.testing.assert_allclose(compiled.jnt_actfrcrange[compiled.joint(link.name).id], (-effort, effort))
        np.testing.assert_allclose(compiled.joint(link.name).range, np.radians(link.range), atol=1e-5)


def biped() -> tuple[pin.Model, set[str]]:
    """Return a biped with a fixed base, and the joints whose axis goes from side to side."""
    model = pin.buildModelFromUrdf(str(MODELS / "biped.urdf"))
    names = list(model.names)[1:]
    return model, {name for name in names if any(word in name for word in ("pitch", "knee", "elbow"))}


def toro() -> tuple[pin.Model, set[str]]:
    floating = pin.buildModelFromMJCF(str(TORO_MODEL))
    model = pin.buildReducedModel(floating, [1], pin.neutral(floating))
    return model, {link.name for link in toro_links() if link.axis[1] != 0}


@pytest.mark.parametrize("make", [biped, toro])
def test_sides_are_mirror_images(make: Callable[[], tuple[pin.Model, set[str]]]):
    """Torques of the mirrored motion are the mirrored torques: sides change places, roll and yaw change sign."""
    model, across = make()
    names = list(model.names)[1:]
    other = [name.replace("left", "#").replace("right", "left").replace("#", "right") for name in names]
    place = [names.index(name) for name in other]
    sign = np.array([1.0 if name in across else -1.0 for name in names])
    generator = np.random.default_rng(0)
    for _ in range(5):
        motion = generator.uniform(-1, 1, (3, model.nv))
        torque = pin.rnea(model, model.createData(), *motion)
        mirrored = pin.rnea(model, model.createData(), *(sign * motion[:, place]))
        tolerance = 1e-12 if make is biped else 1e-4  # toro.xml has six digits
        np.testing.assert_allclose(mirrored, sign * torque[place], atol=tolerance)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    np.testing.assert_array_equal(np.where(sign > 0, low, -high)[place], low)
