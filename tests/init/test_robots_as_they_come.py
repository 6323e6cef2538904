"""Models and logs with the faults that public ones have: `init` and `identify` lead to the friction of MuJoCo's arm."""

from pathlib import Path

import numpy as np
import pytest
from tests.mujoco_arm import JOINTS, friction, record, urdf

from stribeck.app.cli import main
from stribeck.core.result import read_result

TOOL = (
    '<link name="gripper"><visual><geometry><mesh filename="package://missing/gripper.stl"/></geometry></visual></link>'
    '<joint name="changer" type="floating"><parent link="link 3"/><child link="gripper"/></joint><link name="sensor"/>'
    '<joint name="mount" type="fixed"><parent link="link 3"/><child link="sensor"/></joint>'
    + "".join(
        f'<link name="finger {k}"/><joint name="finger {k}" type="prismatic"><parent link="gripper"/>{mimic}'
        f'<child link="finger {k}"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="9" velocity="1"/></joint>'
        for k, mimic in ((1, ""), (2, '<mimic joint="finger 1"/>'))
    )
)


@pytest.fixture(scope="module")
def recorded() -> dict[str, np.ndarray]:
    """Record the arm; the torques are those of the motors."""
    return record(speed=(2.0, 2.0, 2.0))


FAULTS = {
    "limits": (urdf(limit='<limit lower="-2" upper="2"/>'), "Warning: arm.urdf: position limits of continuous joints"),
    "tool": (urdf(tool=TOOL), "Warning: arm.urdf: mimic joints are treated as independent: finger 2"),
}


@pytest.mark.parametrize("case", [pytest.param("limits", marks=pytest.mark.long), "tool"])
def test_friction_is_found(case, recorded, tmp_path, capsys, monkeypatch):
    def run(*words: str) -> None:
        monkeypatch.setattr("sys.argv", ["stribeck", *words])
        with pytest.raises(SystemExit, match="0"):
            main()

    text, words = FAULTS[case]
    (tmp_path / "arm.urdf").write_text(text)
    more = [f"camera_{k}" for k in range(3)]  # joints that the model lacks
    wide = {name: np.pad(own, ((0, 0), (0, 3))) for name, own in recorded.items() if own.ndim == 2}
    np.savez(tmp_path / "log.npz", **recorded | wide, joint_names=np.array([*JOINTS, *more]))
    monkeypatch.chdir(tmp_path)
    run("init", "arm.urdf", "log.npz")
    told = capsys.readouterr().out
    assert words in told
    if case == "tool":
        (asked,) = (line for line in told.splitlines() if "camera_0, camera_1, camera_2" in line)
        assert "which of them are finger 1, finger 2?" in asked
        assert "TODO: the log lacks finger 1, finger 2; at which positions" in told
        assert "# free and planar joints are locked: changer." in Path("robot.toml").read_text()
    run("identify", "log.npz", "-r", "robot.toml", "-o", "out", "--method", "curve-fit")
    for name, truth in zip(JOINTS, friction(np.ones(3)), strict=True):
        joint = read_result("out/result.json").joints[name]
        assert joint.verdict == "identified"
        assert joint.friction(1.0) == pytest.approx(truth, rel=0.05)
