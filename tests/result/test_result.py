"""What a result says in a program: friction curves, tables, one line of text."""

import copy
import json
import operator
import pickle
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import TRUTH as STRIBECK
from tests.result.made import estimate, joint, point, result

from stribeck import NothingIdentifiedError, SettingsError, compare, read_result
from stribeck.friction import get_law
from stribeck.judgement.verdict import NOT_FITTED
from stribeck.result import CurvePoint, Validation
from stribeck.result.tables import advice, friction_text, point_text, rounded


def test_friction_is_the_laws_at_any_shape_of_velocity(tmp_path: Path) -> None:
    found = result(knee=joint(STRIBECK | {"armature": 0.1}))
    velocity = np.linspace(-2, 2, 12).reshape(3, 4)
    torque = get_law("stribeck").torque(velocity.ravel(), np.array(list(STRIBECK.values())))
    np.testing.assert_allclose(found.joints["knee"].friction(velocity), torque.reshape(3, 4) + 0.4)
    np.testing.assert_allclose(found.joints["knee"].friction(velocity, offset=True), torque.reshape(3, 4))
    assert found.joints["knee"].friction(2.0).shape == ()
    assert found.joints["knee"].friction(velocity, load=7.0, temperature=9.0, offset=True).ravel() == pytest.approx(
        torque
    )
    (tmp_path / "result.json").write_text(found.to_json())
    read = read_result(tmp_path / "result.json")
    assert read.joints["knee"].friction(velocity, offset=True).ravel() == pytest.approx(torque)
    assert "law" not in found.to_json().partition('"joints"')[2]


def test_coulomb_friction_changes_over_position_around_its_mean() -> None:
    terms = {"coulomb_cosine": 0.3, "coulomb_sine": -0.2}
    knee = result("auto", knee=joint(STRIBECK | terms, mean_direction=(0.5, 0.1))).joints["knee"]
    v, q = np.linspace(-1, 1, 50), np.linspace(-4, 4, 50)
    change = (0.3 * (np.cos(q) - 0.5) - 0.2 * (np.sin(q) - 0.1)) * np.tanh(40 * v)
    np.testing.assert_allclose(knee.friction(v, position=q), knee.friction(v) + change, atol=1e-12)
    plain = result("auto", knee=joint(STRIBECK)).joints["knee"]
    np.testing.assert_allclose(knee.friction(v), plain.friction(v), atol=1e-12)


def test_load_and_temperature_change_friction_as_the_terms_say() -> None:
    """Fv (v + alpha |v|) + Fc tanh(a v) (1 + S exp(-(v / vs)^2)) + offset + mu |load| tanh(a v) + dT (...)."""
    terms = {"viscous_asymmetry": 0.2, "load": 0.05, "coulomb_per_kelvin": -0.02, "viscous_per_kelvin": -0.01}
    knee = result("auto", knee=joint(STRIBECK | terms, mean_load=10.0)).joints["knee"]
    v = np.linspace(-1, 1, 50)
    rise, bell = np.tanh(40 * v), np.exp(-((v / 0.2) ** 2))
    basic = 0.3 * (v + 0.2 * np.abs(v)) + 1.2 * rise * (1 + 0.25 * bell)
    np.testing.assert_allclose(knee.friction(v, load=0.0), basic, atol=1e-12)
    np.testing.assert_allclose(knee.friction(v), basic + 0.05 * 10 * rise, atol=1e-12)
    load, warmer = np.linspace(-20, 20, 50), np.linspace(0, 30, 50)
    expected = basic + 0.05 * np.abs(load) * rise + warmer * (-0.02 * rise - 0.01 * v)
    np.testing.assert_allclose(knee.friction(v, load=load, temperature=warmer), expected, atol=1e-12)


def test_terms_that_a_joint_lacks_are_neutral() -> None:
    knee = result("auto", knee=joint({"coulomb": 1.0, "offset": 0.5})).joints["knee"]
    np.testing.assert_allclose(knee.friction([-1.0, 1e-3, 1.0], load=5.0, offset=True), [-0.5, 1.5, 1.5])


def test_a_joint_without_numbers_has_no_friction_and_unknown_laws_none_either() -> None:
    with pytest.raises(NothingIdentifiedError, match="no friction was found of this joint: it <moves> too little"):
        result(knee=joint({})).joints["knee"].friction(1.0)
    with pytest.raises(SettingsError, match="found 'mine', expected one of"):
        result("mine", knee=joint(STRIBECK)).joints["knee"].friction(1.0)


def curve(upper: float) -> tuple[CurvePoint, ...]:
    found = [point(*each, 0.0) for each in ((0.1, 0.5), (0.5, 0.6), (1.0, 0.9))]
    return tuple(replace(each, standard_error=0.1, interval_95=(0.0, each.value * upper)) for each in found)


