"""A joint that moved slowly: at 5 rad/s, exported friction is near the truth, and the summary states the speeds."""

import numpy as np
import pytest
import yaml
from tests.exporters.found import module
from tests.exporters.test_sweep import in_mujoco, in_urdf
from tests.mujoco_arm import JOINTS, friction, record, urdf

from stribeck import Robot, export, identify, read_log
from stribeck.exporters import TARGETS
from stribeck.exporters.forms import nearest

LAW = {"gain": 0.3, "stribeck_velocity": 0.1}
FAST = 5.0
"""Speed beyond the log [rad/s]."""


@pytest.fixture(scope="module", params=[pytest.param(1, marks=pytest.mark.long), 2], ids=["elbow", "wrist"])
def slow(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    """Identify the arm while one joint moves at most at 0.2 rad/s; return that joint, result, robot and folder."""
    folder = tmp_path_factory.mktemp("slow")
    (folder / "arm.urdf").write_text(urdf())
    robot = Robot.from_model(folder / "arm.urdf", base="fixed")
    speed = np.where(np.arange(3) == request.param, 0.2, 2.5)
    np.savez(folder / "log.npz", joint_names=np.array(JOINTS), **record(speed, **LAW))
    result = identify(read_log(folder / "log.npz", robot), robot)
    assert result.joints[JOINTS[request.param]].curve[-1].velocity < 0.3
    return request.param, result, robot, folder


FORMS = {"yaml": "plain", "mjcf": "plain", "lugre": "lugre", "urdf": None, "drake": None}


@pytest.mark.parametrize("target", [*FORMS, "python"])
def test_friction_at_high_speed_is_near_the_truth(slow, target: str) -> None:
    k, result, robot, folder = slow
    name, path = JOINTS[k], folder / f"{target}.xml"
    form = FORMS.get(target)
    kind = "mjcf" if target == "lugre" else target
    lines = export(result, robot, path, kind, friction=form, joints=[name], include_weak=True)
    speeds = np.array([FAST])
    if target == "python":
        found = module(path).friction_torque(name, speeds)
    elif target == "yaml":
        own = yaml.safe_load(path.read_text())["joints"][name]
        found = own["coulomb"] + own["viscous"] * speeds
    else:
        found = (in_mujoco if kind == "mjcf" else in_urdf)(path, name, robot, speeds)
    ratio = float(found[0] / friction(np.full(3, FAST), **LAW)[k])
    assert 0.25 < ratio < 2.0
    (line,) = (line for line in lines if line.startswith(f"Joint {name}: "))
    assert "rad/s, friction is estimated with that of the other joints: " in line
    assert f"Extrapolated beyond the log's speeds, with the other joints: {name}." in lines


@pytest.mark.parametrize("form", [None, "lugre", "plain"])
def test_within_the_log_the_model_has_the_friction_that_was_identified(slow, form: str | None) -> None:
    """At five speeds of each joint: in the inner half of the 95 % interval, or as near as the form comes."""
    _, result, robot, folder = slow
    path = folder / "within.xml"
    export(result, robot, path, "mjcf", friction=form, include_weak=True)
    for name, own in result.joints.items():
        speeds = own.curve[-1].velocity * np.array([0.1, 0.3, 0.5, 0.8, 1.0])
        halves = np.interp(speeds, *np.array([(point.velocity, point.half_width) for point in own.curve]).T)
        loss = nearest(own, TARGETS["mjcf"].forms[form or "lugre"]).largest[0]
        off = np.abs(in_mujoco(path, name, robot, speeds) - own.friction(speeds))
        assert np.all(off <= np.maximum(halves / 2, 1.01 * loss))
