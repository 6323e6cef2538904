"""What works without the extra `simulation`, and what is said where it does not; and the package's lazy names."""

import subprocess
import sys
from pathlib import Path

import pytest
from tests.arm import arm_log, save_npz, write_arm

import stribeck
from stribeck_simulation.demo import SCENARIO

WITHOUT = (
    "import sys; sys.modules.update(mujoco=None, daqp=None, matplotlib=None); from stribeck.cli import main; main()"
)


def light(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run the command line where neither MuJoCo, a QP solver nor Matplotlib is installed."""
    command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_urdf_needs_no_simulation(tmp_path: Path) -> None:
    robot = write_arm(tmp_path)
    log = save_npz(arm_log(stribeck.Robot.from_file(robot), duration=6, rate=250), tmp_path / "log.npz")
    done = light("identify", log, "-r", robot, "-o", tmp_path / "out", "--method", "curve-fit")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out/report.html").is_file()


@pytest.mark.parametrize("command", [["demo"], ["simulate", SCENARIO]])
def test_simulation_needs_its_extra(command: list[object], tmp_path: Path) -> None:
    done = light(*command, "-o", tmp_path / "log.npz")
    assert done.returncode == 2
    assert done.stderr == "stribeck: simulation needs mujoco and daqp: pip install 'stribeck[simulation]'\n"
    assert not list(tmp_path.iterdir())
