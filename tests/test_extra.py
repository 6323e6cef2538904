"""Another package adds a reader, a law and an export target by entry points."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from tests import extra
from tests.arm import arm_log, write_arm

from stribeck import Robot, read_result


def test_a_package_adds_a_reader_a_law_and_a_target(tmp_path: Path) -> None:
    information = tmp_path / "site/extra-1.0.dist-info"
    information.mkdir(parents=True)
    shutil.copy(extra.__file__, tmp_path / "site")
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: extra\nVersion: 1.0\n")
    groups = (f"[stribeck.{group}]\n{point}\n" for group, point in extra.POINTS.items())
    (information / "entry_points.txt").write_text("".join(groups))
    robot = Robot.from_file(write_arm(tmp_path))
    arm_log(robot, 8.0, 250.0).to_frame().to_csv(tmp_path / "log.txt", index=False)

    def run(*arguments: str) -> None:
        path = {"PYTHONPATH": str(tmp_path / "site")}
        subprocess.run([sys.executable, "-m", "stribeck", *arguments], cwd=tmp_path, check=True, env=os.environ | path)

    run("identify", "log.txt", "-r", "robot.toml", "--law", "quadratic", "-o", "out", "-q")
    assert set(read_result(tmp_path / "out").joints["elbow"].values) >= {"coulomb", "drag"}
    run("export", "out", "-r", "robot.toml", "--to", "names", "-o", "names.txt", "-q")
    assert (tmp_path / "names.txt").read_text() == "shoulder elbow slide"
