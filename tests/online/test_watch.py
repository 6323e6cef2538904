"""`stribeck watch` as a user types it, and the ROS 2 node."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.arm import save_npz, write_arm
from tests.log.readers.messages import STORE, blank, messages_of, write_messages
from tests.online.service import elbow, same, stream
from typer.testing import CliRunner

from stribeck import Result, Robot
from stribeck.app.cli.app import app

NODE = Path(__file__).parents[2] / "examples" / "ros2" / "friction_watch.py"


@pytest.fixture(scope="module")
def folder(robot: Robot, result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the robot, its result, and logs of a sound and a worn arm."""
    place = tmp_path_factory.mktemp("service")
    write_arm(place)
    result.save(place / "result.json")
    sound = stream(robot, 20.0, same)
    save_npz(sound, place / "sound.npz", time=sound.time + 1000.0)
    write_messages(place / "log.mcap", messages_of(sound))
    save_npz(stream(robot, 100.0, elbow(lambda time: 0.8 * (time > 70))), place / "worn.npz")
    return place


@pytest.fixture(scope="module")
def worn(folder: Path) -> list[dict[str, Any]]:
    """Lines printed for the worn arm, whose state is saved, too."""
    printed = watch(folder, "--log", folder / "worn.npz", "--json", "--state", folder / "state.json")
    return [json.loads(line) for line in printed.splitlines()]


def words(folder: Path, *arguments: object) -> list[str]:
    return [str(word) for word in ("watch", folder / "result.json", "--robot", folder / "robot.toml", *arguments)]


def watch(folder: Path, *arguments: object) -> str:
    found = CliRunner().invoke(app, words(folder, *arguments), catch_exceptions=False)
    assert found.exit_code == 0
    return found.output


def test_a_sound_arm_has_a_table_without_alarm(folder: Path) -> None:
    printed = watch(folder, "--log", folder / "sound.npz")
    assert "elbow" in printed
    assert re.search(r"Alarms: 0 after (19|20) s", printed)  # from the start of the log, whose stamps start at 1000 s
    assert watch(folder, "--log", folder / "sound.npz", "--quiet") == ""


def test_a_worn_elbow_is_reported_once_and_its_state_once_per_second(worn: list[dict[str, Any]]) -> None:
    alarms = [line["alarm"] for line in worn if "alarm" in line]
    states = [line for line in worn if "joints" in line]
    assert [alarm["name"] for alarm in alarms] == ["elbow"]
    assert 70 < alarms[0]["time"] < 90
    assert len(states) == pytest.approx(100, abs=3)
    elbow_now = states[-1]["joints"]["elbow"]
    assert elbow_now["alarm"]
    assert elbow_now["friction"] > 1.2 * elbow_now["baseline"]


def test_a_stream_from_standard_input_has_the_state_of_the_log(folder: Path) -> None:
    program = [sys.executable, "-m", "stribeck", *words(folder, "--mcap", "-", "--json")]
    with (folder / "log.mcap").open("rb") as file:
        found = subprocess.run(program, stdin=file, capture_output=True, text=True, check=True)
    last = json.loads(found.stdout.splitlines()[-1])
    log = json.loads(watch(folder, "--log", folder / "sound.npz", "--json").splitlines()[-1])
    assert last["time"] == pytest.approx(20.0, abs=1.5)
    for name, own in last["joints"].items():
        assert own["friction"] == pytest.approx(log["joints"][name]["friction"], rel=0.1)


def test_the_ros_node_publishes_an_alarm(robot: Robot, folder: Path) -> None:
    node = runpy.run_path(str(NODE))
    monitor = node["FrictionMonitor"](folder / "result.json", folder / "robot.toml", 100.0)
    worn_arm = stream(robot, 100.0, elbow(lambda time: 0.8 * (time > 70)))
    alarms = [line for *_, message in messages_of(worn_arm) for line in monitor.joint_state(message)]
    assert len(alarms) == 1
    assert alarms[0].startswith("elbow: friction +")
    names = ("DiagnosticArray", "DiagnosticStatus", "KeyValue")
    types = SimpleNamespace(PLAIN_LEVEL=True, **{name: STORE.types[f"diagnostic_msgs/msg/{name}"] for name in names})
    array = monitor.diagnostics(types, blank("std_msgs/msg/Header"))
    sent = STORE.serialize_cdr(array, "diagnostic_msgs/msg/DiagnosticArray")
    read: Any = STORE.deserialize_cdr(sent, "diagnostic_msgs/msg/DiagnosticArray")
    assert [status.level for status in read.status] == [0, 1, 0]
    assert read.status[1].message == alarms[0]
    assert {own.key for own in read.status[0].values} >= {"friction", "low", "high", "identified"}
    assert np.isfinite([float(own.value) for own in read.status[1].values]).all()
