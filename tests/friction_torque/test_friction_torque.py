"""Friction torque of a log by support, and the choice of the filter."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation
from tests.arm import arm_log, write_arm
from tests.loops import joint, link
from tests.models import example_log, example_robot

from stribeck import Robot, Settings, identify
from stribeck.core.equations.friction_torque.inverse_dynamics import Chunk, torque_chunks
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings
from stribeck.paper.filters.auto import cutoff_from_log
from stribeck.simulation.prescribed.exact import Truth

EXACT = FilterSettings(kind="log")


def chunks(name: str, log: RobotLog, **settings: object) -> list[Chunk]:
    robot = example_robot(name)
    chosen = Settings.model_validate({"filter": EXACT, **settings})
    return list(torque_chunks(prepare(log, robot, chosen), robot, chosen))


def by_support(found: list[Chunk], truth: Truth, name: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Compute found and true friction torque per support."""
    robot = example_robot(name)
    joined: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    (chunk,) = found
    for k, support in enumerate(chunk.samples.support_names):
        rows = chunk.samples.support == k
        true = truth.friction_torque[chunk.rows[rows]][:, robot.torque_controlled]
        joined[support] = (chunk.samples.friction_torque[rows], true)
    return joined


def test_single_support_determines_all_joints_and_double_support_the_free_ones() -> None:
    log, truth = example_log("talos")
    robot = example_robot("talos")
    found = by_support(chunks("talos", log), truth, "talos")
    assert set(found) == {"left", "right", "left+right"}
    for foot in ("left", "right"):
        np.testing.assert_allclose(*found[foot], atol=1e-8)
    measured, true = found["left+right"]
    standing = robot.standing(("left", "right"))[robot.torque_controlled]
    assert standing.sum() == 12
    assert np.all(np.isnan(measured[:, standing]))
    np.testing.assert_allclose(measured[:, ~standing], true[:, ~standing], atol=1e-8)


def test_fits_use_only_swinging_limbs_by_default() -> None:
    log, _ = example_log("talos")
    robot = example_robot("talos")
    for standing_legs in (False, True):
        (chunk,) = chunks("talos", log, standing_legs=standing_legs)
        rows = chunk.samples.support == chunk.samples.support_names.index("left")
        usable = chunk.samples.usable[rows]
        stance, swing = (robot.standing((foot,))[robot.torque_controlled] for foot in ("left", "right"))
        calm = usable[:, ~stance & ~swing].all(axis=1)  # the standing foot has come to rest
        assert 0.5 < calm.mean() < 1.0
        assert np.all(usable[:, swing])
        assert not usable[~calm][:, ~swing].any()
        assert np.all(usable[calm][:, stance] == standing_legs)


@pytest.mark.parametrize("frame", ["base_link", "torso_2_link"])
def test_the_tilt_comes_from_whatever_frame_the_imu_is_in(frame: str) -> None:
    robot = example_robot("talos")
    log, truth = example_log("talos")
    moved = replace(robot, base_frame=frame)
    model, data = robot.tree.model, robot.tree.model.createData()
    turned = np.empty_like(log.base_orientation)
    for k, position in enumerate(log.position):
        configuration = pin.neutral(model)
        configuration[7:] = position[robot.tree.columns]
        pin.framesForwardKinematics(model, data, configuration)
        relative = Rotation.from_matrix(data.oMf[model.getFrameId(frame)].rotation)
        turned[k] = (Rotation.from_quat(log.base_orientation[k]) * relative).as_quat()
    settings = Settings(filter=EXACT)
    prepared = prepare(replace(log, base_orientation=turned), moved, settings)
    (chunk,) = torque_chunks(prepared, moved, settings)
    single = chunk.samples.support == chunk.samples.support_names.index("left")
    true = truth.friction_torque[chunk.rows[single]][:, robot.torque_controlled]
    np.testing.assert_allclose(chunk.samples.friction_torque[single], true, atol=1e-7)


def test_a_flat_foot_needs_no_orientation() -> None:
    log, truth = example_log("talos")
    found = by_support(chunks("talos", log, tilt="flat"), truth, "talos")
    np.testing.assert_allclose(*found["left"], atol=1e-8)
    blind = replace(log, base_orientation=None)
    found = by_support(chunks("talos", blind), truth, "talos")
    np.testing.assert_allclose(*found["left"], atol=1e-8)
    with pytest.raises(LogError, match="base_orientation"):
        chunks("talos", blind, tilt="imu")


