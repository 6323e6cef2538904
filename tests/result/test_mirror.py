"""Left and right, as the joint names of real robots write them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stribeck.result.mirror import mirror_name, mirrored_pairs


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
