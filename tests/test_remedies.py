"""Every remedy leads on: what a message advises is taken from its words, applied, and the next run is without it."""

import re
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from studies.remedies import apply
from tests.cli.test_cli import run
from tests.mujoco_arm import friction, record, urdf, with_force, with_other_model, write_case
from tests.standing import still_humanoid

from stribeck import Robot, inspect_log, read_result
from stribeck import identify as identify_logs

Log = dict[str, Any]


def identify(folder: Path, capsys: pytest.CaptureFixture[str], options: Sequence[str]) -> dict[str, str]:
    """Identify the log of a folder: the message of each finding, or of the error as "error"."""
    command = ["identify", folder / "log.npz", "-r", folder / "robot.toml", "-o", folder / "out", "--overwrite"]
    if run(*command, *options):
        return {"error": capsys.readouterr().err.rpartition("stribeck: ")[2]}
    result = read_result(folder / "out/result.json")
    doubted = [joint for finding in result.findings if finding.doubt for joint in finding.joints]
    assert not [joint for joint in doubted if result.joints[joint].verdict == "identified"]
    return {each.check: str(each) for each in result.findings}


def follow(folder: Path, check: str, capsys: pytest.CaptureFixture[str], options: Sequence[str] = ()) -> dict[str, str]:
    """Identify, apply the remedy of a finding, and identify again without this finding."""
    messages = identify(folder, capsys, options)
    assert check in messages
    before = (folder / "robot.toml").read_text()
    advised = apply(messages[check], folder / "robot.toml")
    if not advised and (folder / "robot.toml").read_text() == before:
        assert "--force" in messages[check]
        advised = ["--force"]
    after = identify(folder, capsys, [*options, *advised])
    assert "error" not in after
    assert check not in after
    return after


@pytest.fixture(scope="module")
def sound() -> Log:
    return record([1.5, 2.0, 2.5], 14.0)


def scaled(factor: float, channel: str = "torque", joint: int | slice = slice(None)) -> Callable[[Log], None]:
    def damage(log: Log) -> None:
        log[channel][..., joint] *= factor

    return damage


def touched(log: Log) -> None:
    for start in (3.0, 8.0):
        with_force(log, (start, start + 2.0), [20.0, 6.0, 45.0])


def frozen(log: Log) -> None:
    log["position"][1600:2000, 1] = log["position"][1600, 1]


def late(log: Log) -> None:
    log["torque"] = np.roll(log["torque"], 3, axis=0)


def without_gravity(log: Log) -> None:
    arm = mujoco.MjModel.from_xml_string(urdf())
    data = mujoco.MjData(arm)
    for k, data.qpos[:] in enumerate(log["position"]):
        mujoco.mj_forward(arm, data)
        log["torque"][k] -= data.qfrc_bias


def in_degrees(log: Log) -> None:
    for channel in ("position", "velocity"):
        log[channel] *= np.rad2deg(1)


def dead(log: Log) -> None:
    log["torque"][:, 2] = 0.01


def wrapped(log: Log) -> None:
    log["position"] = (log["position"] + 0.3) % (2 * np.pi) - 0.3


def renamed(log: Log) -> None:
    log["joint_names"] = np.array(["j1", "j2", "j3"])


def external(log: Log) -> None:
    before = log["torque"].copy()
    with_force(log, (0.0, 14.0), [20.0, 6.0, 45.0])
    log["external_torque"] = log["torque"] - before


def carrying(mass: float) -> Callable[[Log], None]:
    return lambda log: with_other_model(log, mass=mass)


def tilted(degrees: float) -> Callable[[Log], None]:
    return lambda log: with_other_model(log, tilt=np.deg2rad(degrees))


CASES: dict[str, tuple[str, Callable[[Log], None], str]] = {
    "N mm": ("error", scaled(1000.0), ""),
    "inverted": ("error", scaled(-1.0), ""),
    "one inverted": ("torque-sign", scaled(-1.0, joint=1), ""),
    "one gain": ("torque-gain", scaled(0.01, joint=0), ""),
    "clock": ("error", scaled(2.0, "time"), ""),
    "degrees": ("error", scaled(np.rad2deg(1), "position"), ""),
    "all in degrees": ("error", in_degrees, ""),
    "velocity in degrees": ("error", scaled(np.rad2deg(1), "velocity"), ""),
    "touched": ("set-aside", touched, ""),
    "frozen": ("channel-frozen", frozen, ""),
    "late": ("torque-delay", late, ""),
    "without gravity": ("error", without_gravity, ""),
    "dead": ("channel-dead", dead, ""),
    "wrapped": ("error", wrapped, ""),
    "names": ("error", renamed, ""),
    "external": ("error", external, ""),
    "two gains": ("torque-gain", scaled(1.4, joint=slice(0, 2)), ""),
    "2 kg at the flange": ("payload", carrying(2.0), ""),
    "tilted by 10 degrees": ("gravity", tilted(10.0), ""),
    "gravity": ("error", scaled(1.0), "gravity = [0.0, 9.81, 0.0]\n"),
    "floating": ("error", scaled(1.0), 'base = "floating"\n'),
}