def test_point_feet_determine_only_the_swinging_leg() -> None:
    log, truth = example_log("go2", 6.0)
    robot = example_robot("go2")
    for support, (measured, true) in by_support(chunks("go2", log), truth, "go2").items():
        standing = robot.standing(tuple(support.split("+")))
        assert np.all(np.isnan(measured[:, standing]))
        np.testing.assert_allclose(measured[:, ~standing], true[:, ~standing], atol=1e-8)
    with pytest.raises(LogError, match="point feet"):
        chunks("go2", replace(log, base_orientation=None))


def test_the_table_has_the_velocities_of_the_log_and_the_ground_reaction_that_the_sensor_felt(tmp_path: Path) -> None:
    log, _ = example_log("talos", 8.0)
    settings = Settings(method="curve-fit", filter=EXACT, law="coulomb-viscous")
    identify(log, example_robot("talos"), settings, table=tmp_path / "f.parquet")
    table = pq.read_table(tmp_path / "f.parquet")
    left = np.flatnonzero(np.array(table["support"].to_pylist()) == "left")
    rows = np.searchsorted(log.time, table["time"].to_numpy()[left] - 1e-9)
    velocity, force = (table[name].to_numpy()[left] for name in ("velocity.leg_left_4_joint", "ground_reaction.fz"))
    knee = log.joint_names.index("leg_left_4_joint")
    np.testing.assert_allclose(velocity, log.velocity[rows, knee], atol=1e-6)
    np.testing.assert_allclose(force, log.foot_wrench[rows, log.foot_names.index("left"), 2], rtol=1e-5)


@pytest.mark.parametrize("landed", ["left", "right"])
def test_a_foot_that_has_just_landed_is_not_the_root(landed: str) -> None:
    """Its ankle still moves; the arms are computed from the foot that stood before."""
    log, truth = example_log("talos")
    robot = example_robot("talos")
    landing = np.flatnonzero(np.diff(log.contact[:, log.foot_names.index(landed)].astype(int)) > 0)
    moved = log.position.copy()
    ankle = robot.joint_names.index(f"leg_{landed}_5_joint")
    for row in landing:
        moved[row : row + 150, ankle] += 0.05
    settings = Settings(filter=EXACT, tilt="flat")
    (chunk,) = torque_chunks(prepare(replace(log, position=moved), robot, settings), robot, settings)
    double = chunk.samples.support == chunk.samples.support_names.index("left+right")
    after = np.isin(chunk.rows, (landing[:, None] + np.arange(1, 150)).ravel())
    rows = double & after
    assert rows.sum() > 100
    arms = ~robot.standing(("left", "right"))[robot.torque_controlled]
    true = truth.friction_torque[chunk.rows[rows]][:, robot.torque_controlled][:, arms]
    np.testing.assert_allclose(chunk.samples.friction_torque[rows][:, arms], true, atol=1e-8)


COAXIAL = (
    '<robot name="coaxial"><link name="base"/><link name="empty"/>'
    + joint("first", "base", "empty", "0 0 1", "0 0 0")
    + link("body", 2.0, "0.1 0 0.1")
    + joint("second", "empty", "body", "0 0 1", "0 0 0.1")
    + link("hand", 1.0, "0.1 0 0.1")
    + joint("third", "body", "hand", "0 1 0", "0 0 0.3")
    + "</robot>"
)


def test_joints_about_one_axis_with_nothing_between_them_choose_no_filter(tmp_path: Path) -> None:
    (tmp_path / "model.urdf").write_text(COAXIAL)
    (tmp_path / "robot.toml").write_text('[robot]\nmodel = "model.urdf"\nbase = "fixed"\n')
    robot = Robot.from_file(tmp_path / "robot.toml")
    prepared = prepare(arm_log(robot, duration=4.0), robot, robot.settings)
    choice = cutoff_from_log(prepared, robot, robot.settings)
    assert np.isfinite(choice.cutoff)


def test_contact_flags_that_are_missing_at_first_choose_the_filter_of_the_rest(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path))
    prepared = prepare(arm_log(robot, duration=40.0), robot, robot.settings)
    (phase,) = prepared.support.phases
    rest = replace(phase, start=35_000, first=35_000, steady_first=35_000)
    hung = replace(phase, kind="flight", feet=(), stop=35_000, last=35_000, steady_last=35_000)
    chosen = [
        cutoff_from_log(replace(prepared, support=replace(prepared.support, phases=phases)), robot, robot.settings)
        for phases in ((hung, rest), (rest,))
    ]
    assert chosen[0].cutoff == chosen[1].cutoff
