"""The nearest friction of a form: the friction itself where the form has all of it, else no other is nearer."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.exporters.found import FRICTION, joint, joint_result, of_joint, of_joints
from tests.exporters.test_models import assert_same_dynamics, compiled, read_again
from tests.result import made

from stribeck import export
from stribeck.app.exporters.forms import Form, nearest
from stribeck.app.exporters.joints import LEGEND, joint_terms
from stribeck.core.errors import SettingsError

PLAIN = Form(dict.fromkeys(("coulomb", "viscous"), ""))
STRIBECK = Form(dict.fromkeys(("coulomb", "viscous", "stribeck_velocity"), ""))
SIZES = st.floats(0.01, 10.0)


@given(SIZES, SIZES, st.floats(0.1, 2.0), st.floats(0.1, 0.5), st.floats(-3.0, 3.0))
def test_friction_is_exported_exactly_or_by_the_nearest_form(coulomb, viscous, S, vs, offset):
    effect = joint(coulomb=coulomb, viscous=viscous, stribeck_gain=S, stribeck_velocity=vs, offset=0.0)
    simple = joint(coulomb=coulomb, viscous=viscous, offset=offset)
    for own, form, static in ((effect, STRIBECK, coulomb * (1 + S)), (simple, PLAIN, coulomb)):
        found = nearest(own, form)
        expected = {"coulomb": coulomb, "viscous": viscous, "stribeck": coulomb * S, "static": static}
        assert [found.numbers[name] for name in (*form.numbers, "static")] == pytest.approx(
            [expected[name] for name in (*form.numbers, "static")]
        )
        assert found.remains == pytest.approx(0.0, abs=1e-9 * min(found.of, 1.0))
    other = nearest(effect, PLAIN)
    assert 0 < other.remains / other.of < 1
    speeds = np.linspace(-1.0, 1.0, 2001)
    friction = effect.friction(speeds)

    def off(Fc: float, Fv: float) -> float:
        return float(np.mean((friction - Fc * np.sign(speeds) - Fv * speeds) ** 2))

    best = off(other.numbers["coulomb"], other.numbers["viscous"])
    assert best < 1.02 * off(coulomb, viscous)
    assert best < 1.02 * off(coulomb * (1 + S), viscous)


def test_load_acts_on_both_sides_of_a_gear() -> None:
    own = replace(joint(coulomb=1.0, viscous=0.1, load=0.08, offset=0.0), mean_load=2.0, load_deviation=1.0)
    found = nearest(own, Form(dict.fromkeys(("coulomb", "viscous", "gear_load"), "")))
    assert [found.numbers["gear_load"], found.remains] == pytest.approx([0.04, 0.0], abs=1e-9)


def test_rounding_hardly_changes_the_friction_at_top_speed(tmp_path: Path) -> None:
    fast = joint(coulomb=1.2345678, viscous=0.12345678)
    fast = replace(fast, curve=[made.point(speed, 2.0, 0.02) for speed in (2.0, 10.0, 20.0)])
    (terms,) = joint_terms(of_joint(fast, tmp_path)[0], PLAIN).values()
    assert abs(20 * (terms.plain[1] - 0.12345678)) < 0.1 * fast.curve[-1].standard_error


@pytest.mark.parametrize("form", [Form({"coulomb": "coulomb", "viscous": "viscous"}), None])
def test_what_builds_up_after_a_reversal_is_left_out_by_name(form: Form | None, tmp_path: Path) -> None:
    bending = replace(joint(coulomb=1.0, viscous=0.1, presliding=0.9, offset=0.0), presliding_travel=0.01)
    (terms,) = joint_terms(of_joint(bending, tmp_path)[0], form).values()
    assert terms.left_out["presliding"] == (0.9, "1")
    assert "presliding" not in terms.stated | terms.projected
    assert terms.stated["coulomb"][0] == pytest.approx(1.0)
    assert form is None or terms.fit.share == pytest.approx(0.0, abs=1e-9)


def test_the_mean_over_positions_is_the_identified_curve() -> None:
    """Also of a joint that spends most of its time at one end of its range."""
    over = joint(coulomb=1.0, viscous=0.1, coulomb_cosine=0.9, coulomb_sine=0.4, load=0.1, offset=0.0)
    uneven = replace(over, mean_direction=(0.6, 0.5), position_range=(-0.2, 1.3), mean_load=2.0, load_deviation=3.0)
    found = nearest(uneven, PLAIN)
    assert [found.numbers[name] for name in PLAIN.numbers] == pytest.approx([1.2, 0.1])
    assert found.largest[0] == pytest.approx(0.0, abs=1e-9)
    assert found.remains > 0.1


@pytest.mark.parametrize(("slope", "half"), [(40.0, 0.02), (8.0, 0.2)])
def test_a_sharp_sign_is_within_the_interval_of_a_smooth_one(slope: float, half: float) -> None:
    smooth = joint(coulomb=1.0, viscous=0.3, slope=slope, offset=0.0)
    speeds = np.array([0.1, 0.5, 1.0])
    points = map(made.point, speeds.tolist(), smooth.friction(speeds).tolist(), [half] * 3)
    found = nearest(replace(smooth, curve=tuple(points)), PLAIN)
    written = found.numbers["coulomb"] + found.numbers["viscous"] * speeds
    assert np.abs(written - smooth.friction(speeds)).max() < half


def test_some_joints_weak_ones_and_losses(tmp_path: Path) -> None:
    good = joint(coulomb=1.0, viscous=0.1, stribeck_gain=0.5, stribeck_velocity=0.1, offset=0.0)
    weak = replace(good, verdict="weak", parameters={k: replace(p, verdict="weak") for k, p in good.parameters.items()})
    result, robot = of_joints(tmp_path, good, weak, weak)
    first, second, third = result.joints
    path = tmp_path / "new.urdf"

    def told(**options: object) -> set[str]:
        path.unlink(missing_ok=True)
        export(result, robot, path, "urdf", **options)  # type: ignore[arg-type]
        return set(re.findall("^ *Joint (.*?):", path.read_text(), re.MULTILINE))

    assert told() == {first}
    assert told(include_weak=True) == {first, second, third}
    assert told(include_weak=True, joints=[second]) == {second}
    with pytest.raises(SettingsError, match="no joint 'knee'"):
        told(joints=["knee"])
    with pytest.raises(SettingsError, match="urdf cannot store stribeck_gain, stribeck_velocity of"):
        told(strict=True)
    assert not path.exists()


def test_friction_is_exported_in_the_formats_words_and_losses_are_reported(tmp_path: Path) -> None:
    strong = joint_result({**FRICTION, "armature": (0.05, "kg m^2")}, weak=("viscous",))
    weak = joint_result(FRICTION, weak=("viscous", "coulomb"))
    result, robot = of_joints(tmp_path, strong, weak, joint_result({}))
    names = list(result.joints)
    lines = export(result, robot, tmp_path / "new.urdf", "urdf")
    joints = {joint.get("name"): joint for joint in ET.parse(tmp_path / "new.urdf").getroot().iter("joint")}
    before = {joint.get("name"): joint for joint in ET.parse(robot.model_path).getroot().iter("joint")}
    dynamics = joints[names[0]].find("dynamics")
    assert dynamics.attrib == {"friction": "1.2", "damping": "0.3"}
    for name in names[1:]:
        assert ET.tostring(joints[name]) == ET.tostring(before[name])
    text = (tmp_path / "new.urdf").read_text()
    at = lines.index(LEGEND)
    assert all(line.replace("--", "- -") in text for line in [*lines[:at], *lines[at + 3 : -1]])
    assert lines[at + 2].split() == f"{names[0]} 0 + 0 v 1.2 + 0.3 v 1.2 + 0.3 v none -".split()
    assert not [line for line in lines if line.startswith("Joint")]  # the table has these numbers
    assert (
        f"Joint {names[0]}: friction 1.2 N m, damping 0.3 N m s/rad. Cannot store: offset -0.4 N m, "
        "armature 0.05 kg m^2." in text
    )
    assert f"the model's friction is kept for: {names[1]}, {names[2]}." in text
    assert_same_dynamics(robot, read_again(robot, tmp_path / "new.urdf"), 1e-15)


def test_a_joint_without_friction_has_none_in_the_model_and_its_bound_is_reported(tmp_path: Path) -> None:
    none = joint_result({"offset": (0.1, "N m")})
    none = replace(none, verdict="no friction", reason="no friction detected, below 0.2 N m")
    none = replace(none, curve=tuple(made.point(speed, 0.0, 0.2) for speed in (0.1, 0.5, 1.0)))
    result, robot, name = of_joint(none, tmp_path)
    export(result, robot, tmp_path / "new.urdf", "urdf")
    dynamics = ET.parse(tmp_path / "new.urdf").getroot().find(f"joint[@name='{name}']/dynamics")
    assert dynamics.attrib == {"friction": "0.0", "damping": "0.0"}
    told = f"Joint {name}: friction 0 N m, damping 0 N m s/rad (no friction detected, below 0.2 N m)."
    assert told in (tmp_path / "new.urdf").read_text()


def test_of_two_directions_models_get_the_mean(tmp_path: Path) -> None:
    levels = {"viscous_positive": 0.2, "viscous_negative": 0.4, "coulomb_positive": 1.5, "coulomb_negative": 0.5}
    asymmetric = replace(joint_result({name: (value, "N m") for name, value in levels.items()}), law="asymmetric")
    rotor = joint_result({**FRICTION, "armature": (0.05, "kg m^2")}, weak=(*FRICTION, "armature"))
    result, robot = of_joints(tmp_path, asymmetric, rotor, robot="toro")
    export(result, robot, tmp_path / "new.xml", "mjcf")
    model = compiled(tmp_path / "new.xml")
    first, second = (model.joint(name).dofadr[0] for name in result.joints)
    assert model.dof_frictionloss[first] == pytest.approx(1.0)
    assert model.dof_damping.reshape(model.nv, -1)[first, 0] == pytest.approx(0.3)
    assert model.dof_frictionloss[second] == 0.0
    assert model.dof_armature[second] == pytest.approx(0.05)
    told_in_words = "approximates viscous_positive 0.2 N m, viscous_negative 0.4 N m"
    assert told_in_words in (tmp_path / "new.xml").read_text()
