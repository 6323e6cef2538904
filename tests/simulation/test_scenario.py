"""Scenario files: the examples are valid, run, are repeatable, and wrong ones are refused in one sentence."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.cli.test_cli import refused, run
from tests.models import STRIBECK

from stribeck import Robot, Settings, identify
from stribeck.core.settings import FilterSettings
from stribeck.simulation.run import friction_of, run_scenario
from stribeck.simulation.scenario import Scenario, read_scenario

EXAMPLES = sorted((Path(__file__).parents[2] / "examples/scenarios").glob("*.toml"))
COMMON = {"viscous": 0.2, "coulomb": 0.5, "stribeck_gain": 0.2, "stribeck_velocity": 0.2}
BY_PATTERN = {"common": COMMON, "joints": {"*": {"offset": 0.2, "slope": 40.0}, "elbow": {"coulomb": 0.9}}}
SHORT_ARM = {"robot": "arm", "simulator": "exact", "duration": 12.0, "friction": BY_PATTERN}
KNEES = STRIBECK | {"offset": 0.5}
TWO_STEPS = {"walk": [{"count": 2, "forward": 0.1, "stand": 0.2}], "friction": {"joints": {"*_knee": KNEES}}}


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_every_example_fits_its_robot(path: Path) -> None:
    scenario = read_scenario(path)
    robot = run_scenario(Scenario(robot=scenario.robot, simulator="exact", duration=0.3)).robot
    friction = friction_of(scenario, robot)
    assert friction.parameters
    assert path.read_text().startswith("# ")


def test_an_arm_gives_back_its_friction_by_pattern() -> None:
    found = run_scenario(Scenario.model_validate(SHORT_ARM))
    result = identify(found.log, found.robot, Settings(method="curve-fit", filter=FilterSettings(kind="log")))
    for name, joint in result.joints.items():
        assert joint.parameters["coulomb"].value == pytest.approx(0.9 if name == "elbow" else 0.5, rel=1e-6)
        assert found.truth.parameters[name]["offset"] == 0.2


QUICK = {"count": 1, "forward": 0.1, "single_support": 0.3, "double_support": 0.1, "stand": 0.05}
ARM = pytest.param({**SHORT_ARM, "duration": 1.0}, id="arm")
WALK = pytest.param({**TWO_STEPS, "walk": [QUICK], "physics_step": 0.0005}, marks=pytest.mark.long, id="walk")


@pytest.mark.parametrize("changed", [ARM, WALK])
def test_the_same_scenario_gives_the_same_log_and_another_seed_another(changed) -> None:
    noisy = {**changed, "sensors": "realistic"}
    first, second, other = (run_scenario(Scenario.model_validate({**noisy, "seed": seed})).log for seed in (3, 3, 4))
    for name, channel in first.channels().items():
        np.testing.assert_array_equal(channel, second.channels()[name])
    assert not np.array_equal(first.position, other.position)


def test_simulate_writes_log_and_truth_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / "arm.toml"
    scenario.write_text('robot = "arm"\nsimulator = "exact"\nduration = 2.0\nsensors = "harsh"\n')
    assert run("simulate", scenario, "-o", tmp_path / "log.npz") == 0
    printed = capsys.readouterr().out.split()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.toml", "log.npz", "log.truth.npz"]
    truth = np.load(tmp_path / "log.truth.npz")
    assert truth["friction_torque"].shape == (2000, 6)
    assert json.loads(str(truth["parameters"])) == {}
    assert Robot.from_file(printed[-1]).name == "arm"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("robot = 'other.toml'\n", ["other.toml", "cannot be read"]),
        ("robot = 'arm'\nsimulator = 'exact'\n[friction.joints.knee]\ncoulomb = 1.0\n", ["'knee'", "elbow"]),
        ("simulator = 'exact'\n[[walk]]\ncount = 2\n", ["exact", "[[walk]]"]),
        ("[friction]\nlaw = 'lugre'\n[friction.joints.left_knee]\ncoulomb = 1.0\n", ["'lugre'", "[friction.lugre]"]),
        ("[[walk]]\ncount = 2\nstand = 1e9\n", ["[[walk]] takes 1e+09 s, expected 1000 s at most"]),
    ],
)
def test_wrong_scenarios(text: str, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / "bad.toml"
    scenario.write_text(text)
    complaint = refused(capsys, "simulate", scenario, "-o", tmp_path / "log.npz")
    assert all(word in complaint for word in words), complaint
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]
