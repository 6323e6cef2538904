"""The figures of the paper for any log obey its equations, and have its shapes on the packaged biped."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from studies.dense import constrained_sample
from tests.arm import arm_log, save_npz, stribeck_torque, write_arm
from tests.cli.test_cli import refused, run
from tests.models import example_log, example_robot

from stribeck import Robot, Settings
from stribeck.core.dynamics.contact.mode import ContactMode
from stribeck.core.dynamics.state import Orientation, State, root_quaternions
from stribeck.core.equations.friction_torque.preparation import prepare
from stribeck.core.errors import LogError
from stribeck.core.settings import FilterSettings
from stribeck.paper.figures.acceleration import estimated_acceleration
from stribeck.paper.figures.double_support import ambiguous_friction, weighted_friction
from stribeck.paper.figures.figure import PaperSection
from stribeck.paper.figures.inertias import scaled, split, with_bodies
from stribeck.paper.figures.of_log import paper_sections
from stribeck.simulation.sensors.measure import with_noise

EXACT = Settings(filter=FilterSettings(kind="log"))
DURATION = 12.0


@pytest.fixture(scope="module")
def noisy(arm: Robot) -> dict[str, PaperSection]:
    """The figures of a log of the arm with white noise, by key."""
    log = with_noise(arm_log(arm, DURATION, rate=250.0), position=3e-4, torque=0.01)
    return {section.key: section for section in paper_sections(log, arm, Settings())}


def test_the_estimated_acceleration_is_that_of_the_forward_dynamics(arm: Robot) -> None:
    """(5.10) on exact data: what the torque does to the model without friction."""
    log = arm_log(arm, 4.0, rate=250.0)
    _, estimated = estimated_acceleration(prepare(log, arm, EXACT), arm, EXACT)
    model, data = arm.tree.model, arm.tree.model.createData()
    motion = zip(log.position, log.velocity, log.torque, strict=True)
    np.testing.assert_allclose(estimated, [pin.aba(model, data, *row) for row in motion], atol=1e-8)


@pytest.mark.parametrize(("name", "gait"), [("talos", "walk"), ("g1", "walk"), ("go2", "trot")])
def test_in_double_support_the_weights_choose_among_frictions_that_obey_the_equations(name: str, gait: str) -> None:
    """(5.12) and a stationary point of (6.1), by the dense equations; the ground truth obeys them, too."""
    robot, (log, truth) = example_robot(name), example_log(name, 3.0, gait, rate=200)
    feet = np.array(log.foot_names)
    shared = np.flatnonzero(log.contact.sum(axis=1) >= 2)[:: max(1, len(log.time) // 8)][:4]
    known, generator = robot.torque_controlled, np.random.default_rng(0)
    for row in shared.tolist():
        rows, stands = slice(row, row + 1), tuple(feet[log.contact[row]].tolist())
        turn = Orientation(
            root_quaternions(robot, log.position[rows], log.base_orientation[rows]),
            truth.base_velocity[rows, 3:],
            truth.base_acceleration[rows, 3:],
        )
        state = State(log.position[rows], log.velocity[rows], log.acceleration[rows], turn)
        (mobility,), friction = ambiguous_friction(ContactMode(robot, stands), state, log.torque[rows])
        dense = constrained_sample(robot, stands, state, log.torque[rows], 0)
        scale = np.abs(dense.mobility).max()
        np.testing.assert_allclose(mobility, dense.mobility, atol=1e-8 * scale)
        for explains in (friction[0], truth.friction_torque[row, known]):
            np.testing.assert_allclose(mobility @ explains, dense.difference, atol=1e-6)
        weight, penalty = generator.uniform(0.5, 2.0, len(known)), generator.uniform(1e-4, 1e-2, len(known))
        (chosen,) = weighted_friction(mobility[None], friction, weight, penalty)
        slope = dense.mobility.T @ (weight * (dense.mobility @ chosen - dense.difference)) + penalty * chosen
        np.testing.assert_allclose(slope, 0.0, atol=1e-5 * np.abs(penalty * chosen).max())
        assert np.linalg.matrix_rank(mobility, tol=1e-6 * scale) < len(known)


def test_the_power_of_friction_adds_up_to_the_dissipated_energy(arm: Robot, noisy: dict[str, PaperSection]) -> None:
    velocity = arm_log(arm, DURATION, rate=250.0).velocity
    expected = (stribeck_torque(velocity) * velocity).mean(axis=0)
    found = {chart.samples.joint_names[chart.column]: chart.numbers[0] for chart in noisy["power"].charts}
    for joint, power in zip(arm.joint_names, expected.tolist(), strict=True):
        assert found[joint] == pytest.approx(power, rel=0.03), joint
    assert list(found.values()) == sorted(found.values(), reverse=True)


def test_the_cutoff_separates_motion_from_noise(noisy: dict[str, PaperSection]) -> None:
    section = noisy["spectrum"]
    (cutoff,) = section.marks
    assert 1.6 < cutoff < 16.0  # the fastest sine has 1.6 Hz
    for chart in section.charts:
        estimated, _ = np.asarray(chart.values) ** 2
        assert estimated[chart.along <= cutoff].sum() > 0.95 * estimated.sum()
        assert chart.numbers[0] > 10  # above it, the second difference is noise


def test_twice_the_error_of_inertias_has_twice_the_effect(arm: Robot, noisy: dict[str, PaperSection]) -> None:
    prepared = prepare(arm_log(arm, 4.0, rate=250.0), arm, EXACT)
    exact, *wrong = (
        estimated_acceleration(prepared, with_bodies(arm, scaled(mass, moments)), EXACT)[0].friction_torque
        for mass, moments in ((1.0, 1.0), (1.1, 1.0), (1.2, 1.0), (1.0, 1.1), (1.0, 1.2), (1.1, 1.1))
    )
    once, twice, slightly, more, both = (each - exact for each in wrong)
    np.testing.assert_allclose(twice, 2 * once, atol=1e-9)
    np.testing.assert_allclose(more, 2 * slightly, atol=1e-9)
    np.testing.assert_allclose(both, once + slightly, atol=1e-9)
    for chart in noisy["inertias"].charts:
        assert len(chart.values) == 6  # both branches for each model
        assert chart.numbers[0] > chart.numbers[1]


def test_the_branches_part_where_the_torque_depends_on_the_acceleration() -> None:
    """An ellipse has two branches; a curve has one."""
    angle = np.linspace(0, 2 * np.pi, 3000)
    velocity, acceleration = np.cos(angle), -np.sin(angle)
    assert split(velocity, acceleration, 0.5 * acceleration) == pytest.approx(2 * 0.5 * np.sqrt(0.5), rel=0.1)
    assert split(velocity, acceleration, np.tanh(40 * velocity)) < 0.02


def test_an_arm_has_a_page_without_double_support(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, page = write_arm(tmp_path), tmp_path / "paper.html"
    log = save_npz(arm_log(Robot.from_file(robot), 6.0, rate=250.0), tmp_path / "log.npz")
    assert run("paper", log, "-r", robot, "-o", page) == 0
    lines = capsys.readouterr().out.splitlines()
    text = page.read_text(encoding="utf-8")
    assert lines[-1] == str(page)
    assert "Double support: A fixed base has no feet, and therefore no double support." in lines
    charts = json.loads(text.partition('id="charts">')[2].partition("</script>")[0])
    assert len(charts) == 4 * 3  # of each joint
    assert set(re.findall('data-chart="([^"]+)"', text)) == set(charts)
    assert not re.search(r'(src|href)="http', text)


def test_what_a_robot_lacks_is_said_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = write_arm(tmp_path)
    log = save_npz(arm_log(Robot.from_file(robot), 6.0, rate=250.0), tmp_path / "log.npz", torque=None)
    assert "torque" in refused(capsys, "paper", log, "-r", robot, "-o", tmp_path / "paper.html")
    save_npz(arm_log(Robot.from_file(robot), 6.0, rate=250.0), log)
    robot.write_text(robot.read_text() + 'position_controlled = ["shoulder", "elbow", "slide"]\n')
    assert "names all joints" in refused(capsys, "paper", log, "-r", robot, "-o", tmp_path / "paper.html")
    assert not (tmp_path / "paper.html").exists()


def test_a_standing_robot_has_double_support_and_one_without_its_tilt_is_refused() -> None:
    log, _ = example_log("talos", 3.0, "stand", rate=200)
    charts = {part.key: part.charts for part in paper_sections(log, example_robot("talos"), Settings())}
    assert len(charts["double-support"]) == 12
    assert not any("leg" in chart.samples.joint_names[chart.column] for chart in charts["power"])
    robot, (log, _) = example_robot("go2"), example_log("go2", 3.0, "trot", rate=200)
    with pytest.raises(LogError, match="expected a channel base_orientation"):
        paper_sections(replace(log, base_orientation=None), robot, Settings())
    log, _ = example_log("go2", 3.0, "stand", rate=200)
    with pytest.raises(LogError, match="expected legs that swing"):
        paper_sections(log, robot, Settings())
