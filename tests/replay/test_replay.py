"""Replayed logs: a model with the true friction explains them, one without does not. Friction read from model files."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from tests.arm import URDF, arm_log, save_npz, write_arm
from tests.cli.test_cli import refused, run
from tests.command_logs import clamped_quadruped, hobby_arm, trotting_quadruped
from tests.commanded import ARM, QUADRUPED, with_drives
from tests.exporters.found import robot_of

from stribeck import Robot, Settings
from stribeck.app.report.replay import curves_of_replay, pieces, write_recording, write_replay
from stribeck.core.errors import SettingsError
from stribeck.core.friction import get_law
from stribeck.core.log import RobotLog
from stribeck.core.settings import FilterSettings
from stribeck.design.replaying import rollouts
from stribeck.design.replaying.comparison import Replay, Replayed
from stribeck.design.replaying.replay import read_friction, replay
from stribeck.design.replaying.rollouts import HORIZONS
from stribeck.io.writers import write_log
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots.toro import standing_posture
from stribeck.simulation.sensors.measure import with_noise

COULOMB, VISCOUS = 1.2, 0.3
EXACT = Settings(filter=FilterSettings(kind="log"))
TOLD = {"urdf": ("friction", "damping"), "mjcf": ("frictionloss", "damping")}


def with_friction(robot: Robot, kind: str, path: Path, coulomb: float = COULOMB, viscous: float = VISCOUS) -> Path:
    """Write the robot's model with the same friction in every joint of the log."""
    tree = ET.parse(robot.model_path)
    for joint in tree.getroot().iter("joint"):
        if joint.get("name") in robot.joint_names:
            place = ET.SubElement(joint, "dynamics") if kind == "urdf" else joint
            for name, value in zip(TOLD[kind], (coulomb, viscous), strict=True):
                place.set(name, str(value))
    tree.write(path)
    return path


def known_log(robot: Robot, seconds: float, **options: object) -> RobotLog:
    """Return an exact log with that friction in every joint whose torque is measured."""
    truth = {"coulomb": COULOMB, "viscous": VISCOUS, "offset": 0.0}
    joints = [robot.joint_names[k] for k in robot.torque_controlled]
    law, friction = get_law("coulomb-viscous"), dict.fromkeys(joints, truth)
    return exact_log(robot, law, friction, duration=seconds, rate=500.0, seed=1, **options)[0]  # type: ignore[arg-type]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let few rollouts start."""
    monkeypatch.setattr(rollouts, "STARTS", 30)


def without_and_with(found: Replay) -> tuple[Replayed, Replayed]:
    """Return what was found of the other model without and with its friction."""
    without, with_own = found.models[-2:]
    assert not without.friction
    assert with_own.friction
    return without, with_own


def relative(model: Replayed, joint: str, horizon: int) -> float:
    return model.rollouts[joint][horizon].relative


