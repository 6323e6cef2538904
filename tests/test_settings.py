"""Settings of robot files and the command line are valid or refused in one sentence."""

import math

import pytest

from stribeck.app.cli.options import with_settings
from stribeck.core.base.checked_table import flat
from stribeck.core.errors import SettingsError
from stribeck.core.settings import FilterSettings, Settings

ASSIGNED = {"filter.window": 31, "filter.cutoff": 12.5, "support.trim_end": 0.2, "block": 2.0, "holdout": 7}


@pytest.mark.parametrize("key", ASSIGNED)
def test_an_assignment_changes_only_its_setting(key: str) -> None:
    base = Settings(rest=0.25, filter=FilterSettings(kind="butterworth", cutoff=7.0))
    assert flat(with_settings(base, {}, [f"{key}={ASSIGNED[key]}"])) == flat(base) | {key: ASSIGNED[key]}


@pytest.mark.parametrize("key", [key for key, value in flat(Settings()).items() if type(value) in (int, float)])
@pytest.mark.parametrize("value", [-(10**18), 10**18, 1e300, math.inf, math.nan])
def test_every_number_has_a_range(key: str, value: float) -> None:
    said = rf"'{key}' is .*(; expected a number from \S+ to \S+|valid integer)"
    with pytest.raises(SettingsError, match=said) as refused:
        with_settings(Settings(), {}, [f"{key}={value!r}"])
    assert len(str(refused.value).splitlines()) == 1


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
