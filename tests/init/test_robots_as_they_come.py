"""Models and logs with the faults that public ones have: `init` and `identify` lead to the friction of MuJoCo's arm."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from stribeck.cli import main
from stribeck.result import read_result

STEP = 1e-3
"""Time step of the simulation [s]."""
FRICTION = {"shoulder 1": (1.5, 0.6), "elbow 2": (0.8, 0.3), "wrist 3": (0.4, 0.2)}
"""Coulomb friction [N m] and viscous friction [N m s/rad]."""
INERTIAL = (
    '<inertial><origin xyz="0 0.02 0.2"/>{}<mass value="{}"/><inertia ixx="0.03" {} iyy="0.03" izz="0.01"/></inertial>'
)
ZEROS = 'ixy="0" ixz="0" iyz="0"'


def model(again: str = "", products: str = ZEROS, tool: str = "", limit: str = "") -> str:
    """Make an arm's URDF; the arguments put faults into it."""
    links, joints = '<link name="base link"/>', ""
    for k, (name, axis) in enumerate(zip(FRICTION, ("0 1 0", "1 0 0", "0 1 0"), strict=True)):
        parent = f"link {k}" if k else "base link"
        links += f'<link name="link {k + 1}">{INERTIAL.format(again, 3 - k, products)}</link>'
        joints += (
            f'<joint name="{name}" type="continuous"><origin xyz="0 0 0.4"/>{again}<parent link="{parent}"/>'
            f'<child link="link {k + 1}"/><axis xyz="{axis}"/>{limit}</joint>'
        )
    return f'<robot name="arm">{links}{joints}{tool}</robot>'


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
    """Record an arm that follows sums of sines; torques are those of the motors."""
    spec = mujoco.MjSpec.from_string(model())
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for name, (coulomb, viscous) in FRICTION.items():
        joint = spec.joint(name)
        joint.armature, joint.frictionloss, joint.damping = 0.05, coulomb, [viscous, 0, 0]
        joint.solimp_friction, joint.solref_friction = [0.99, 0.999, 0.001, 0.5, 2], [0.005, 1]
    arm = spec.compile()
    data, time = mujoco.MjData(arm), np.arange(0, 10, STEP)
    omega = np.random.default_rng(0).uniform(1.5, 5.0, (4, 3))
    goal = np.sum(0.9 / omega * np.sin(omega * time[:, None, None]), axis=1)
    rows = []
    for target in goal:
        torque = 200 * (target - data.qpos) - 20 * data.qvel + data.qfrc_bias
        data.qfrc_applied[:] = torque
        mujoco.mj_forward(arm, data)
        rows.append([data.qpos.copy(), data.qvel.copy(), torque])
        mujoco.mj_step(arm, data)
    position, velocity, torque = np.swapaxes(np.array(rows)[::5], 0, 1)
    noise = np.random.default_rng(1).normal(size=torque.shape)
    return {"time": time[::5], "position": position, "velocity": velocity, "torque": torque + 0.02 * noise}


FAULTS = {
    "two places": (model(again='<origin xyz="1 1 1"/>'), "Warning: arm.urdf: the first of repeated elements is used: "),
    "products": (model(products=""), "Warning: arm.urdf: missing products of inertia are set to zero: ixy of link"),
    "limits": (model(limit='<limit lower="-2" upper="2"/>'), "Warning: arm.urdf: position limits of continuous joints"),
    "tool": (model(tool=TOOL), "Warning: arm.urdf: mimic joints are treated as independent: finger 2"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_friction_is_found(
    case: str,
    recorded: dict[str, np.ndarray],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def run(*words: str) -> None:
        monkeypatch.setattr("sys.argv", ["stribeck", *words])
        with pytest.raises(SystemExit, match="0"):
            main()

    text, words = FAULTS[case]
    (tmp_path / "arm.urdf").write_text(text)
    more = [f"camera_{k}" for k in range(3)]  # joints that the model lacks
    wide = {name: np.pad(own, ((0, 0), (0, 3))) for name, own in recorded.items() if own.ndim == 2}
    np.savez(tmp_path / "log.npz", **recorded | wide, joint_names=np.array([*FRICTION, *more]))
    monkeypatch.chdir(tmp_path)
    run("init", "arm.urdf", "log.npz")
    told = capsys.readouterr().out
    assert words in told
    (asked,) = (line for line in told.splitlines() if "camera_0, camera_1, camera_2" in line)
    if case == "tool":
        assert "which of them are finger 1, finger 2?" in asked
        assert "TODO: the log lacks finger 1, finger 2; at which positions" in told
        assert "# free and planar joints are locked: changer." in Path("robot.toml").read_text()
    run("identify", "log.npz", "-r", "robot.toml", "-o", "out")
    for name, (coulomb, viscous) in FRICTION.items():
        joint = read_result("out/result.json").joints[name]
        assert joint.verdict == "identified"
        assert joint.friction(1.0) == pytest.approx(coulomb + viscous, rel=0.05)