@pytest.mark.usefixtures("few")
def test_the_page_shows_measured_and_predicted_motion(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    found = replay(known_log(robot, 10.0), robot, with_friction(robot, "urdf", tmp_path / "new.urdf"), EXACT)
    without, with_own = without_and_with(found)
    motion = found.motion
    for joint in robot.joint_names:
        known = np.isfinite(with_own.predicted[joint])
        assert known.mean() > 0.9
        np.testing.assert_allclose(with_own.predicted[joint][known], motion.torque[joint][known], atol=1e-6)
        assert np.abs(without.predicted[joint] - motion.torque[joint])[known].max() > COULOMB
        errors = []
        for model in (without, with_own):
            shown = pieces(motion.position_time, *model.positions[joint], found)
            assert 0.3 < np.isfinite(shown).mean() < 0.95
            errors.append(np.nanmax(np.abs(shown - motion.position[joint])))
        assert errors[1] < 0.1 * errors[0]
    write_replay(found, tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text()
    assert all(f'data-chart="{kind}-over-log{k}"' in page for kind in ("torque", "position") for k in range(3))
    assert {"motion", "predicted", "positions"}.isdisjoint(json.loads(found.to_json()))
    curves = curves_of_replay(found)
    assert {key[1:] for key in curves if key[0] == "elbow"} == {
        (kind, label)
        for kind in ("torque", "position")
        for label in ("measured", *(model.name for model in found.models))
    }
    recording = tmp_path / "replay.rrd"
    if find_spec("rerun"):
        write_recording(curves, recording, found.robot)
        assert recording.read_bytes()[:3] == b"RRF"
    else:
        with pytest.raises(SettingsError, match=r"pip install 'stribeck\[rerun\]'"):
            write_recording(curves, recording, found.robot)
        assert not recording.exists()


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("name", "options", "worst"), [("toro", {"posture": standing_posture()}, 0.5), ("quadruped", {"gait": "trot"}, 9.0)]
)
def test_walks_are_replayed_with_standing_and_swinging_legs(name, options, worst, tmp_path):
    robot, kind = robot_of(name, tmp_path)
    log, model = known_log(robot, 6.0, **options), with_friction(robot, kind, tmp_path / "new.xml")
    found = replay(log, robot, model, EXACT, horizon=0.1)
    without, with_own = without_and_with(found)
    assert len([joint for joint in found.joints if re.search("hip|knee|ankle|thigh|calf", joint)]) == 12
    assert list(with_own.torque) == found.joints
    for joint in found.joints:
        assert with_own.torque[joint].r2 > 0.99
        assert relative(with_own, joint, 0) < min(0.3 * relative(without, joint, 0), worst)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("make", [clamped_quadruped, hobby_arm, trotting_quadruped])
def test_the_true_model_moves_as_the_log_under_its_commands(make, tmp_path, capsys) -> None:
    """Drives of 50 Hz with unknown delay; the URDF is converted, and the servos of the other model are off."""
    model, trots = ARM if make is hobby_arm else QUADRUPED, make is trotting_quadruped
    (tmp_path / "new.xml").write_text(with_drives(model, make(tmp_path, seconds=8.0), not trots).to_xml())
    arrays = dict(np.load(tmp_path / "log.npz"))
    moved = arrays["position"] + np.random.default_rng(0).normal(0.0, 5e-4, arrays["position"].shape)
    np.savez(tmp_path / "again.npz", **arrays | {"position": moved})
    files = (tmp_path / "again.npz", tmp_path / "log.npz", "-r", tmp_path / "robot.toml", "-m", tmp_path / "new.xml")
    assert run("replay", *files, "-o", tmp_path / "out") == 0
    first = capsys.readouterr().out.partition("\n")[0]
    about = "0.5 s with the base as" if trots else "commands of 2 logs; .* differ by 0.5 to 0.5"
    found = re.match(f"positions ([0-9.]+) → ([0-9.]+) mrad .*{about}", first)
    assert float(found[2]) < 2.0 < 0.2 * float(found[1])
    assert first.partition("; torque")[0].replace("pos", "Pos") in (tmp_path / "out/replay.html").read_text()


@pytest.mark.usefixtures("few")
def test_flight_is_omitted_and_reported(tmp_path: Path) -> None:
    robot, kind = robot_of("quadruped", tmp_path)
    log = known_log(robot, 3.0, gait="trot")
    aloft = np.abs(log.time - 1.5) < 0.25
    contact = log.contact & ~aloft[:, None]
    other = log.torque + 0.3 * (np.abs(log.time - 1.5) < 0.1)[:, None]
    model = with_friction(robot, kind, tmp_path / "new.urdf")
    logs = (replace(log, contact=contact, torque=torque) for torque in (log.torque, other))
    found, again = (replay(each, robot, model, EXACT, horizon=0.1) for each in logs)
    assert any(re.fullmatch("1. % of the log is flight, which is left out", note) for note in found.notes)
    assert [each.torque for each in found.models] == [each.torque for each in again.models]
    assert [each.rollouts for each in found.models] == [each.rollouts for each in again.models]
    assert without_and_with(found)[1].median_r2() == pytest.approx(1.0, abs=0.01)


@pytest.mark.usefixtures("few")
def test_a_tendons_friction_is_taken_into_account(tmp_path: Path) -> None:
    robot, kind = robot_of("toro", tmp_path)
    one, other = (name for name in robot.joint_names if "elbow" in name)
    log = known_log(robot, 3.0, posture=standing_posture())
    own = [robot.joint_names.index(name) for name in (one, other)]
    coupled = log.velocity[:, own] @ [1.0, -0.5]
    torque = log.torque.copy()
    torque[:, own] += np.outer(2.0 * np.sign(coupled) + 0.4 * coupled, [1.0, -0.5])
    model = with_friction(robot, kind, tmp_path / "new.xml")
    tree = ET.parse(model)
    tendon = ET.SubElement(ET.SubElement(tree.getroot(), "tendon"), "fixed", frictionloss="2", damping="0.4")
    for name, coefficient in ((one, "1"), (other, "-0.5")):
        ET.SubElement(tendon, "joint", joint=name, coef=coefficient)
    tree.write(tmp_path / "coupled.xml")
    without, with_own = without_and_with(
        replay(replace(log, torque=torque), robot, tmp_path / "coupled.xml", EXACT, horizon=0.1)
    )
    for name in (one, other):
        assert with_own.torque[name].r2 > 0.99
        assert relative(with_own, name, 0) < 0.3 * relative(without, name, 0)


@pytest.mark.usefixtures("few")
def test_an_exported_model_explains_its_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, _ = robot_of("arm", tmp_path)
    write_log(with_noise(known_log(robot, 15.0), position=1e-5, torque=0.05, seed=4), tmp_path / "log.npz")
    log, out = tmp_path / "log.npz", tmp_path / "out"
    assert run("identify", log, "-r", robot.path, "-o", out, "--method", "curve-fit", "--law", "coulomb-viscous") == 0
    assert run("export", out, "-r", robot.path, "--to", "urdf", "-o", tmp_path / "new.urdf") == 0
    capsys.readouterr()
    arguments = ("replay", log, "-r", robot.path, "--model", tmp_path / "new.urdf")
    assert run(*arguments, "--json") == 0
    as_given, without, with_own = json.loads(capsys.readouterr().out)["models"]
    for joint in robot.joint_names:
        assert with_own["torque"][joint]["r2"] > 0.98
        assert with_own["torque"][joint]["rms"] < 0.3 * without["torque"][joint]["rms"]
        for far, near in zip(without["rollouts"][joint], with_own["rollouts"][joint], strict=True):
            assert near["relative"] < 0.3 * far["relative"]
        assert with_own["rollouts"][joint][0]["relative"] < 0.5 * as_given["rollouts"][joint][0]["relative"]
    assert run(*arguments, "--horizon", "0.2", "-o", tmp_path / "replayed") == 0
    printed = capsys.readouterr().out
    assert "new.urdf" in printed
    assert "states no joint friction" in " ".join(printed.split())
    page = (tmp_path / "replayed" / "replay.html").read_text()
    assert all(joint in page for joint in robot.joint_names)
    assert f"velocity after {', '.join(f'{1e3 * share * 0.2:.0f}' for share in HORIZONS)} ms" in page
    assert json.loads((tmp_path / "replayed" / "replay.json").read_text())["robot"] == robot.name
    assert "already exists" in refused(capsys, *arguments, "-o", tmp_path / "replayed")
    assert "0.05 to 10 s" in refused(capsys, *arguments, "--horizon", "0.01")


OTHER = URDF.replace("elbow", "knee")
NEGATIVE = URDF.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><dynamics damping="-1"/>')
WRONG = [
    ("", "wrong.urdf: no such file; check the path"),
    (OTHER, "has no joint 'elbow', which robot 'arm' has; expected a model of that robot, this one has shoulder, knee"),
    ("<robot", "wrong.urdf: is not well-formed"),
    (NEGATIVE, "damping of joint 'slide' is -1; expected zero or more"),
]


@pytest.mark.parametrize(("text", "words"), WRONG, ids=["missing", "joints", "text", "damping"])
def test_a_model_that_does_not_fit_is_refused(text, words, tmp_path, capsys):
    robot = Robot.from_file(write_arm(tmp_path))
    save_npz(arm_log(robot, duration=3), tmp_path / "log.npz")
    if text:
        (tmp_path / "wrong.urdf").write_text(text)
    files = ("-r", robot.path, "-m", tmp_path / "wrong.urdf", "-o", tmp_path / "out")
    assert words in refused(capsys, "replay", tmp_path / "log.npz", *files)
    assert not (tmp_path / "out").exists()


def test_other_orders_and_further_joints_change_nothing(tmp_path: Path) -> None:
    """A gripper's joint is locked, and joints may come in another order."""
    robot = Robot.from_file(write_arm(tmp_path))
    log = arm_log(robot, duration=5)
    root = ET.fromstring(URDF.replace("</robot>", '<link name="finger"/></robot>'))
    finger = ET.SubElement(root, "joint", name="finger", type="prismatic")
    ET.SubElement(finger, "parent", link="base")
    ET.SubElement(finger, "child", link="finger")
    ET.SubElement(finger, "limit", lower="0", upper="1", effort="1", velocity="1")
    ET.ElementTree(root).write(tmp_path / "other.urdf")
    found = replay(log, robot, tmp_path / "other.urdf", EXACT)
    assert any("finger" in note and "locked at zero" in note for note in found.notes)
    own, other = found.models
    assert other.torque == own.torque
    assert other.rollouts == own.rollouts
    moved = replace(
        log,
        joint_names=log.joint_names[::-1],
        **{name: getattr(log, name)[:, ::-1] for name in ("position", "velocity", "acceleration", "torque")},
    )
    again = replay(moved, robot, tmp_path / "other.urdf", EXACT)
    assert again.models[0].torque == own.torque


MJCF = """<mujoco><default><joint damping="0.3" frictionloss="0.2"/></default>
<worldbody><body name="a"><joint name="hinge"/><inertial mass="1" pos="0 0 .1" diaginertia=".1 .1 .1"/></body>
</worldbody><actuator><dcmotor joint="hinge" input="none" motorconst="0 0" resistance="1" gear="{}"
lugre="1000 1 1 1.5 0.1"/></actuator></mujoco>"""


@pytest.mark.parametrize("gear", [1, 2])
def test_a_lugre_motor_is_stribeck_friction(gear: int, tmp_path: Path) -> None:
    (tmp_path / "model.xml").write_text(MJCF.format(gear))
    found = read_friction(tmp_path / "model.xml")[0]["hinge"]
    assert found.coulomb == pytest.approx(0.2 + gear * 1.0)
    assert found.rise == pytest.approx(gear * 0.5)
    assert found.stribeck_velocity == pytest.approx(0.1 / gear)
