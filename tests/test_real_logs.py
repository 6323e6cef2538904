"""Logs of real robots, recorded and published by others; they are not part of this repository."""

import os
import re
import runpy
import shutil
import tomllib
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from studies import held_out

from stribeck import Robot, Settings, identify, read_log
from stribeck.check.drives.command_delay import command_delays
from stribeck.check.init import draft_robot_file
from stribeck.check.inspection import inspect_log
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError, NothingIdentifiedError
from stribeck.core.settings import FilterSettings, LogTable

ROOT = Path(__file__).parents[1]
DATA = Path(os.environ.get("STRIBECK_REAL_LOGS", ROOT.parent / "shared" / "real-logs"))

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason="the published logs of real robots are not here: set STRIBECK_REAL_LOGS to their folder"
)


@pytest.fixture(scope="module")
def converted(tmp_path_factory):
    """Return a function from a robot's name to its folder of robot file, model and logs."""
    convert = runpy.run_path(str(ROOT / "examples" / "real_robots" / "convert.py"))["convert"]
    return cache(lambda name: convert(name, DATA, tmp_path_factory.getbasetemp() / "real-robots"))


def opened(folder, settings="robot"):
    return sorted(folder.glob("log*.npz")), Robot.from_file(folder / f"{settings}.toml")


def by_curves(folder):
    return opened(folder, "curve-fit")


@pytest.mark.parametrize("name", ["kinova-gen3", "double-pendulum", "so101", "icub-walk"])
def test_init_writes_what_was_written_by_hand(name, converted, tmp_path):
    folder = converted(name)
    by_hand = tomllib.loads((folder / "robot.toml").read_text())
    log = sorted(folder.glob("log*.npz"))[0]
    output = tmp_path / "robot.toml"
    output.write_text(draft_robot_file(str(folder / by_hand["robot"]["model"]), log, output).text)
    drafted, robot = tomllib.loads(output.read_text()), Robot.from_file(folder / "robot.toml")
    assert drafted["robot"]["base"] == by_hand["robot"]["base"]
    assert set(drafted["robot"].get("position_controlled", [])) == set(robot.position_controlled)
    assert drafted["robot"].get("locked", {}) == by_hand["robot"].get("locked", {})
    feet = {foot: contact["frame"] for foot, contact in drafted.get("contacts", {}).items()}
    assert feet == {foot: contact.frame for foot, contact in robot.contacts.items()}
    left_out = {"max_gap", "joint_order"} if name == "double-pendulum" else {"max_gap"}  # it has joint_names instead
    for key, value in by_hand.get("log", {}).items():
        assert key in left_out or drafted["log"][key] == value, key
    same, other = read_log(log, robot), read_log(log, Robot.from_file(output))
    np.testing.assert_array_equal(same.position, other.position)
    np.testing.assert_array_equal(same.torque, other.torque)


def values(result, name):
    return np.array([joint.parameters[name].value for joint in result.joints.values()])


def test_icub_log_is_read_as_matlab_wrote_it(converted):
    logs, robot = opened(converted("icub-walk"))
    there = read_log(logs[0], robot)
    names = {"time": "Time", "position": "Pos", "velocity": "Vel"}
    table: dict[str, object] = {channel: {"name": f"estimatorJoints{name}"} for channel, name in names.items()}
    table["joint_order"] = [str(name) for name in np.load(logs[0])["joint_names"]]
    robot = replace(robot, log_table=LogTable.model_validate(table))
    log = read_log(DATA / "icub-walk" / "walking.mat", robot)
    for channel in names:
        np.testing.assert_array_equal(getattr(log, channel), getattr(there, channel))


TX40 = {"coulomb": [7.14, 8.26, 6.34, 2.48], "viscous": [8.05, 5.53, 1.97, 1.11]}
"""Friction of the first four joints as published (TX40_config.yaml) [N m], [N m s/rad]."""


def test_tx40_friction_is_the_published_one(converted):
    """By the published filter, and by the one that is chosen: torque and position agree up to a kilohertz."""
    logs, robot = by_curves(converted("tx40"))
    result = identify(logs, robot)
    for name, figures in TX40.items():
        np.testing.assert_allclose(values(result, name)[:4], figures, rtol=0.05, err_msg=name)
        for joint, figure in zip(list(result.joints.values())[:4], figures, strict=True):
            assert joint.parameters[name].verdict == "identified"
            assert joint.parameters[name].interval_95[0] < figure < joint.parameters[name].interval_95[1]

    by_itself = identify(logs, robot, robot.settings.model_copy(update={"filter": FilterSettings()}))
    for name, tolerance in (("coulomb", 0.03), ("viscous", 0.03), ("armature", 0.1)):
        np.testing.assert_allclose(values(by_itself, name)[:4], values(result, name)[:4], rtol=tolerance, err_msg=name)


