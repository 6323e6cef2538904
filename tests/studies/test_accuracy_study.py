"""The accuracy study: its robots have friction in all leg joints, and its numbers are what they are called."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from studies.accuracy import SPEEDS, compared
from studies.accuracy_cases import CASES, NAMES, ROBOTS, as_walked, measured, walk_scenario, wrong_model
from studies.accuracy_table import Run, deviations, in_order, read_runs, summary, table, write_runs
from studies.walking_cases import WALKERS

from stribeck import Robot, Settings, identify
from stribeck.friction import get_law
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots.biped import MODELS
from stribeck_simulation.run import Simulated, friction_of


def a_run(seed: int, errors: list[float], robot: str = "TORO-like", case: str = "A") -> Run:
    """A run of two joints whose every parameter is off by the same."""
    each = dict.fromkeys(NAMES, errors)
    return Run(
        robot=robot,
        case=case,
        method="whole-log, law known",
        seed=seed,
        seconds=0.1,
        chi_square=1.0,
        joints=["knee", "hip"],
        relative=[abs(error) for error in errors],
        shape=[0.01, 0.02],
        error=each,
        standard_error={name: [0.1, 0.1] for name in NAMES},
        held={name: [1, 0] for name in NAMES},
        weak={name: [0, 0] for name in NAMES},
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot_has_friction_in_its_twelve_leg_joints_and_bodies_that_may_be_wrong(name: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(WALKERS[ROBOTS[name].walker].robot_file, encoding="utf-8")
        robot = Robot.from_file(path)
    for steps in ROBOTS[name].walks.values():
        truth = friction_of(walk_scenario(ROBOTS[name], steps, "robot.toml"), robot).parameters
        assert len(truth) == 12
        assert all(set(found) == set(NAMES) for found in truth.values())
        seconds = steps.count * (steps.single_support + steps.double_support)
        assert seconds == pytest.approx(44.0, abs=0.5)
    model, wrong = robot.tree.model, wrong_model(robot, 0).tree.model
    masses = np.array([[body.mass for body in each.inertias] for each in (model, wrong)])[:, 1:]
    assert np.all(np.abs(masses[1] / masses[0] - 1) < 0.05)
    assert np.ptp(masses[1] / masses[0]) > 0.05


def test_means_are_over_joints_then_seeds() -> None:
    row = summary([a_run(0, [0.1, -0.3]), a_run(1, [0.0, 0.1])])
    assert row["coulomb"] == pytest.approx((0.2 + 0.05) / 2)
    assert row["coulomb_worst"] == pytest.approx((0.3 + 0.1) / 2)
    assert summary([a_run(0, [0.1, -0.3]), a_run(1, [0.4, 0.1])])["coulomb_worst_joint"] == pytest.approx(0.25)
    assert row["offset"] == pytest.approx((0.2 + 0.05) / 2)
    assert (row["coulomb_covered"], row["weak"], row["joints"]) == (0.5, 0.0, 2)


def test_deviations_are_errors_over_standard_errors() -> None:
    (row,) = deviations([a_run(0, [0.1, -0.3]), a_run(1, [0.1, 0.1])])
    assert row.count(f"{np.sqrt((1 + 9 + 1 + 1) / 4):.2f}") == len(NAMES)


def test_runs_are_kept_as_they_are_and_in_the_order_of_the_table(tmp_path: Path) -> None:
    runs = [a_run(1, [0.1, 0.2]), a_run(0, [0.3, 0.4]), a_run(0, [0.5, 0.6], case="clean"), a_run(0, [0, 0], "G1")]
    runs = runs[::-1]
    write_runs(tmp_path / "runs.json", {(one["robot"], one["case"], one["method"], one["seed"]): one for one in runs})
    found = in_order(read_runs(tmp_path / "runs.json"))
    assert found == [runs[1], runs[2], runs[3], runs[0]]
    assert [row.split(" | ")[:2] for row in table(found)] == [
        ["| TORO-like", "clean"],
        ["| TORO-like", "A"],
        ["| G1", "A"],
    ]


def test_a_result_is_compared_with_the_truth_joint_by_joint() -> None:
    robot, law = Robot.from_file(MODELS / "arm.toml"), get_law("stribeck")
    values = [0.3, 1.2, 0.3, 0.15, 0.2, 50.0]
    truth = {joint: dict(zip(NAMES, values, strict=True)) for joint in robot.joint_names}
    log, _ = exact_log(robot, law, truth, duration=16.0, seed=1)
    noisy = measured(log, CASES["A"], 0, 0)
    speeds = {joint: np.linspace(-1, 1, SPEEDS) for joint in robot.joint_names}
    found = compared(("TORO-like", "A", "curve-fit", 0), identify(noisy, robot, Settings()), truth, speeds, 0.1)
    assert found["joints"] == list(truth)
    assert max(found["relative"]) < 0.1
    assert 0 < max(found["shape"]) < 0.1
    np.testing.assert_allclose(np.abs(found["error"]["coulomb"]) / 1.2, found["relative"], rtol=1e-3)


def test_friction_that_differs_is_that_of_the_torques() -> None:
    robot, law = Robot.from_file(MODELS / "arm.toml"), get_law("stribeck")
    values = [0.3, 1.2, 0.3, 0.15, 0.2, 50.0]
    truth = {joint: dict(zip(NAMES, values, strict=True)) for joint in robot.joint_names}
    walk = Simulated(robot, *exact_log(robot, law, truth, duration=16.0, seed=1))
    (other,) = as_walked([walk], CASES["A, joints differ"], 0)
    assert len({each["coulomb"] for each in other.truth.parameters.values()}) == len(truth)
    found = identify(other.log, robot, Settings()).joints
    for joint, known in other.truth.parameters.items():
        assert found[joint].parameters["coulomb"].value == pytest.approx(known["coulomb"], rel=0.05)
        assert found[joint].parameters["viscous"].value == pytest.approx(known["viscous"], rel=0.05)
    (again,) = as_walked([walk], CASES["A, joints differ"], 0)
    np.testing.assert_array_equal(again.log.torque, other.log.torque)


def test_a_share_of_a_walk_is_its_beginning() -> None:
    robot, law = Robot.from_file(MODELS / "arm.toml"), get_law("stribeck")
    walk = Simulated(robot, *exact_log(robot, law, {}, duration=3.0, seed=1))
    (short,) = as_walked([walk], CASES["A, 45 s in all"], 0)
    np.testing.assert_array_equal(short.log.torque, walk.log.torque[:1000])
