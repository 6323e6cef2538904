"""Comparison of two results, and of left and right joints, which are matched by name."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from tests.result.made import estimate, joint, point, result

from stribeck.app.comparison import compare, compare_sides, holm
from stribeck.core.result import ParameterEstimate, Result
from stribeck.core.result.mirror import mirror_name, mirrored_pairs

SPEEDS = (0.1, 0.5, 1.0)


def arm(path: str, factors: Sequence[float], half: float = 0.01, law: str = "coulomb-viscous") -> Result:
    """Make a result of joints with 2 N m + 0.5 N m s/rad times a factor, known within a share of the value."""
    joints = {}
    for k, by in enumerate(factors):
        curve = tuple(point(v, by * (2 + 0.5 * v), half * by * (2 + 0.5 * v)) for v in SPEEDS)
        parameters = {"coulomb": estimate(2 * by, half * by), "viscous": estimate(0.5 * by, half * by)}
        joints[f"j{k}"] = joint(
            parameters | {"offset": estimate(by, 1e-6), "slope": estimate(by**9, 1e-6)}, curve=curve
        )
    return result(law, path, **joints)


def factors(seed: int, joints: int = 6) -> np.ndarray:
    """Draw friction that differs by 0.5 % from log to log."""
    return np.exp(0.005 * np.random.default_rng(seed).standard_normal(joints))


def test_a_change_of_one_joint_is_named_with_its_size_and_nothing_else_in_twenty_seeds() -> None:
    for seed in range(20):
        before, after, changed = (arm(f"{k}.npz", factors(3 * seed + k)) for k in range(3))
        changed = arm("2.npz", factors(3 * seed + 2) * [1, 1, 1, 1.2, 1, 1])
        found = compare(before, changed)
        assert {row.joint for row in found.rows if row.significant} == {"j3"}
        assert re.search(r"1 of 6 joints: j3 \(.* \+(1[789]|2[0123]) %\)\. The smallest significant", found.conclusion)
        unchanged = compare(before, after)
        assert not any(row.significant for row in unchanged.rows)
        assert max(row.smallest for row in unchanged.rows if row.parameter == "friction_middle") < 15
        assert not {row.parameter for row in found.rows} & {"slope", "offset"}


def test_all_joints_together_show_how_much_logs_differ() -> None:
    """A change of 20 % is none between logs whose joints all differ by as much; nor is it known of a single joint."""
    scatter = np.exp(0.15 * np.random.default_rng(3).standard_normal(6))
    assert not any(row.significant for row in compare(arm("a", np.ones(6)), arm("b", scatter)).rows)
    single = compare(arm("a", [1.0]), arm("b", [1.2]))
    assert not any(row.significant for row in single.rows)
    assert all(row.significant for row in compare(arm("a", [1.0]), arm("a", [1.2])).rows)  # of one log


def test_curves_are_compared_at_speeds_that_both_contain() -> None:
    before, after = arm("a.npz", [1.0, 1.0]), arm("b.npz", [1.0, 1.0])
    slower = {
        name: replace(own, curve=tuple(point(v / 2, 2 + 0.25 * v, 0.01) for v in SPEEDS))
        for name, own in after.joints.items()
    }
    rows = [row for row in compare(before, replace(after, joints=slower)).rows if row.velocity is not None]
    assert [row.velocity for row in rows[:3]] == pytest.approx([0.1, 0.375, 0.5])
    np.testing.assert_allclose([row.b - row.a for row in rows], 0, atol=1e-12)


def test_unlike_intervals_use_the_ends_that_face_each_other_and_weak_values_make_no_headline() -> None:
    skewed = ParameterEstimate(value=1.0, standard_error=0.5, interval_95=(0.8, 3.0), unit="1", verdict="weak")
    precise = ParameterEstimate(value=9.0, standard_error=0.0, interval_95=(9.0, 9.0), unit="1", verdict="identified")
    (row,) = compare(result(knee=joint({"coulomb": skewed})), result(knee=joint({"coulomb": precise}))).rows
    assert row.interval_95 == pytest.approx((6.0, 8.2), abs=1e-3)
    assert (row.agrees, row.weak, row.significant) == (False, True, False)


def test_joints_that_cannot_be_compared_are_named_with_the_reason() -> None:
    a = result(knee=joint({"coulomb": 1.0}), hip=joint({"coulomb": 1.0}), neck=joint())
    b = result(knee=joint(), wrist=joint({"coulomb": 1.0}), neck=joint({"coulomb": 1.0}))
    found = compare(a, b)
    assert found.rows == []
    assert found.missing == {
        "hip": "only in the first result",
        "wrist": "only in the second result",
        "knee": "not excited in the second (it <moves> too little)",
        "neck": "not excited in the first (it <moves> too little)",
    }


def test_left_and_right_are_compared_without_what_depends_on_the_axis() -> None:
    left, right = (joint({"coulomb": value, "coulomb_positive": 1.0}) for value in (1.0, 3.0))
    found = compare_sides(result(torso=joint({"coulomb": 5.0}), right_knee=right, left_knee=left))
    assert [(row.joint, row.parameter) for row in found.rows] == [("left_knee | right_knee", "coulomb")]
    assert (found.rows[0].a, found.rows[0].b, found.rows[0].agrees) == (1.0, 3.0, False)


def test_holm_is_stricter_the_more_joints_there_are() -> None:
    assert holm({"a": 0.04}) == {"a": 0.05}
    assert holm({"a": 0.04, "b": 0.5}) == {}
    assert holm({"a": 0.04, "b": 0.02}) == {"b": 0.025, "a": 0.05}  # 0.02 < 0.05 / 2, then 0.04 < 0.05 / 1
    assert list(holm({"a": 0.5, "b": 0.001, "c": 0.03, "d": 0.012})) == ["b", "d"]


def test_where_nothing_changes_one_comparison_in_twenty_has_anything_significant() -> None:
    drawn = 1 + 0.1 * np.random.default_rng(7).normal(size=(800, 3))
    made = [result(**{n: joint({"coulomb": x}) for n, x in zip("abc", own, strict=True)}) for own in drawn.tolist()]
    alarms = sum(any(row.significant for row in compare(*made[k : k + 2]).rows) for k in range(0, 800, 2))
    assert 8 <= alarms <= 33  # Holm's bound is 20


PARTNERS = """leg_left_1_joint leg_right_1_joint, left_hip_pitch_joint right_hip_pitch_joint, FL_hip_joint FR_hip_joint,
RL_calf_joint RR_calf_joint, LF_HAA RF_HAA, lh_kfe rh_kfe, LHipPitch RHipPitch, l_ankle_roll r_ankle_roll,
L_Elbow R_Elbow, hip_abduction_left hip_abduction_right, LeftKnee RightKnee, LEFT_KNEE RIGHT_KNEE, thigh_L thigh_R"""


@pytest.mark.parametrize(("left", "right"), [pair.split() for pair in PARTNERS.split(",")])
def test_partners_of_real_robots(left: str, right: str) -> None:
    names = ["torso", "roll", "roll_joint", "elbow", "panda_joint1", "eebow", right, left]
    assert mirror_name(left, names) == right
    assert mirror_name(right, names) == left
    assert mirrored_pairs(names) == [(left, right)]
