"""Models and logs with the faults that public ones have: `init` finds feet, and leads to friction with `identify`."""

from pathlib import Path

import numpy as np
import pytest
from tests.cli.test_cli import run
from tests.mujoco_arm import JOINTS, friction, record, urdf

from stribeck.check.init.model import read_model
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
    text, words = FAULTS[case]
    (tmp_path / "arm.urdf").write_text(text)
    more = [f"camera_{k}" for k in range(3)]  # joints that the model lacks
    wide = {name: np.pad(own, ((0, 0), (0, 3))) for name, own in recorded.items() if own.ndim == 2}
    np.savez(tmp_path / "log.npz", **recorded | wide, joint_names=np.array([*JOINTS, *more]))
    monkeypatch.chdir(tmp_path)
    assert run("init", "arm.urdf", "log.npz") == 0
    told = capsys.readouterr().out
    assert words in told
    if case == "tool":
        (asked,) = (line for line in told.splitlines() if "camera_0, camera_1, camera_2" in line)
        assert "which of them are finger 1, finger 2?" in asked
        assert "TODO: the log lacks finger 1, finger 2; at which positions" in told
        assert "# free and planar joints are locked: changer." in Path("robot.toml").read_text()
    assert run("identify", "log.npz", "-r", "robot.toml", "-o", "out", "--method", "curve-fit") == 0
    for name, truth in zip(JOINTS, friction(np.ones(3)), strict=True):
        joint = read_result("out/result.json").joints[name]
        assert joint.verdict == "identified"
        assert joint.friction(1.0) == pytest.approx(truth, rel=0.05)


def test_balls_at_the_lower_ends_of_limbs_are_the_feet_of_a_model_without_feet(tmp_path: Path) -> None:
    ball = '<geom size=".02" pos="0 0 -.2"/><geom size=".02" pos="0 0 -.2" group="2"/>'
    limbs = "".join(
        f'<body name="{name}" pos="{place}"><joint/><geom type="capsule" size=".01 .1"/>'
        f'<body name="{name} end" pos="0 0 -.2"><joint/><geom type="capsule" size=".01 .1"/>{end}</body></body>'
        for name, place, end in (("arm", "0 0 .5", ball), ("left", "0 .1 0", ball), ("right", "0 -.1 0", ball))
    )
    root = f'<body name="trunk"><freejoint/><geom size=".1"/>{limbs}</body>'
    (tmp_path / "robot.xml").write_text(f"<mujoco><worldbody>{root}</worldbody></mujoco>")
    feet = {foot.name: (foot.frame, foot.kind) for foot in read_model(tmp_path / "robot.xml").feet}
    assert feet == {"left": ("left end", "point"), "right": ("right end", "point")}
