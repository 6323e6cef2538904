"""Exported models equal the corrected robot in Pinocchio and MuJoCo; links share corrections and stay possible."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from tests.exporters.found import FRICTION, found_in, robot_of

from stribeck import Robot, export
from stribeck.app.exporters.links import possible, share
from stribeck.core.robot.inertial_parameters import pseudo_inertia

STEP = 2e-4
"""Of simulations [s]."""

URDFS = ["arm", "biped", "quadruped", "talos", "g1", "go2", "panda", "kinova", "ur5", "cassie"]


def read_again(robot: Robot, model: Path) -> Robot:
    """Return the robot that the same robot file describes with another model file."""
    lines = Path(robot.path).read_text().splitlines()
    lines = [f'model = "{model}"' if line.startswith("model =") else line for line in lines]
    path = model.with_suffix(".toml")
    path.write_text("\n".join(lines))
    return Robot.from_file(path)


def assert_same_dynamics(one: Robot, other: Robot, tolerance: float = 1e-9) -> None:
    """Compare inertia matrices and bias torques at some states."""
    model = one.tree.model
    for seed in range(5):
        generator = np.random.default_rng(seed)
        position = pin.integrate(model, pin.neutral(model), generator.normal(size=model.nv))
        velocity = generator.normal(size=model.nv)
        terms = []
        for robot in (one, other):
            data = robot.tree.model.createData()
            matrix = np.triu(pin.crba(robot.tree.model, data, position))
            terms.append((matrix, pin.rnea(robot.tree.model, data, position, velocity, np.zeros(model.nv))))
        for a, b in zip(*terms, strict=True):
            np.testing.assert_allclose(a, b, atol=tolerance * np.abs(a).max(), rtol=0)


def assert_possible(body: pin.Inertia) -> None:
    """Check that a rigid body can have this inertia."""
    moments = np.linalg.eigvalsh(body.inertia)
    assert body.mass > 0
    assert moments[0] > 0
    assert moments[2] <= moments[:2].sum() * (1 + 1e-9)


def compiled(path: Path) -> mujoco.MjModel:
    """Return what MuJoCo makes of a file, without meshes, whose packages are not here, and with room to move."""
    spec = mujoco.MjSpec.from_file(str(path))
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    spec.option.gravity[:] = 0.0
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return spec.compile()


@pytest.mark.parametrize(("name", "target"), [("toro", "mjcf"), *((name, "urdf") for name in [*URDFS, "icub"])])
def test_exported_models_are_the_corrected_robot_with_possible_bodies(name, target, tmp_path):
    """iCub's own model has bodies that cannot; they are named, and become the nearest that can."""
    robot, _ = robot_of(name, tmp_path)
    result, corrected = found_in(robot, seed=1)
    path = tmp_path / "new" / f"{name}.xml"
    lines = export(result, robot, path, target, inertia=True)
    again = read_again(robot, path)
    assert again.joint_names == robot.joint_names
    assert name == "icub" or len(again.warnings) == len(robot.warnings)
    impossible = [line for line in lines if line.startswith("Physically impossible estimate")]
    assert_same_dynamics(corrected, again, 1e-4 if impossible else 1e-9)
    for joint in result.corrections.bodies:
        assert_possible(again.tree.model.inertias[again.tree.model.getJointId(joint)])
    assert bool(impossible) == (name == "icub")
    assert not impossible or "neck_roll" in impossible[0]


@pytest.mark.parametrize("name", URDFS)
def test_a_urdf_that_becomes_an_mjcf_is_the_same_robot(name: str, tmp_path: Path) -> None:
    robot, _ = robot_of(name, tmp_path)
    result, corrected = found_in(robot)
    path = tmp_path / f"{name}.xml"
    export(result, robot, path, "mjcf", inertia=True)
    again = read_again(robot, path)  # which compares MuJoCo's inertia matrix with Pinocchio's
    assert again.joint_names == robot.joint_names
    assert_same_dynamics(corrected, again)
    model, ours = mujoco.MjModel.from_xml_path(str(path)), corrected.tree.model
    assert model.body_mass.sum() == pytest.approx(sum(body.mass for body in ours.inertias), rel=1e-9)
    for name in robot.joint_names:
        at, own = ours.joints[ours.getJointId(name)], model.joint(name)
        assert model.dof_frictionloss[own.dofadr[0]] == FRICTION["coulomb"][0]
        assert model.dof_damping.reshape(model.nv, -1)[own.dofadr[0], 0] == FRICTION["viscous"][0]
        limits = ours.lowerPositionLimit[at.idx_q], ours.upperPositionLimit[at.idx_q]
        if own.limited[0]:
            np.testing.assert_allclose(own.range, limits, rtol=1e-12)
        else:
            assert at.nq == 2 or np.isinf(limits).all()


def some_links(count: int, seed: int) -> np.ndarray:
    pin.seed(seed)
    sizes = np.random.default_rng(seed).uniform(0.05, 0.4, (count, 4))
    return np.stack(
        [pseudo_inertia(pin.SE3.Random().act(pin.Inertia.FromEllipsoid(*size)).toDynamicParameters()) for size in sizes]
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("count", [1, 2, 7])
def test_links_sum_up_to_the_estimate_and_are_possible(count: int, seed: int) -> None:
    links = some_links(count, seed)
    found = some_links(1, seed + 50)[0]
    shared = share(links, found)
    np.testing.assert_allclose(shared.sum(axis=0), found, atol=1e-12 * np.abs(found).max())
    assert np.linalg.eigvalsh(shared).min() > 0


def test_no_correction_changes_nothing_and_frames_do_not_matter() -> None:
    links, found = some_links(3, 2), some_links(1, 3)[0]
    np.testing.assert_allclose(share(links, links.sum(axis=0)), links, atol=1e-12)
    one = links[0]
    assert possible(one) is one
    pose = pin.SE3.Random().homogeneous
    moved = share(pose @ links @ pose.T, pose @ found @ pose.T)
    np.testing.assert_allclose(moved, pose @ share(links, found) @ pose.T, atol=1e-10)


def test_an_empty_link_and_a_sensor_stay_and_an_impossible_link_becomes_possible() -> None:
    links, found = some_links(3, 4), some_links(1, 5)[0]
    links[0] = 0.0
    links[1, 2, 2] -= 1.0
    shared = share(links, found)
    assert not shared[0].any()
    assert np.linalg.eigvalsh(shared[1:]).min() > 0
    links = some_links(3, 7)
    links[1] *= 1e-3
    found = 1.1 * links.sum(axis=0)
    shared = share(links, found)
    np.testing.assert_array_equal(shared[1], links[1])
    np.testing.assert_allclose(shared.sum(axis=0), found, atol=1e-12 * np.abs(found).max())
