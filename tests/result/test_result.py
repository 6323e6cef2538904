"""What a result says in a program: friction curves, tables, one line of text."""

import copy
import json
import operator
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.arm import TRUTH as STRIBECK
from tests.arm import stribeck_torque
from tests.result.made import estimate, joint, point, result

from stribeck import NothingIdentifiedError, SettingsError, read_result
from stribeck.core.judgement.verdict import NOT_FITTED
from stribeck.core.result import CurvePoint, Validation
from stribeck.core.result.tables import advice, friction_text, main_parameters, point_text


def test_friction_is_the_laws_at_any_shape_of_velocity(tmp_path: Path) -> None:
    found, still = result(knee=joint(STRIBECK | {"armature": 0.1})), result(knee=joint({}, verdict="no friction"))
    velocity = np.linspace(-2, 2, 12).reshape(3, 4)
    torque = stribeck_torque(velocity)
    np.testing.assert_allclose(found.joints["knee"].friction(velocity), torque + 0.4)
    np.testing.assert_allclose(found.joints["knee"].friction(velocity, offset=True), torque)
    assert type(found["knee"].friction(2.0)) is type(still["knee"].friction(2.0)) is float
    assert found["knee"].friction(velocity, load=7.0, temperature=9.0, offset=True) == pytest.approx(torque)
    (tmp_path / "result.json").write_text(found.to_json())
    read = read_result(tmp_path / "result.json")
    assert read.joints["knee"].friction(velocity, offset=True) == pytest.approx(torque)
    assert "law" not in found.to_json().partition('"joints"')[2]


def test_a_joint_without_numbers_has_no_friction_and_unknown_laws_none_either() -> None:
    with pytest.raises(NothingIdentifiedError, match="no friction was found of this joint: it <moves> too little"):
        result(knee=joint({})).joints["knee"].friction(1.0)
    with pytest.raises(SettingsError, match="found 'mine', expected one of"):
        result("mine", knee=joint(STRIBECK)).joints["knee"].friction(1.0)


def test_a_result_is_a_mapping_of_joints() -> None:
    found = result(hip_pitch=joint({}), knee=joint(STRIBECK))
    assert [*found] == [*found.keys()] == ["hip_pitch", "knee"]
    assert (len(found), "knee" in found, "elbow" in found) == (2, True, False)
    assert found["knee"] is found.get("knee")
    for expected in (KeyError, SettingsError):
        with pytest.raises(expected, match=r"^r & d: the result has no joint 'hip_pich'; .* mean 'hip_pitch'\?$"):
            found["hip_pich"]


def curve(upper: float) -> tuple[CurvePoint, ...]:
    found = [point(*each, 0.0) for each in ((0.1, 0.5), (0.5, 0.6), (1.0, 0.9))]
    ends = [(0.0, each.value * upper) for each in found]
    return tuple(
        replace(one, standard_error=0.1, interval_95=e, interval_next_log=e) for one, e in zip(found, ends, strict=True)
    )


def test_the_curve_is_written_and_read_and_older_files_have_none(tmp_path: Path) -> None:
    found, path = result(knee=joint(STRIBECK, curve=curve(1.1))), tmp_path / "result.json"
    path.write_text(found.to_json())
    assert read_result(path) == found
    document = json.loads(path.read_text())
    point = {"velocity": 0.5, "value": 0.6, "standard_error": 0.1, "interval_95": [0.0, 0.6 * 1.1], "unit": "N m"}
    assert document["joints"]["knee"]["curve"][1] == point | {"interval_next_log": [0.0, 0.6 * 1.1]}
    del document["joints"]["knee"]["curve"]
    path.write_text(json.dumps(document))
    assert read_result(path) == result(knee=joint(STRIBECK))


