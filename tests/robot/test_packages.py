"""Models in packages are found by name and downloaded by their package; errors are one sentence."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.arm import URDF
from tests.models import EXAMPLES

from stribeck import Robot
from stribeck.core.errors import RobotFileError
from stribeck.core.robot import model_path


def test_a_model_of_example_robot_data_is_found_by_its_file_s_name() -> None:
    assert model_path("package:talos_reduced", Path("x")) == EXAMPLES / "talos_data/robots/talos_reduced.urdf"
    folder = EXAMPLES / "anymal_c_simple_description"
    assert model_path("package:anymal_c_simple_description/anymal", Path("x")).is_relative_to(folder)


def test_robots_are_made_of_packages_by_file_and_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "robot.toml"
    file.write_text("[robot]\nmodel = 'package:ur5_robot'\nbase = 'fixed'\n")
    by_file, by_hand = Robot.from_file(file), Robot.from_model("package:ur5_robot", base="fixed")
    assert by_file.joint_names == by_hand.joint_names
    assert by_file.model_path == by_hand.model_path == str(EXAMPLES / "ur_description/urdf/ur5_robot.urdf")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("talos_reducd", "nearest are .*'package:talos_reduced'"),
        ("go3_description", "nearest are .*'package:go2_description'"),
        ("anymal", "2 models of this name; .* 'anymal_b_simple_description/anymal', 'anymal_c_simple_"),
        ("ur5e_description", "only a xacro file; expected 'package:ur5e_mj_description'"),
        ("??", "no installed package has a model of this name; 'package:talos_reduced' is one"),
    ],
)
def test_models_that_packages_lack_are_refused(name, words, tmp_path, monkeypatch):
    if name == "ur5e_description":
        monkeypatch.setitem(sys.modules, f"robot_descriptions.{name}", SimpleNamespace(XACRO_PATH="ur.xacro"))
    file = tmp_path / "robot.toml"
    file.write_text(f"[robot]\nmodel = 'package:{name}'\n")
    with pytest.raises(RobotFileError, match=words) as caught:
        Robot.from_file(file)
    assert str(caught.value).startswith(f"{file}: [robot] model = package:{name}: ")


@pytest.fixture
def downloads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Redirect downloads of robot_descriptions, and forget its imported module."""
    pytest.importorskip("robot_descriptions")
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "cache"))
    monkeypatch.delitem(sys.modules, "robot_descriptions.go2_description", raising=False)
    return tmp_path


def test_robot_descriptions_downloads_what_it_describes(downloads, monkeypatch, capsys):
    source = downloads / "source"
    model = source / "robots/go2_description/urdf/go2_description.urdf"
    model.parent.mkdir(parents=True)
    model.write_text(URDF)
    git = ["git", "-C", str(source), "-c", "user.name=x", "-c", "user.email=x"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-qm", "x"]):
        subprocess.run([*git, *command], check=True)
    head = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", head)
    monkeypatch.setenv("GIT_CONFIG_COUNT", "1")
    monkeypatch.setenv("GIT_CONFIG_KEY_0", f"url.{source}.insteadOf")
    monkeypatch.setenv("GIT_CONFIG_VALUE_0", "https://github.com/unitreerobotics/unitree_ros.git")
    robot = Robot.from_model("package:go2_description", base="fixed")
    assert robot.joint_names == ("shoulder", "elbow", "slide")
    assert Path(robot.model_path).is_relative_to(downloads / "cache")
    assert capsys.readouterr().out == ""