@pytest.mark.long
def test_tx40_by_default_gives_the_published_friction(converted):
    """Friction at half the top speed; Coulomb friction alone rises more slowly than the published law has it jump."""
    result = identify(*opened(converted("tx40")))
    for joint, level, slope in zip(list(result.joints.values())[:4], *TX40.values(), strict=True):
        assert joint.verdict == "identified"
        assert joint.curve[1].value == pytest.approx(level + slope * joint.curve[1].velocity, rel=0.05)
    assert result.joints["joint_5"].verdict == result.couplings["motor_6"].verdict == "identified"
    assert not any("χ²" in warning for warning in result.warnings)


def test_tx40_friction_of_the_shared_motor_is_the_published_one(converted):
    """Motor 6 resists v5 + v6, which the published viscous friction of both joints contains."""
    logs, robot = opened(converted("tx40"))
    settings = Settings(law="coulomb-viscous", corrections="none", fit_armature=True)
    result = identify(logs, robot, settings)
    found = {name: part.value for name, part in result.couplings["motor_6"].parameters.items()}
    assert found == pytest.approx({"coulomb": 1.95, "viscous": 0.616, "armature": 0.00964}, rel=0.1)
    viscous = [result.joints[name].parameters["viscous"].value + found["viscous"] for name in ("joint_5", "joint_6")]
    assert viscous == pytest.approx([1.86, 0.65], rel=0.05)


def test_kinova_figures_follow_from_log_5_in_the_published_way(converted):
    """All samples, those at rest too, the log's own velocity and acceleration, the model's inertias."""
    logs, robot = by_curves(converted("kinova-gen3"))
    settings = robot.settings.model_copy(update={"rest": 0.0, "holdout": 10_000, "fit_armature": True})
    result = identify(logs[4], robot, settings)
    published = np.loadtxt(DATA / "kinova-gen3" / "friction_parameters_solution_5.csv").reshape(4, 7)
    found = [(k, joint) for k, joint in enumerate(result.joints.values()) if joint.parameters]
    assert len(found) >= 4  # the others turn round too seldom in one log
    tolerances = {"coulomb": 0.02, "viscous": 0.04, "armature": 0.01, "offset": 0.02}
    for row, (name, tolerance) in zip(published, tolerances.items(), strict=True):
        for k, joint in found:
            assert joint.parameters[name].value == pytest.approx(row[k], abs=tolerance), (name, k)


def test_kinova_sign_of_the_torque_is_found_to_be_inverted(converted, tmp_path):
    folder = converted("kinova-gen3")
    shutil.copyfile(folder / "kinova.urdf", tmp_path / "kinova.urdf")
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    (tmp_path / "robot.toml").write_text(text.replace("scale = -1.0", "scale = 1.0"), encoding="utf-8")
    inverted = inspect_log(folder / "log_3.npz", Robot.from_file(tmp_path / "robot.toml"))
    signs = {name: joint.sign for name, joint in inverted.joints.items()}
    assert [signs[f"joint_{k}"] for k in range(1, 7)] == ["opposite"] * 6
    assert "joint_1, joint_2, joint_3" in inverted.findings[0]
    right = inspect_log(folder / "log_3.npz", Robot.from_file(folder / "robot.toml"))
    assert "opposite" not in {joint.sign for joint in right.joints.values()}


def test_go2_commands_act_late_and_friction_is_of_the_order_that_least_squares_gives(converted):
    result = identify(*by_curves(converted("go2")))
    coulomb, armature = (values(result, name).reshape(4, 3) for name in ("coulomb", "armature"))
    assert np.all((coulomb[:, :2] > 0.9 * 0.15) & (coulomb[:, :2] < 1.1 * 0.25))  # hips and thighs
    assert np.all((coulomb[:, 2] > 0.9 * 0.54) & (coulomb[:, 2] < 1.1 * 1.16))  # calves
    assert np.all(armature[:, :2] < 1.1 * 0.0086)
    assert np.all((armature[:, 2] > 0.9 * 0.0248) & (armature[:, 2] < 1.1 * 0.0265))


@pytest.mark.long
def test_go2_quarters_fitted_together_give_one_delay(converted):
    """Some quarters of the log are slow; two calves fit their model so badly that they show no delay."""
    logs, robot = opened(converted("go2"))
    whole = read_log(logs[0], robot)
    edges = np.linspace(0, len(whole.time), 5).astype(int)
    quarters = [prepare(whole.take(slice(*rows)), robot, robot.settings) for rows in pairwise(edges)]
    delay, error = command_delays(quarters, robot, robot.settings)
    assert np.all((delay > 7e-3) & (delay < 9.5e-3))
    assert np.all(error < 1e-3)


