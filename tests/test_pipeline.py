"""Identification of an arm: known parameters are recovered, however the log is split or stored."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import TRUTH, arm_log, save_npz, stribeck_torque, write_arm

import stribeck.core.equations.friction_torque.inverse_dynamics
from stribeck import Robot, Settings, identify, inspect_log, plan, read_log, read_result, write_report
from stribeck.core.errors import LogError, SettingsError
from stribeck.core.settings import FilterSettings, LogTable
from stribeck.design.replaying.replay import replay


def test_two_logs_give_the_result_of_one_long_log(arm: Robot) -> None:
    first, second = arm_log(arm, seed=1), arm_log(arm, seed=2)
    both = identify([first, second], arm, method="curve-fit")
    used = [identify(log, arm, method="curve-fit").log.samples_used for log in (first, second)]
    assert both.log.samples_used == sum(used)
    assert both.joints["shoulder"].parameters["coulomb"].value == pytest.approx(TRUTH["coulomb"], rel=0.01)
    assert len(np.unique(both.evidence.samples.block)) == 40


def test_the_order_of_logs_does_not_matter(arm: Robot) -> None:
    whole = arm_log(arm, duration=6.0, rate=250.0)
    halves = whole.take(slice(750)), whole.take(slice(750, None))
    found, other = (identify(logs, arm, Settings(law="coulomb-viscous")) for logs in (halves, halves[::-1]))
    for name, joint in found.joints.items():
        assert joint.parameters == other.joints[name].parameters


def test_chunks_do_not_show(arm: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    log = replace(arm_log(arm, duration=8), velocity=None, acceleration=None)
    settings = Settings(method="curve-fit", filter=FilterSettings(kind="savitzky-golay", window=31), filter_torque=True)
    whole = identify(log, arm, settings)
    monkeypatch.setattr(stribeck.core.equations.friction_torque.inverse_dynamics, "CHUNK", 997)
    pieces = identify(log, arm, settings)
    friction = [each.evidence.samples.friction_torque for each in (pieces, whole)]
    np.testing.assert_allclose(*friction, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(pieces.evidence.samples.block, whole.evidence.samples.block)


def test_what_is_kept_is_bounded_and_changes_little(arm: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    log = arm_log(arm)
    everything = identify(log, arm, method="curve-fit")
    monkeypatch.setattr(stribeck.core.equations.friction_torque.stage, "MOST_KEPT", 4000)
    some = identify(log, arm, method="curve-fit")
    assert len(some.evidence.samples.time) <= 4000
    assert some.log.samples_used == pytest.approx(everything.log.samples_used, rel=1e-3)
    for joint, found in some.joints.items():
        for name, parameter in found.parameters.items():
            assert parameter.value == pytest.approx(everything.joints[joint].parameters[name].value, rel=0.005)


def test_gaps_are_not_filtered_across(arm: Robot) -> None:
    log = arm_log(arm)
    keep = np.ones(len(log.time), dtype=bool)
    keep[5000:5400] = keep[12_000:12_003] = False
    cut = identify(replace(log.take(keep), velocity=None, acceleration=None), arm, method="curve-fit")
    assert any("gap" in note for note in cut.evidence.notes)
    assert cut.joints["shoulder"].parameters["coulomb"].value == pytest.approx(TRUTH["coulomb"], rel=0.01)
    assert cut.joints["shoulder"].residual_rms < 0.01


def test_the_rotor_inertia_comes_back_and_the_models_is_counted_in(arm: Robot) -> None:
    log = arm_log(arm)
    heavier = replace(log, torque=log.torque + 0.05 * log.acceleration)
    settings = Settings(method="curve-fit", fit_armature=["shoulder"], filter=FilterSettings(kind="log"))
    result = identify(heavier, arm, settings)
    assert result.joints["shoulder"].parameters["armature"].value == pytest.approx(0.05, rel=1e-4)
    assert "armature" not in result.joints["elbow"].parameters
    known = Robot.from_file(write_arm(Path(arm.path).parent, "[robot.armature]\nshoulder = 0.03\n"))
    total = identify(heavier, known, settings).joints["shoulder"].parameters["armature"]
    assert total.value == pytest.approx(0.05, rel=1e-4)
    assert total.interval_95[0] <= total.value <= total.interval_95[1]
    shown = result.evidence.samples
    column = shown.joint_names.index("shoulder")
    np.testing.assert_allclose(shown.friction_torque[:, column], stribeck_torque(shown.velocity[:, column]), atol=1e-4)


def test_a_log_given_twice_is_refused(arm: Robot, tmp_path: Path) -> None:
    path = save_npz(arm_log(arm, duration=6), tmp_path / "log.npz")
    with pytest.raises(LogError, match=rf"{path}: 100 % of its samples are also in {path}"):
        identify([path, path], arm)


def test_a_log_read_without_the_robot_is_refused_where_its_settings_matter(tmp_path: Path) -> None:
    robot = Robot.from_file(write_arm(tmp_path, "\n[log]\ntorque = { scale = -1.0 }\n"))
    log, path = arm_log(robot, duration=12), tmp_path / "log.npz"
    save_npz(replace(log, torque=-log.torque), path)
    result = identify(path, robot, method="curve-fit")
    assert all(joint.verdict == "identified" for joint in result.joints.values())
    raw = read_log(path)
    np.testing.assert_array_equal(read_log(path, robot.path).torque, -raw.torque)
    for run in (identify, inspect_log, lambda log, robot: replay(log, robot, robot.model_path)):
        with pytest.raises(LogError, match=r"log.npz: was read without the robot.*pass the robot to read_log"):
            run(raw.between(0.0, 10.0), robot)
    plain = replace(robot, log_table=LogTable())
    assert inspect_log(raw, plain).samples == len(raw.time)


def test_logs_may_be_frames_and_anything_else_is_named(arm: Robot) -> None:
    pandas = pytest.importorskip("pandas")
    log = arm_log(arm, duration=12)
    names = [f"{channel}.{joint}" for channel in ("position", "torque") for joint in log.joint_names]
    frame = pandas.DataFrame(np.hstack([log.position, log.torque]), columns=names).assign(time=log.time)
    one, listed = identify(frame, arm, method="curve-fit"), identify([frame], arm, method="curve-fit")
    assert one.joints == listed.joints
    assert inspect_log(frame, arm).samples == len(log.time)
    for wrong in ({"a": 1}, [{"a": 1}], np.zeros(3), None):
        with pytest.raises(LogError, match=r"log: is of type '\w+'; expected a RobotLog, a path, a frame"):
            identify(wrong, arm)
    with pytest.raises(LogError, match="the list of logs is empty"):
        identify([], arm)


def test_results_and_paths_are_planned_for_and_reported_alike(arm: Robot, tmp_path: Path) -> None:
    log = arm_log(arm, duration=12, still="elbow")
    result = identify(log, arm, method="curve-fit", table=tmp_path / "friction_torque.parquet")
    result.save(tmp_path / "result.json")
    ways = [plan(each, arm) for each in (result, tmp_path / "result.json", read_result(tmp_path / "result.json"))]
    assert all([*way.joints] == ["elbow"] for way in ways)
    write_report(tmp_path / "result.json", tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "Residual of the law" in page
    assert "Which friction is measured" not in page
    (tmp_path / "friction_torque.parquet").unlink()
    with pytest.raises(SettingsError, match=r"friction_torque\.parquet: no such file; expected"):
        write_report(tmp_path / "result.json", tmp_path / "report.html")
