"""Robots whose feet do not step: joints whose equations need no contact are identified all the same."""

import pytest
from tests.standing import UPPER, still_humanoid

from stribeck import identify


def worst_error(result, truth, joints) -> float:
    """The largest relative error of the curves of some joints."""
    return max(
        abs(point.value / (truth[joint][0] + truth[joint][1] * point.velocity) - 1)
        for joint in joints
        for point in result.joints[joint].curve
    )


@pytest.mark.parametrize("kind", ["stand", "squat"])
def test_arms_and_trunk_are_identified_while_both_feet_stand(kind, tmp_path) -> None:
    truth = still_humanoid(tmp_path, kind)
    result = identify(tmp_path / "log.npz", tmp_path / "robot.toml")
    verdicts = {joint: result.joints[joint].verdict for joint in truth}
    assert verdicts == {joint: "identified" if joint in UPPER else "not excited" for joint in truth}
    assert worst_error(result, truth, UPPER) < 0.03
    assert "lift one foot at a time" in result.joints["left_knee"].reason
