"""What the command line prints of a result."""

from dataclasses import replace

import pytest
from tests.report.conftest import build_result
from tests.result.made import point

from stribeck.cli import console
from stribeck.result import Result, TorqueR2
from stribeck.result.tables import advice

LONG = "left_arm_shoulder_abduction_joint"


@pytest.fixture(scope="module")
def found() -> Result:
    result = build_result(duration=8.0)
    curve = tuple(point(velocity, 1.0, 0.2) for velocity in (0.1, 0.5, 1.0))
    names = dict(zip(result.joints, (LONG, *list(result.joints)[1:]), strict=True))
    joints = {names[name]: replace(joint, curve=curve) for name, joint in result.joints.items()}
    last = list(joints)[-2]
    joints[last] = replace(joints[last], verdict="no friction", reason="no friction detected, below 1.2 N m")
    joints[LONG] = replace(joints[LONG], torque_r2=TorqueR2(nominal=0.5, corrected=0.987))
    return replace(result, joints=joints)


@pytest.mark.parametrize("width", [70, 80, 120, 160])
@pytest.mark.parametrize("law", ["stribeck", "auto"])
def test_no_joint_s_name_is_cut_or_broken(found, monkeypatch, capsys, width: int, law: str) -> None:
    monkeypatch.setattr(console, "PLAIN_WIDTH", width)
    console.print_result(replace(found, law=law))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    assert "…" not in "".join(lines)
    for name in found.joints:
        assert any(name in line for line in lines)


def test_a_joint_has_one_line_with_friction_fit_verdict_and_what_to_do(found, capsys) -> None:
    console.print_result(replace(found, law="auto"))
    lines = capsys.readouterr().out.splitlines()
    line = next(line for line in lines if LONG in line)
    assert all(f"1.0 ± 0.2 at {speed}" in line for speed in ("0.1", "0.5", "1"))
    assert "0.987" in line
    assert found.joints[LONG].verdict in line
    assert advice(found.joints[LONG]) in line
    folded = next(line for line in lines if "below 1.2 N m" in line)
    assert folded.startswith("friction below the resolution of the log: ")
