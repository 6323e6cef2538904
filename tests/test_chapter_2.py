"""All methods of the paper's chapter 2 identify a walk on the command line, as in docs/paper.md."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import save_npz
from tests.cli.test_cli import run
from tests.models import EXAMPLES, MODELS, POSTURES, SIDES, example_robot

from stribeck import Robot
from stribeck.friction import get_law
from stribeck.result import read_result
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.sensors.measure import with_noise

PAGE = (Path(__file__).parents[1] / "docs/paper.md").read_text()
COMMANDS = re.findall(r"`stribeck (identify .*?)`", PAGE)
TRUTH = {"viscous": 0.4, "coulomb": 1.0, "offset": 0.3}
MORE = {"load": 0.03, "coulomb_per_kelvin": -0.03}
HIP, KNEE, ANKLE = (f"leg_left_{k}_joint" for k in (3, 4, 5))
METHODS = ("whole-log", "ground-reaction", "observer", "direct", "curve-fit")


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder with the robot file and the log of a walk of TALOS's legs, with torques of three joints."""
    folder = tmp_path_factory.mktemp("walk")
    model, _, contacts = MODELS["talos"]
    legs = [f"leg_{side}_{k}_joint" for side in SIDES for k in range(1, 7)]
    others = [*(joint for joint in example_robot("talos").joint_names if joint not in legs)]
    lines = [
        "[robot]",
        f'model = "{EXAMPLES / model}"',
        f"position_controlled = {[joint for joint in legs if joint not in (HIP, KNEE, ANKLE)]}",
        "[robot.locked]",
        *(f"{joint} = 0.0" for joint in others),
    ]
    for foot, contact in contacts.items():
        lines += [f"[contacts.{foot}]", f'frame = "{contact["frame"]}"']
    (folder / "robot.toml").write_text("\n".join(lines), encoding="utf-8")
    robot = Robot.from_file(folder / "robot.toml")
    friction = dict.fromkeys((HIP, KNEE, ANKLE), TRUTH)
    posture = {joint: place for joint, place in POSTURES["talos"].items() if joint in robot.joint_names}
    law = get_law("coulomb-viscous")
    log, truth = exact_log(robot, law, friction, duration=13.0, rate=125.0, posture=posture)
    assert log.velocity is not None
    knee, torque, temperature = robot.joint_names.index(KNEE), log.torque.copy(), np.full(log.torque.shape, np.nan)
    temperature[:, knee] = 40 - 15 * np.exp(-log.time / 5)
    warmer = temperature[:, knee] - temperature[:, knee].mean()
    load = np.abs(log.torque - truth.friction_torque)[:, knee]
    torque[:, knee] += (MORE["load"] * load + MORE["coulomb_per_kelvin"] * warmer) * np.sign(log.velocity[:, knee])
    log = with_noise(replace(log, torque=torque, temperature=temperature), position=1e-5, torque=0.05)
    save_npz(log, folder / "walk.npz", foot_names=np.array(log.foot_names), velocity=None, acceleration=None)
    return folder


@pytest.mark.parametrize(("command", "method"), list(zip(COMMANDS, METHODS, strict=True)), ids=METHODS)
def test_every_row_runs_on_a_walk(command: str, method: str, walk: Path, tmp_path: Path) -> None:
    files = {"LOG": walk / "walk.npz", "robot.toml": walk / "robot.toml", "OUT": tmp_path / "out"}
    assert run(*(files.get(word, word) for word in shlex.split(command))) == 0
    result = read_result(tmp_path / "out" / "result.json")
    assert result.method == method
    assert set(result.joints) == {HIP, KNEE, ANKLE}
    speeds = np.array([-1.0, 1.0])
    true = TRUTH["viscous"] * speeds + TRUTH["coulomb"] * np.sign(speeds) + TRUTH["offset"]
    for name in (HIP, ANKLE):
        assert result.joints[name].verdict == "identified"
        assert result.joints[name].friction(speeds, offset=True) == pytest.approx(true, abs=0.15), name
    if method == "whole-log":
        knee = result.joints[KNEE].parameters
        for name, value in (TRUTH | MORE).items():
            low, high = knee[name].interval_95
            assert low <= value <= high, name
