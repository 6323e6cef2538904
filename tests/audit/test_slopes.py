"""Contacts are compared with the heights of feet above a slope, as above level ground."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.models import example_robot
from tests.trotting import HEIGHT, OUTER, SIDES, leg_angles

from stribeck import RobotLog
from stribeck.audit import base, gather
from stribeck.audit.base import check_contacts
from stribeck.base.finding import Finding
from stribeck.friction_torque.preparation import prepare

ROBOT = example_robot("go2")
FEET = tuple(ROBOT.contacts)
RIGHT = FEET.index("RR")


def stepping(degrees: float, direction: float) -> RobotLog:
    """Make a log of a robot that stands on a slope, and lifts its right rear foot 0.1 m behind the left one."""
    time = np.arange(0.0, 8.0, 0.005)
    lift = np.maximum(0.0, np.sin(np.pi * time))  # four steps
    feet = np.stack([np.tile([0.0, side * OUTER, -HEIGHT], (len(time), 1)) for side in SIDES])
    feet[3, :, 0] -= 0.1
    feet[3, :, 2] += 0.06 * lift
    angles = [[leg_angles(foot, side) for foot in leg] for leg, side in zip(feet, SIDES, strict=True)]
    order = [("FL", "FR", "RL", "RR").index(name.split("_")[0]) for name in ROBOT.joint_names[::3]]
    position = np.hstack([np.array(angles[leg]) for leg in order])
    contact = np.ones((len(time), 4), dtype=bool)
    contact[:, RIGHT] = lift < 0.02
    slope = Rotation.from_euler("ZY", [direction, -degrees], degrees=True)  # the base is parallel to the slope
    heading = slope * Rotation.from_euler("Z", -direction, degrees=True)
    generator = np.random.default_rng(0)
    return RobotLog(
        time=time,
        joint_names=ROBOT.joint_names,
        position=position,
        torque=generator.normal(size=position.shape),
        base_orientation=np.tile(heading.as_quat(), (len(time), 1)),
        foot_names=FEET,
        contact=contact,
    )


def found(log: RobotLog) -> list[Finding]:
    return check_contacts(gather(prepare(log, ROBOT, ROBOT.settings), ROBOT, ROBOT.settings))


@pytest.mark.parametrize(("degrees", "direction"), [(0, 0), (10, 0), (-10, 0), (10, 30), (20, 180)])
def test_a_slope_is_no_wrong_contact_and_hides_none(
    degrees: float, direction: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = stepping(degrees, direction)
    assert log.contact is not None
    assert found(log) == []
    stuck = found(replace(log, contact=np.ones_like(log.contact)))
    assert [each.check for each in stuck] == ["contact-stuck"]
    assert "RR is logged as standing, but is above another standing foot" in stuck[0].text
    monkeypatch.setattr(base, "SLOPE", -1.0)  # all ground is level
    uphill = degrees * np.cos(np.deg2rad(direction)) > 0  # the left rear foot is above the right one
    assert bool(found(log)) == uphill