def test_double_pendulum_friction_is_of_the_published_order(converted):
    result = identify(*by_curves(converted("double-pendulum")))
    ratio = values(result, "coulomb") / [0.16, 0.12]  # design_C.1_model_1.0.yml
    assert np.all((ratio > 0.7) & (ratio < 1.7))
    for joint in result.joints.values():
        assert joint.validation.rms < 0.7 * joint.validation.rms_zero_friction


BODIES_EXPLAIN_FRICTION = pytest.mark.xfail(strict=True, reason="5 % worse than without, 2 % better on the next log")


@pytest.mark.long
@pytest.mark.parametrize("name", [pytest.param("double-pendulum", marks=BODIES_EXPLAIN_FRICTION), "tx40"])
def test_corrected_inertias_do_no_harm_on_what_the_fit_has_not_seen(converted, name):
    """Friction beyond the law, and a motor that logs no torque, last for a whole log: bodies must not explain them."""
    both = {"trusted": {"corrections": "none"}, "corrected": {}}
    errors = held_out.held_out(converted(name), held_out.BANDS[name], both)
    assert np.mean(np.log(errors["corrected"] / errors["trusted"])) < 0.0


def test_cassie_lands_on_flat_feet(converted):
    """Base orientation, joint signs, orders and offsets all have to be right for the soles to be level at the end."""
    logs, robot = opened(converted("cassie-landings"))
    slopes = []
    for path in logs:
        log = read_log(path, robot)
        base = Rotation.from_quat(log.base_orientation[-1]).as_matrix()
        for foot in robot.contacts:
            toe_to_heel = np.array([0.1337, -0.112, 0.0])
            sole = base @ robot.foot_pose(foot, log.position[-1:])[0][0] @ toe_to_heel
            slopes.append(np.rad2deg(np.arcsin(sole[2] / np.linalg.norm(sole))))
    assert len(logs) == 29
    assert np.median(np.abs(slopes)) < 5


def test_cassie_landings_identify_nothing(converted):
    """Fifty milliseconds after an impact are no identification set."""
    logs, robot = opened(converted("cassie-landings"))
    with pytest.raises(NothingIdentifiedError, match="shorter than the time excluded around contact changes"):
        identify([logs[k] for k in (10, 12, 24)], robot)


SHOWN = [
    ("double-pendulum", "Double pendulum", 1),
    pytest.param("tx40", "Staubli TX40", 6, marks=pytest.mark.long),
    pytest.param("kinova-gen3", "Kinova Gen3", 6, marks=pytest.mark.long),
    pytest.param("go2", "Unitree Go2", 10, marks=pytest.mark.long),
]
"""Robot, heading on the page, and how many joints and couplings are identified at least by default."""


@pytest.mark.parametrize(("name", "heading", "identified"), SHOWN)
def test_the_page_shows_what_the_command_prints(tmp_path, monkeypatch, name, heading, identified):
    """The numbers agree, and most joints are identified by default."""
    examples = ROOT / "examples" / "real_robots"
    monkeypatch.syspath_prepend(str(examples))
    printed = rows(runpy.run_path(str(examples / "run.py"))["shown"](name, DATA, tmp_path))
    page = (examples / "results.md").read_text(encoding="utf-8")
    shown = rows(page.split(f"\n## {heading}\n")[1].split("\n## ")[0])
    assert [row[:1] for row in printed] == [row[:1] for row in shown]
    for fresh, old in zip(printed, shown, strict=True):
        numbers = [np.array(re.findall(r"(-?\d+\.\d+) ±", " | ".join(row)), dtype=float) for row in (fresh, old)]
        np.testing.assert_allclose(*numbers, rtol=0.05, atol=0.02, err_msg=str(fresh))
    assert sum(row[1] == "identified" for row in printed) >= identified


def rows(text):
    """Return the cells of all lines of tables in which an estimate stands."""
    return [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ") and "±" in line]


GOOD = {"tx40": {"robot-model"}, "kinova-gen3": {"position-stop"}, "go2": {"command-delay"}, "double-pendulum": set()}


@pytest.mark.parametrize("name", [pytest.param(own, marks=[pytest.mark.long] * (own == "go2")) for own in GOOD])
def test_the_audit_finds_nothing_in_good_logs(converted, name):
    """But for joints of the Kinova that go further than its model lets them, and a link without inertia of the TX40."""
    logs, robot = opened(converted(name))
    for log in logs:
        assert {finding.check for finding in inspect_log(log, robot).audit} <= GOOD[name]


def test_torque_without_a_sign_stops(converted):
    logs, robot = opened(converted("so101"))
    for log in logs:
        (finding,) = inspect_log(log, robot).audit
        assert finding.check == "torque-unsigned"
        assert finding.joints == robot.joint_names
    with pytest.raises(LogError, match="never changes its sign"):
        identify(logs[0], robot)
