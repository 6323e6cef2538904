"""Settings of robot files and the command line are valid or refused in one sentence."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stribeck.app.cli.options import with_settings
from stribeck.core.base.checked_table import flat
from stribeck.core.errors import SettingsError
from stribeck.core.settings import FilterSettings, Settings


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
def test_an_assignment_changes_only_its_setting(data: st.DataObject) -> None:
    key, drawn, read = data.draw(st.sampled_from(numeric))
    value = data.draw(drawn)
    base = Settings(rest=0.25, filter=FilterSettings(kind="butterworth", cutoff=7.0))
    chosen = with_settings(base, {}, [f"{key}={value!r}"])
    assert read(chosen) == value
    before, after = base.model_dump(), chosen.model_dump()
    *tables, last = key.split(".")
    for table in tables:
        before, after = before[table], after[table]
    assert after | {last: None} == before | {last: None}


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


def test_wrong_settings_in_python_are_one_sentence_with_a_suggestion() -> None:
    with pytest.raises(SettingsError, match=r"^Settings: unknown key 'lw'; did you mean 'law'\?$"):
        Settings(lw="auto")  # type: ignore[call-arg]
    for wrong, message in (
        (lambda: FilterSettings(window=1), "FilterSettings: key 'window' is 1; expected a number from 3"),
        (lambda: FilterSettings(kind="buterworth"), "'savitzky-golay', .*; did you mean 'butterworth'"),  # type: ignore[arg-type]
        (lambda: Settings(law="stribek"), "Settings: key 'law' is 'stribek': .*'lugre', .*; did you mean 'stribeck'"),
        (lambda: with_settings(Settings(), {}, ["method=hole-log"]), "'direct', .*; did you mean 'whole-log'"),
    ):
        with pytest.raises(SettingsError, match=message):
            wrong()
