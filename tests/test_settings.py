"""Settings of robot files and the command line are valid or refused in one sentence."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.arm import arm_log

from stribeck import identify
from stribeck.cli.options import with_settings
from stribeck.errors import SettingsError
from stribeck.robot import Robot
from stribeck.settings import FilterSettings, Settings, flat


def check_sentence(message: str) -> None:
    assert message.strip()
    assert len(message.splitlines()) == 1


numeric = [
    ("filter.window", st.integers(3, 999).map(lambda half: 2 * half + 1), lambda chosen: chosen.filter.window),
    ("filter.cutoff", st.floats(0.5, 1e3), lambda chosen: chosen.filter.cutoff),
    ("support.trim_end", st.floats(0, 10), lambda chosen: chosen.support.trim_end),
    ("block", st.floats(1e-3, 1e3), lambda chosen: chosen.block),
    ("holdout", st.integers(2, 100), lambda chosen: chosen.holdout),
]


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_an_assignment_is_what_comes_out_and_changes_nothing_else(data: st.DataObject) -> None:
    key, drawn, read = data.draw(st.sampled_from(numeric))
    value = data.draw(drawn)
    base = Settings(rest=0.25, filter=FilterSettings(kind="butterworth", cutoff=7.0))
    chosen = with_settings(base, {}, [f"{key}={value!r}"])
    assert read(chosen) == value
    before, after = base.model_dump(), chosen.model_dump()
    *tables, last = key.split(".")
    for table in tables:
        before, after = before[table], after[table]
    assert {name: one for name, one in after.items() if name != last} == {
        name: one for name, one in before.items() if name != last
    }


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, "1", True, [1.0], None])
def test_numbers_are_finite_and_are_numbers(value: object) -> None:
    with pytest.raises(ValueError, match="block"):
        Settings.model_validate({"block": value})


@pytest.mark.parametrize("key", [key for key, value in flat(Settings()).items() if type(value) in (int, float)])
@pytest.mark.parametrize("value", [-(10**18), 10**18, 1e300])
def test_every_number_has_a_range(key: str, value: float) -> None:
    with pytest.raises(
        SettingsError, match=rf"'{key}' is .*(; expected a number from \S+ to \S+|valid integer)"
    ) as refused:
        with_settings(Settings(), {}, [f"{key}={value!r}"])
    check_sentence(str(refused.value))


def test_text_without_quotes_is_text() -> None:
    chosen = with_settings(Settings(), {}, ["law=asymmetric", "filter.kind=butterworth", "fit_armature=['elbow']"])
    assert (chosen.law, chosen.filter.kind, chosen.fit_armature) == ("asymmetric", "butterworth", ["elbow"])


@pytest.mark.parametrize("assignment", ["block=1e-9", "holdout=100000", "rest=0", "filter.order=12", "loss=cauchy"])
def test_the_ends_of_ranges_work(assignment: str, arm: Robot) -> None:
    chosen = with_settings(Settings(), {"law": "coulomb-viscous", "method": "curve-fit"}, [assignment])
    joints = identify(arm_log(arm, duration=6), arm, chosen).joints
    for joint in joints.values():
        assert joint.parameters["coulomb"].value == pytest.approx(1.2, rel=0.15)  # of a log that has more than that law
        assert (joint.validation is None) == (assignment == "holdout=100000")


def test_rotor_inertia_of_a_joint_that_is_not_there(arm: Robot) -> None:
    with pytest.raises(SettingsError, match="'elbwo'; the torque-controlled joints are shoulder, elbow, slide"):
        identify(arm_log(arm, duration=1), arm, Settings(fit_armature=["elbwo"]))


def test_wrong_settings_in_python_are_one_sentence_with_a_suggestion() -> None:
    with pytest.raises(SettingsError, match=r"^Settings: unknown key 'lw'; did you mean 'law'\?$"):
        Settings(lw="auto")
    with pytest.raises(SettingsError, match="FilterSettings: key 'window' is 1; expected a number from 3"):
        FilterSettings(window=1)


@pytest.mark.parametrize("value", ["priors.mass=1e6", "priors.moments=11", 'law=""'])
def test_values_that_no_fit_survives_are_refused(value: str) -> None:
    with pytest.raises(SettingsError, match=value.partition("=")[0]):
        with_settings(Settings(), {}, [value])
