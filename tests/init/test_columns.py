"""Channels of a log found by the words in column names."""

from pathlib import Path
from typing import Any

import pytest

from stribeck.check.init.columns import find_columns
from stribeck.core.settings import LogTable
from stribeck.io.readers.formats import open_log

JOINTS = ("base", "wrist_1")


def columns(*kinds: str) -> list[str]:
    """List column names, one kind after the other."""
    return [kind.format(joint=joint, k=k) for kind in kinds for k, joint in enumerate(JOINTS)]


def found(folder: Path, *names: str) -> tuple[dict[str, dict[str, Any]], str | None]:
    path = folder / "log.csv"
    path.write_text(",".join(names) + "\n" + ",".join("0" for _ in names) + "\n")
    return find_columns(open_log(path, LogTable()))


@pytest.mark.parametrize(
    ("position", "other", "torque", "units"),
    [
        ("{joint}_ist_deg", "{joint}_soll_deg", "{joint}_moment_Nm", ("deg", "Nm")),
        ("{joint} [deg]", "{joint} [deg/s]", "{joint} [mNm]", ("deg", "mNm")),
        ("J{k} Pos [rad]", "J{k} Target Pos [rad]", "J{k} Torque [Nm]", ("rad", "Nm")),
        ("{joint}_theta", "{joint}_theta_dot", "{joint}_eff", (None, None)),
        ("encoders_{joint}", "model_{joint}", "tau_{joint}", (None, None)),
    ],
)
def test_joints_units_and_kinds_in_one_name(position, other, torque, units, tmp_path):
    table, source = found(tmp_path, "Time (s)", *columns(position, other, torque))
    assert table["time"] == {"name": "Time (s)"}
    for channel, name, unit in (("position", position, units[0]), ("torque", torque, units[1])):
        assert table[channel] == {"name": columns(name)} | ({"unit": unit} if unit else {})
    assert source is None


@pytest.mark.parametrize(
    ("current", "unit"),
    [("actual_current_{k}", "A"), ("iq_{k}", "A"), ("current_mA.{joint}", "mA"), ("{joint} Current [A]", "A")],
)
def test_currents_are_taken_where_there_is_no_torque(current: str, unit: str, tmp_path: Path) -> None:
    names = ["t", *columns("current_position_{joint}", current)]
    table, source = found(tmp_path, *names)
    assert table["torque"] == {"name": columns(current), "unit": unit}
    assert source == "motor_current"
    table, source = found(tmp_path, *names, *columns("target_moment_{joint}"))
    assert table["torque"] == {"name": columns(current), "unit": unit}  # which is measured
    table, source = found(tmp_path, "t", *columns("actual_q_{k}", "target_moment_{k}"))
    assert (table["torque"], source) == ({"name": columns("target_moment_{k}")}, "command")
    table, source = found(tmp_path, *names, *columns("tau_{joint}"))
    assert table["torque"] == {"name": columns("tau_{joint}")}
    assert source is None


@pytest.mark.parametrize(
    ("kinds", "torque"),
    [
        (("axis{k}.pos_estimate", "axis{k}.vel_estimate"), "axis{k}.torque_estimate"),
        (("m{k}.position", "m{k}.velocity"), "m{k}.torque"),
        (("field.position{k}", "field.velocity{k}"), "field.effort{k}"),
        (("rec.act_pos_se_deg{k}", "rec.des_pos_se_deg{k}"), "rec.act_torque_abs_nm{k}"),
        (("q{k}", "qd{k}"), "I{k}"),
    ],
)
def test_numbers_and_groups_before_the_channel(kinds: tuple[str, ...], torque: str, tmp_path: Path) -> None:
    table, source = found(tmp_path, "%time", "field.header.stamp", "i", *columns(*kinds, torque))
    assert table["time"] == {"name": "%time"}
    if not kinds[0].startswith("q"):  # its numbered columns have the usual name
        assert table["position"]["name"] == columns(kinds[0])
    assert table["torque"]["name"] == columns(torque)
    assert source == ("motor_current" if torque == "I{k}" else None)


def test_a_signal_with_unknown_words_is_taken_only_if_there_is_no_other(tmp_path: Path) -> None:
    table, _ = found(tmp_path, "ros_time", *columns("q_{k}", "tau_{k}"))
    assert table == {"time": {"name": "ros_time"}}
    table, _ = found(tmp_path, "ros_time", "cpu_time", *columns("q_{k}", "tau_{k}"))
    assert table == {}