def test_the_curve_is_written_and_read_and_older_files_have_none(tmp_path: Path) -> None:
    found, path = result(knee=joint(STRIBECK, curve=curve(1.1))), tmp_path / "result.json"
    path.write_text(found.to_json())
    assert read_result(path) == found
    document = json.loads(path.read_text())
    point = {"velocity": 0.5, "value": 0.6, "standard_error": 0.1, "interval_95": [0.0, 0.6 * 1.1], "unit": "N m"}
    assert document["joints"]["knee"]["curve"][1] == point
    del document["joints"]["knee"]["curve"]
    path.write_text(json.dumps(document))
    assert read_result(path) == result(knee=joint(STRIBECK))


def test_friction_as_a_whole_is_said_at_middle_speed() -> None:
    assert friction_text(joint(STRIBECK, curve=curve(1.1))) == "0.60 ± 0.06 N m at 0.5 rad/s"
    assert friction_text(joint(STRIBECK, curve=curve(21))) == "1 ± 12 N m at 0.5 rad/s"
    assert friction_text(joint({})) == ""


def test_a_joint_without_friction_keeps_its_offset_alone() -> None:
    still = joint({"offset": -0.4}, verdict="no friction", curve=curve(1.1))
    np.testing.assert_array_equal(result(knee=still).joints["knee"].friction([[-1.0, 2.0]], offset=True), [[-0.4] * 2])
    assert not result(knee=still).joints["knee"].friction([-1.0, 2.0]).any()
    assert friction_text(still) == "below 0.99 N m"


def test_a_table_has_a_row_for_each_parameter_and_each_joint_without() -> None:
    pytest.importorskip("pandas")
    table = result(hip=joint({}), knee=joint(STRIBECK)).to_dataframe()
    assert [*table.columns] == [
        *("joint", "parameter", "value", "standard_error", "low", "high"),
        *("unit", "verdict", "joint_verdict"),
    ]
    assert table.joint.to_list() == ["hip"] + ["knee"] * 6
    row = table[table.parameter == "coulomb"].iloc[0]
    assert (row.value, row.low, row.high, row.unit) == (1.2, 1.0, pytest.approx(1.4), "N m")
    assert table.value.isna().to_list() == [True] + [False] * 6
    assert table.iloc[0].joint_verdict == "not excited"
    joints = result(hip=joint({}), knee=joint(STRIBECK, curve=curve(1.1))).to_dataframe("joints").set_index("joint")
    assert joints.loc["hip"].reason == "it <moves> too little"
    assert (joints.loc["knee"].friction, joints.loc["knee"].unit) == (0.6, "N m")


def test_without_pandas_there_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(SettingsError, match="needs pandas: pip install pandas"):
        result().to_dataframe()


def test_a_result_is_one_line_of_text_and_a_table_in_notebooks() -> None:
    found = result(**{"<hip>": joint({}), "knee": joint(STRIBECK)})
    assert repr(found) == ("Result('r & d', law stribeck, method curve-fit, 2 joints: 1 not excited, 1 identified)")
    page = found._repr_html_()
    assert "<td>1.2 ± 0.1 N m</td>" in page
    assert "r &amp; d" in page
    assert "<td>&lt;hip&gt;</td>" in page
    assert "<td>not excited</td><td>it &lt;moves&gt; too little</td>" in page
    assert len(re.findall("<td></td>", page)) == len(STRIBECK) + 1  # parameters of the hip, reason of the knee


def test_dictionaries_are_read_only_and_can_be_pickled() -> None:
    found = result(knee=joint(STRIBECK))
    for change in (
        lambda: found.joints.update(hip=joint({})),
        lambda: found.joints["knee"].parameters.pop("coulomb"),
        lambda: operator.delitem(found.joints, "knee"),
        lambda: operator.ior(found.joints, {}),
    ):
        with pytest.raises(TypeError, match="read-only; change a copy"):
            change()
    for copied in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert copied == found
        assert copied.to_json() == found.to_json()
        with pytest.raises(TypeError):
            del copied.joints["knee"]


def test_samples_stand_behind_a_curve_and_outliers_leave_its_scale() -> None:
    velocity = np.linspace(-1.0, 1.0, 1000)
    torque = np.where(np.arange(1000) % 100, np.sign(velocity), 50.0)
    measured = replace(joint(STRIBECK), law="stribeck")
    object.__setattr__(measured, "measured", (velocity, torque))
    axes = measured.plot()
    assert len(axes.lines[0].get_xdata()) == 1000
    assert max(map(abs, axes.get_ylim())) < 5.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("velocity [rad/s]", "friction torque [N m]")