@pytest.mark.parametrize(
    ("place", "value", "problem"),
    [
        ("log.rate", 0, r"key 'log.rate' is 0"),
        ("log.sha256", ["a", "b"], "path and sha256 name different numbers of logs"),
        ("joints.elbow.curve.0.interval_95", [2.0, 1.0], "it ends at 1, but starts at 2"),
        ("joints.elbow.curve.0.standard_error", -1.0, "greater than or equal to 0"),
        ("joints.elbow.velocity_range", [1e308, 1e308], r"contains the number 1e\+308"),
        ("joints.elbow.terms", {"load": {"verdict": "kept", "reason": "", "gain": 1.0}}, "a gain needs a gain_error"),
    ],
)
def test_a_file_with_impossible_values_is_refused(tmp_path: Path, place: str, value: object, problem: str) -> None:
    found = result(elbow=joint(STRIBECK, curve=curve(1.1)))
    document = json.loads(found.to_json())
    *way, last = place.split(".")
    inner = document
    for key in way:
        inner = inner[int(key) if key.isdecimal() else key]
    inner[last] = value
    (tmp_path / "result.json").write_text(json.dumps(document))
    with pytest.raises(SettingsError, match=problem):
        read_result(tmp_path / "result.json")


def test_friction_is_summarized_at_middle_speed() -> None:
    for half, text in ((0.06, "11.20 ± 0.06"), (0.012, "11.200 ± 0.012"), (7, "11 ± 7"), (12, "< 23")):
        middle = point(0.5, 11.2, half)
        found = joint(STRIBECK, curve=(middle, middle))
        assert friction_text(found) == f"{point_text(middle)} N m at 0.5 rad/s" == f"{text} N m at 0.5 rad/s"
    assert friction_text(joint({})) == ""


def test_main_parameters_friction_are_means_of_both_directions_and_weak_ones_are_marked() -> None:
    ways = {"coulomb_positive": 1.5, "coulomb_negative": 0.5, "viscous_positive": 0.2, "viscous_negative": 0.4}
    found = joint({name: estimate(value, 0.05) for name, value in ways.items()} | {"armature": estimate(0.012, 0.001)})
    assert [text for text, _ in main_parameters(found)] == ["1.00 ± 0.10", "0.30 ± 0.10", "0.012 ± 0.002"]
    weak = replace(found.parameters["viscous_negative"], verdict="weak")
    found = replace(found, parameters={**found.parameters, "viscous_negative": weak})
    assert main_parameters(found)[1][0] == "0.30 ± 0.10?"
    assert "Coulomb 1.00 ± 0.10 N m, viscous 0.30 ± 0.10? N m, rotor 0.012" in result(knee=found).summary()
    assert main_parameters(joint({})) == [("", "")] * 3


def test_a_joint_without_friction_keeps_only_its_offset() -> None:
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


CURVE = (point(0.1, 1.0, 0.1), point(0.5, 1.0, 0.1), point(1.0, 1.0, 0.1))
KNOWN = joint({"coulomb": 1.0}, curve=CURVE)


def test_an_identified_joint_is_used_by_its_curve_if_parameters_are_open() -> None:
    assert advice(KNOWN) == "OK"
    assert advice(replace(KNOWN, parameters={"slope": estimate(1.0, verdict="weak")})) == "OK, use the curve"


NOTHING = Validation(rms=1.0, rms_zero_friction=1.0, rms_coulomb_only=1.0)
FLAT = (point(0.1, 0.0, 0.1), point(0.5, 0.0, 0.1), point(1.0, 0.0, 0.1))
UNEVEN = (point(0.1, 1.0, 0.1), point(0.5, 1.0, 0.6), point(1.0, 2.0, 0.7))


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"verdict": "weak", "curve": UNEVEN}, "record more motion near 0.5 rad/s"),  # where it is least known
        ({"verdict": "weak", "validation": NOTHING}, "check the model, signs and delays"),
        ({"verdict": "weak", "curve": FLAT}, "check the torque signal or record a longer log"),
        ({"verdict": "not excited"} | NOT_FITTED.fields, "record longer motion between contact changes"),
        ({"verdict": "not excited", "reason": "?"}, "record faster and longer motion in both directions"),
    ],
)
def test_the_advice_for_a_joint_follows_from_its_verdict(changed: dict[str, object], expected: str) -> None:
    assert advice(replace(KNOWN, **changed)) == expected