@pytest.mark.parametrize("case", CASES)
def test_a_remedy_leads_on(case: str, sound: Log, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check, damage, text = CASES[case]
    log = {name: values.copy() for name, values in sound.items()}
    damage(log)
    write_case(tmp_path, log, text)
    quick = ("--method", "curve-fit") if check != "torque-delay" else ()  # all methods have the same audit
    follow(tmp_path, check, capsys, quick)
    for k, joint in enumerate(read_result(tmp_path / "out/result.json").joints.values()):
        for point in joint.curve:
            true = friction(np.full(3, point.velocity))[k]
            assert point.value == pytest.approx(true, rel=0.05)


def test_a_payload_of_one_of_two_logs_is_named_with_its_log(sound: Log, tmp_path: Path) -> None:
    log = {name: values.copy() for name, values in sound.items()}
    carrying(2.0)(log)
    write_case(tmp_path, sound)
    np.savez(tmp_path / "loaded.npz", **log)
    logs, robot_file = [tmp_path / "log.npz", tmp_path / "loaded.npz"], tmp_path / "robot.toml"
    (found,) = [each for each in identify_logs(logs, robot_file).findings if not each.note]
    assert 'spans = [["loaded.npz", 0, 14]]' in str(found)
    apply(str(found), robot_file)
    assert Robot.from_file(robot_file).payloads[0].mass == pytest.approx(2.0, rel=0.05)
    result = identify_logs(logs, robot_file)
    assert not [each for each in result.findings if not each.note]
    assert {joint.verdict for joint in result.joints.values()} == {"identified"}


SLOW = pytest.param(0.04, 1e-9, marks=pytest.mark.long)


@pytest.mark.parametrize(("speed", "step"), [(1.5, 2 * np.pi / 4096), SLOW], ids=["12 bits", "slow"])
def test_coarse_and_slow_joints_are_read(speed: float, step: float, tmp_path: Path, capsys) -> None:
    log = record([speed] * 3, 20.0)
    log["position"] = step * np.round(log["position"] / step)
    write_case(tmp_path, log)
    identify(tmp_path, capsys, ())
    for k, joint in enumerate(read_result(tmp_path / "out/result.json").joints.values()):
        assert joint.verdict == ("weak" if speed < 1 else "identified")
        low, high = joint.curve[-1].interval_95
        assert 0.95 * low < friction(np.full(3, joint.curve[-1].velocity))[k] < 1.05 * high


@pytest.mark.parametrize("factor", [0.579, np.array([0.3, 0.6, 0.4])], ids=["one factor", "a factor per joint"])
def test_a_factor_that_is_no_unit_is_a_question(factor: float | np.ndarray, sound: Log, tmp_path: Path) -> None:
    write_case(tmp_path, sound | {"torque": factor * sound["torque"]})
    found = [str(each) for each in inspect_log(tmp_path / "log.npz", tmp_path / "robot.toml").audit]
    assert any("before you" in words for words in found)
    assert not any(re.search(r"[Ss]et scale", words) for words in found)


def test_a_torque_that_is_inverted_one_way_is_left_out(sound, tmp_path, capsys):
    torque = sound["torque"].copy()
    torque[:, 1] *= np.where(sound["velocity"][:, 1] < 0, -1.0, 1.0)
    write_case(tmp_path, sound | {"torque": torque})
    assert "elbow 2" in identify(tmp_path, capsys, [])["torque-unsigned"]
    assert list(read_result(tmp_path / "out/result.json").joints) == ["shoulder 1", "wrist 3"]


def lifted(log: Log) -> None:
    log["contact"] = np.zeros_like(log["contact"])


def loaded(factor: float) -> Callable[[Log], None]:
    def damage(log: Log) -> None:
        weight = 9.81 * 36.2
        log["foot_force"] = np.where(log.pop("contact"), factor * weight / 2, 0.0)

    return damage


FEET: dict[str, tuple[str, Callable[[Log], None], list[str]]] = {
    "flags": ("error", lifted, []),
    "downward": ("error", loaded(-1.0), []),
    "kgf": ("error", loaded(1 / 9.81), []),
    "wrenches": ("error", scaled(1.0), ["--method", "ground-reaction"]),
}


@pytest.fixture(scope="module")
def squat(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("squat")
    still_humanoid(folder, "squat", seconds=5.0)
    return Path(folder)


@pytest.mark.parametrize("case", [pytest.param(k, marks=[pytest.mark.long] * (k in ("kgf", "downward"))) for k in FEET])
def test_a_remedy_for_feet_leads_on(case: str, squat: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check, damage, options = FEET[case]
    shutil.copytree(squat, tmp_path, dirs_exist_ok=True)
    log = dict(np.load(tmp_path / "log.npz"))
    damage(log)
    np.savez(tmp_path / "log.npz", **log)
    follow(tmp_path, check, capsys, options)
