"""Comparison of two results, and of left and right joints, which are matched by name."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.result.made import estimate, joint, point, result

from stribeck.result import ParameterEstimate
from stribeck.result.compare import compare, compare_sides, holm
from stribeck.result.mirror import mirror_name, mirrored_pairs


def test_a_difference_is_b_minus_a_in_standard_errors() -> None:
    old = result(path="a.npz", knee=joint({"coulomb": estimate(2.0, 0.3)}))
    found = compare(old, result(path="b.npz", knee=joint({"coulomb": estimate(3.0, 0.4)})))
    (row,) = found.rows
    assert (found.a, found.b, row.a, row.b, row.difference) == ("a.npz", "b.npz", 2.0, 3.0, 1.0)
    assert row.z_score == pytest.approx(2.0)
    assert row.interval_95 == pytest.approx((0.0, 2.0))
    assert json.loads(found.to_json())["rows"][0]["parameter"] == "coulomb"


def test_friction_of_two_logs_differs_without_a_change_and_of_one_log_does_not() -> None:
    """Coulomb friction is 20 % larger, ± 1 %; friction differs by up to 25 % from log to log, rotors do not."""
    own = replace(point(1.0, 2.0, 0.0), interval_next_log=(1.5, 2.5))
    for path, agrees in (("may.npz", False), ("june.npz", True)):
        before, after = (
            result(path=name, knee=joint({"coulomb": one, "armature": replace(one, unit="kg m^2")}, curve=(own,)))
            for name, one in (("may.npz", estimate(2.0, 0.01)), (path, estimate(2.4, 0.01)))
        )
        coulomb, armature = compare(before, after).rows
        assert (coulomb.agrees, coulomb.significant) == (agrees, not agrees)
        assert armature.significant


values = st.floats(0.1, 10)


@given(a=values, b=values, error_a=values, error_b=values)
def test_swapping_the_results_swaps_the_sign(a: float, b: float, error_a: float, error_b: float) -> None:
    one, other = (result(knee=joint({"coulomb": estimate(*each)})) for each in ((a, error_a), (b, error_b)))
    there, back = compare(one, other).rows[0], compare(other, one).rows[0]
    assert there.difference == -back.difference
    np.testing.assert_allclose(there.interval_95, [-back.interval_95[1], -back.interval_95[0]], atol=1e-12)
    assert there.z_score == pytest.approx(-back.z_score)


def test_unlike_intervals_use_the_ends_that_face_each_other() -> None:
    skewed = ParameterEstimate(value=1.0, standard_error=0.5, interval_95=(0.8, 3.0), unit="1", verdict="weak")
    precise = ParameterEstimate(value=2.0, standard_error=0.0, interval_95=(2.0, 2.0), unit="1", verdict="identified")
    (row,) = compare(result(knee=joint({"s": skewed})), result(knee=joint({"s": precise}))).rows
    assert row.interval_95 == pytest.approx((-1.0, 1.2))
    assert row.agrees
    assert row.weak


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
    left, right = (joint({"coulomb": value, "offset": 1.0}) for value in (1.0, 3.0))
    found = compare_sides(result(torso=joint({"coulomb": 5.0}), right_knee=right, left_knee=left))
    assert [(row.joint, row.parameter) for row in found.rows] == [("left_knee | right_knee", "coulomb")]
    assert (found.rows[0].a, found.rows[0].b, found.rows[0].agrees) == (1.0, 3.0, False)


def test_holm_is_stricter_the_more_tests_there_are() -> None:
    assert holm([0.04]) == [True]
    assert holm([0.04, 0.5]) == [False, False]
    assert holm([0.04, 0.02]) == [True, True]  # 0.02 < 0.05 / 2, then 0.04 < 0.05 / 1
    assert holm([0.5, 0.001, 0.03, 0.012]) == [False, True, False, True]
    same = {name: joint({"coulomb": 1.0}) for name in ("hip", "neck", "toe")}
    old, new = result(knee=joint({"coulomb": 1.0})), result(knee=joint({"coulomb": 1.29}))
    assert [row.significant for row in compare(old, new).rows] == [True]
    many = compare(replace(old, joints={**old.joints, **same}), replace(new, joints={**new.joints, **same}))
    assert [row.significant for row in many.rows] == [False] * 4


def test_where_nothing_changes_one_comparison_in_twenty_has_anything_significant() -> None:
    generator = np.random.default_rng(7)
    alarms = 0
    for _ in range(400):
        a, b = (
            result(knee=joint(dict(zip("xyz", own.tolist(), strict=True))))
            for own in 1 + 0.1 * generator.normal(size=(2, 3))
        )
        alarms += any(row.significant for row in compare(a, b).rows)
    assert 8 <= alarms <= 33  # Holm's bound is 20


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("leg_left_1_joint", "leg_right_1_joint"),
        ("left_hip_pitch_joint", "right_hip_pitch_joint"),
        ("FL_hip_joint", "FR_hip_joint"),
        ("RL_calf_joint", "RR_calf_joint"),
        ("LF_HAA", "RF_HAA"),
        ("lh_kfe", "rh_kfe"),
        ("LHipPitch", "RHipPitch"),
        ("l_ankle_roll", "r_ankle_roll"),
        ("L_Elbow", "R_Elbow"),
        ("hip_abduction_left", "hip_abduction_right"),
        ("LeftKnee", "RightKnee"),
        ("LEFT_KNEE", "RIGHT_KNEE"),
        ("thigh_L", "thigh_R"),
    ],
)
def test_partners_of_real_robots(left: str, right: str) -> None:
    names = ["torso", "roll", "joint_1", right, left]
    assert mirror_name(left, names) == right
    assert mirror_name(right, names) == left
    assert mirrored_pairs(names) == [(left, right)]


@pytest.mark.parametrize("name", ["torso", "roll_joint", "elbow", "panda_joint1", "shoulder_lift_joint", "left_hip"])
def test_joints_without_a_partner(name: str) -> None:
    assert mirror_name(name, [name, "right_knee", "eebow"]) is None


def test_a_quadruped_pairs_its_legs_sideways() -> None:
    legs = [f"{leg}_calf" for leg in ("FR", "FL", "RR", "RL")]
    assert mirrored_pairs(legs) == [("FL_calf", "FR_calf"), ("RL_calf", "RR_calf")]


words = st.sampled_from(["left", "right", "l", "r", "L", "R", "hip", "Knee", "_", "1", "FL", "FR", "RL", "RR"])


@given(names=st.lists(st.lists(words, min_size=1, max_size=4).map("_".join), unique=True, max_size=12))
def test_a_partner_is_another_name_of_the_list(names: list[str]) -> None:
    for name in names:
        assert mirror_name(name, names) in {None, *names} - {name}
    members = [name for pair in mirrored_pairs(names) for name in pair]
    assert len(members) == len(set(members)) or any(mirror_name(mirror_name(n, names), names) != n for n in members)
