"""The nearest friction of a form: the friction itself where the form has all of it, else no other is nearer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.export.found import found_in, joint_result
from tests.export.test_export import robot_of

from stribeck import export
from stribeck.errors import SettingsError
from stribeck.export.forms import Form, loaded, nearest, plain, stribeck
from stribeck.export.joints import joint_terms
from stribeck.result import JointResult

PLAIN, STRIBECK, LOADED = plain(), stribeck(), loaded()
SIZES = st.floats(0.01, 10.0)
LAW = {"viscous": "N m s/rad", "coulomb": "N m", "stribeck_gain": "1", "stribeck_velocity": "rad/s", "offset": "N m"}


def joint(law: str = "auto", **values: float) -> JointResult:
    return replace(joint_result({name: (value, LAW.get(name, "1")) for name, value in values.items()}), law=law)


@given(SIZES, SIZES, st.floats(-3.0, 3.0))
def test_coulomb_and_viscous_friction_are_said_as_they_are(coulomb: float, viscous: float, offset: float) -> None:
    found = nearest(joint(coulomb=coulomb, viscous=viscous, offset=offset), PLAIN)
    assert [found.numbers[name] for name in PLAIN.numbers] == pytest.approx([coulomb, viscous])
    assert found.numbers["static"] == pytest.approx(coulomb)
    assert found.remains == pytest.approx(0.0, abs=1e-9)


@given(SIZES, SIZES, st.floats(0.1, 2.0), st.floats(0.1, 0.5))
def test_a_stribeck_effect_is_said_as_it_is_or_by_the_nearest(
    coulomb: float, viscous: float, S: float, vs: float
) -> None:
    effect = joint(coulomb=coulomb, viscous=viscous, stribeck_gain=S, stribeck_velocity=vs, offset=0.0)
    found = nearest(effect, STRIBECK)
    assert found.numbers["stribeck"] == pytest.approx(coulomb * S)
    assert found.share == pytest.approx(0.0, abs=1e-9)
    other = nearest(effect, PLAIN)
    assert 0 < other.share < 1
    speeds = np.linspace(-1.0, 1.0, 2001)
    friction = effect.friction(speeds)

    def off(Fc: float, Fv: float) -> float:
        return float(np.mean((friction - Fc * np.sign(speeds) - Fv * speeds) ** 2))

    best = off(other.numbers["coulomb"], other.numbers["viscous"])
    assert best < 1.02 * off(coulomb, viscous)
    assert best < 1.02 * off(coulomb * (1 + S), viscous)


def test_load_is_said_as_it_is_or_at_the_loads_of_the_log() -> None:
    carrying = replace(joint(coulomb=1.0, viscous=0.1, load=0.2, offset=0.0), mean_load=5.0, load_deviation=2.0)
    assert [nearest(carrying, LOADED).numbers[name] for name in LOADED.numbers] == pytest.approx([1.0, 0.1, 0.2])
    found = nearest(carrying, PLAIN)
    assert [found.numbers[name] for name in PLAIN.numbers] == pytest.approx([2.0, 0.1])
    assert found.remains == pytest.approx(0.4)  # the friction of a standard deviation of the load


@pytest.mark.parametrize("form", [plain(coulomb="coulomb", viscous="viscous"), None])
def test_what_builds_up_after_a_reversal_is_left_out_by_name(form: Form | None, tmp_path: Path) -> None:
    bending = replace(joint(coulomb=1.0, viscous=0.1, presliding=0.9, offset=0.0), presliding_travel=0.01)
    robot, _ = robot_of("arm", tmp_path)
    result = replace(found_in(robot, "auto")[0], joints={"elbow": bending})
    terms = joint_terms(result, form)["elbow"]
    assert terms.left_out["presliding"] == (0.9, "1")
    assert "presliding" not in terms.stated | terms.projected
    assert terms.stated["coulomb"][0] == pytest.approx(1.0)
    assert form is None or terms.share == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("form", [PLAIN, STRIBECK, LOADED])
def test_what_repeats_every_turn_remains(form: Form) -> None:
    ripple = replace(
        joint(coulomb=1.0, viscous=0.1, ripple_cosine=0.3, ripple_sine=0.4, offset=0.0), ripple_per_turn=100.0
    )
    found = nearest(ripple, form)
    assert found.numbers["coulomb"] == pytest.approx(1.0, rel=0.02)
    assert found.remains == pytest.approx(0.5 / np.sqrt(2), rel=0.05)


def test_friction_over_position_is_that_of_the_positions_of_the_log() -> None:
    over = joint(coulomb=0.4, viscous=0.1, coulomb_cosine=5.0, coulomb_sine=-1.4, offset=0.0)
    narrow = replace(over, mean_direction=(float(np.cos(0.8)), float(np.sin(0.8))), position_range=(0.75, 0.85))
    found = nearest(narrow, PLAIN)
    assert found.numbers["coulomb"] == pytest.approx(0.4, abs=0.02)
    assert found.share < 0.5
    assert narrow.friction(1.0, position=3.0) == narrow.friction(1.0, position=0.85)


def test_some_joints_weak_ones_and_losses(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    first, second, third = robot.joint_names[:3]
    good = joint(coulomb=1.0, viscous=0.1, stribeck_gain=0.5, stribeck_velocity=0.1, offset=0.0)
    weak = replace(good, verdict="weak", parameters={k: replace(p, verdict="weak") for k, p in good.parameters.items()})
    result = replace(found_in(robot, "auto")[0], joints={first: good, second: weak, third: weak}, corrections=None)
    path = tmp_path / "new.urdf"

    def told(**options: object) -> set[str]:
        path.unlink(missing_ok=True)
        lines = export(result, robot, path, "urdf", **options)  # type: ignore[arg-type]
        return {line.split()[1].rstrip(":") for line in lines if line.startswith("Joint ")}

    assert told() == {first}
    assert told(include_weak=True) == {first, second, third}
    assert told(include_weak=True, joints=[second]) == {second}
    with pytest.raises(SettingsError, match="no joint 'knee'"):
        told(joints=["knee"])
    with pytest.raises(SettingsError, match="has stribeck_gain, stribeck_velocity, offset, which urdf cannot say"):
        told(strict=True)
    assert not path.exists()


def test_numbers_have_the_digits_that_their_errors_support(tmp_path: Path) -> None:
    robot, _ = robot_of("arm", tmp_path)
    sharp = joint(law="coulomb-viscous", coulomb=1.23456789, viscous=0.123456789, offset=0.0)
    result = replace(found_in(robot)[0], joints={robot.joint_names[0]: sharp}, corrections=None)
    export(result, robot, tmp_path / "new.urdf", "urdf")
    assert 'friction="1.235" damping="0.123"' in (tmp_path / "new.urdf").read_text()
