"""Settings of robot files and the command line are valid or refused in one sentence."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from tests.arm import URDF, arm_log, write_arm

from stribeck import identify
from stribeck.cli.options import with_settings
from stribeck.errors import RobotFileError, SettingsError
from stribeck.robot import Robot
from stribeck.settings import (
    ChannelTable,
    ContactTable,
    FilterSettings,
    LogTable,
    RobotFile,
    RobotTable,
    Settings,
    SupportSettings,
    flat,
)

QUICK = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
TABLES = (ChannelTable, ContactTable, FilterSettings, LogTable, RobotFile, RobotTable, Settings, SupportSettings)
KEYS = sorted({key for table in TABLES for key in table.model_fields})
WORDS = [
    "floating",
    "fixed",
    "arm.urdf",
    "hand",
    "point",
    "elbow",
    "slide",
    "butterworth",
    "auto",
    "imu",
    "wxyz",
    "deg",
]

keys = st.sampled_from(KEYS) | st.sampled_from(WORDS) | st.text(max_size=6)
numbers = st.integers(-(2**70), 2**70) | st.floats() | st.sampled_from([0, 1, 31, 0.5])
scalars = st.booleans() | numbers | st.sampled_from(WORDS) | st.text(max_size=6)
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=6,
)


def table_of(model: type[RobotTable | LogTable | Settings]) -> st.SearchStrategy[dict[str, object]]:
    """Generate tables whose keys are the settings', with arbitrary values."""
    return st.dictionaries(st.sampled_from(sorted(model.model_fields)) | keys, values, max_size=3)


near_documents = st.fixed_dictionaries(
    {"robot": table_of(RobotTable).map(lambda table: {"model": "arm.urdf", "base": "fixed", **table})},
    optional={
        "contacts": st.dictionaries(keys, st.fixed_dictionaries({"frame": st.sampled_from(WORDS)}), max_size=2),
        "log": table_of(LogTable),
        "identify": table_of(Settings),
    },
)
documents = near_documents | st.dictionaries(keys, values, max_size=3)


def toml(value: object) -> str:
    """Format a value as TOML; its basic strings are JSON's."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(key)} = {toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return _quoted(value)
    return str(value).lower()


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def check_sentence(message: str) -> None:
    assert message.strip()
    assert len(message.splitlines()) == 1


def robot_of(text: str, folder: Path) -> Robot | None:
    """Read a robot file with this text; None if it is refused, which must be one sentence."""
    (folder / "arm.urdf").write_text(URDF)
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    try:
        return Robot.from_file(path)
    except RobotFileError as error:
        refusal = str(error)
    check_sentence(refusal)
    assert str(folder) in refusal
    return None


@QUICK
@given(document=documents)
@example(document={"robot": {"model": "arm.urdf", "base": "fixed"}})
@example(document={"robot": {"model": "arm.urdf", "a\nb": 1}})
@example(document={"robot": {"model": "arm\0.urdf"}})
def test_any_robot_file(document: dict[str, object], tmp_path: Path) -> None:
    robot = robot_of("\n".join(f"{_quoted(key)} = {toml(value)}" for key, value in document.items()), tmp_path)
    if robot is not None:
        assert RobotFile.model_validate(document).robot.base == robot.base
        assert set(robot.joint_names) <= {"shoulder", "elbow", "slide"}
        assert set(robot.position_controlled) <= set(robot.joint_names)


paths = st.lists(st.sampled_from(KEYS) | st.text(max_size=4), min_size=1, max_size=3).map(".".join)
assignments = st.builds("{}={}".format, paths, values.map(toml) | st.text(max_size=8)) | st.text(max_size=12)


@QUICK
@given(
    file=table_of(Settings),
    law=st.none() | st.text(max_size=6),
    given_assignments=st.lists(assignments, max_size=3),
)
def test_any_assignments(file: dict[str, object], law: str | None, given_assignments: list[str]) -> None:
    try:
        base = Settings.model_validate(file)
    except ValueError:
        base = Settings()
    try:
        chosen = with_settings(base, {"law": law, "method": None}, given_assignments)
    except SettingsError as error:
        check_sentence(str(error))
        return
    assert isinstance(chosen, Settings)
    if not given_assignments:
        assert chosen == base.model_copy(update={} if law is None else {"law": law})


numeric = [
    ("filter.window", st.integers(3, 999).map(lambda half: 2 * half + 1), lambda chosen: chosen.filter.window),
    ("filter.cutoff", st.floats(0.5, 1e3), lambda chosen: chosen.filter.cutoff),
    ("support.trim_end", st.floats(0, 10), lambda chosen: chosen.support.trim_end),
    ("block", st.floats(1e-3, 1e3), lambda chosen: chosen.block),
    ("holdout", st.integers(2, 100), lambda chosen: chosen.holdout),
]


@QUICK
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


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return Robot.from_file(write_arm(tmp_path_factory.mktemp("arm")))


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