def test_a_figure_has_every_joint_with_its_band() -> None:
    moved = joint(STRIBECK, correlation=tuple(map(tuple, np.eye(6))))
    figure = result(knee=moved, hip=joint({}), ankle=joint(STRIBECK), slide=joint({"offset": 0.1})).plot()
    shown = {axes.get_title(): axes for axes in figure.axes}
    assert [*shown] == ["knee", "hip", "ankle", "slide"]
    velocity, torque = shown["knee"].lines[0].get_data()
    np.testing.assert_allclose(torque, result(knee=moved).joints["knee"].friction(velocity, offset=True))
    assert [len(axes.collections) for axes in shown.values()] == [1, 0, 0, 0]
    assert shown["hip"].texts[0].get_text() == "not excited"


def test_a_correlation_of_another_shape_is_unknown() -> None:
    assert joint(STRIBECK, correlation=tuple(map(tuple, np.eye(6)))).correlation_matrix().shape == (6, 6)
    for wrong in (None, (), tuple(map(tuple, np.eye(5))), ((1.0,), *map(tuple, np.eye(6)[1:]))):
        assert joint(STRIBECK, correlation=wrong).correlation_matrix() is None


CURVE = (point(0.1, 1.0, 0.1), point(0.5, 1.0, 0.1), point(1.0, 1.0, 0.1))
KNOWN = joint({"coulomb": 1.0}, curve=CURVE)


def test_an_identified_joint_is_used_by_its_curve_if_parameters_are_open() -> None:
    assert advice(KNOWN) == "OK"
    assert (
        advice(replace(KNOWN, parameters={"slope": estimate(1.0, verdict="weak")}))
        == "OK (use the curve, not single parameters)"
    )


NOTHING = Validation(rms=1.0, rms_zero_friction=1.0, rms_coulomb_only=1.0)
FLAT = (point(0.1, 0.0, 0.1), point(0.5, 0.0, 0.1), point(1.0, 0.0, 0.1))
UNEVEN = (point(0.1, 1.0, 0.1), point(0.5, 1.0, 0.6), point(1.0, 2.0, 0.7))


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"verdict": "weak", "curve": UNEVEN}, "record more motion near 0.5 rad/s"),  # where it is least known
        ({"verdict": "weak", "validation": NOTHING}, "check the model, signs and delays"),
        ({"verdict": "weak", "curve": FLAT}, "check the torque signal or record a longer log"),
        ({"verdict": "not excited", "reason": NOT_FITTED}, "record longer motion between contact changes"),
        ({"verdict": "not excited", "reason": "?"}, "record faster and longer motion in both directions"),
    ],
)
def test_what_to_do_about_a_joint_follows_from_what_is_known_of_it(changed: dict[str, object], expected: str) -> None:
    assert advice(replace(KNOWN, **changed)) == expected


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        (1.1832, 0.0058, ("1.183", "0.006")),
        (1.160, 0.011, ("1.160", "0.011")),
        (0.6, 0.22, ("0.6", "0.2")),
        (28.3, 0.39, ("28.3", "0.4")),
        (47.4, 1e-4, ("47.40", "0.01")),
        (-0.0001, 0.3, ("0.0", "0.3")),
        (1234.0, 56.0, ("1234", "56")),
    ],
)
def test_values_have_the_digits_that_their_errors_leave(value: float, error: float, expected: tuple[str, str]) -> None:
    assert rounded(value, error) == expected


def test_friction_that_may_be_none_is_said_as_a_bound() -> None:
    assert point_text(point(0.1, 0.2, 0.3)) == "< 0.5"
    assert point_text(point(0.1, 2.0, 0.3)) == "2.0 ± 0.3"


def test_reprs_and_the_summary_are_short(tmp_path: Path) -> None:
    found = result(hip=joint({}), knee=joint(STRIBECK, curve=curve(1.1)))
    assert repr(found.joints["hip"]) == "JointResult(not excited)"
    assert repr(joint({"offset": 0.5})) == "JointResult(identified; offset 0.5 ± 0.1)"
    assert repr(compare(found, found)) == "Comparison('a.npz' and 'a.npz': 0 of 6 differences significant)"
    head, hip, knee = found.summary().splitlines()
    assert head == repr(found)
    assert hip.split() == [
        "hip",
        "not",
        "excited",
        *["record", "faster", "and", "longer", "motion", "in", "both", "directions"],
    ]
    assert knee == "knee  0.60 ± 0.06 N m at 0.5 rad/s  identified   OK"
    found.save(tmp_path / "result.json")
    read = read_result(tmp_path / "result.json")
    assert (read, read.path) == (found, str(tmp_path / "result.json"))
