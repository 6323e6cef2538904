"""Charts as data, compared with samples, law and phases; branches of a curve; numbers as text."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.report.conftest import ARRAYS
from tests.whole_log.logs import TRUTH, with_wrong_bodies

from stribeck import Robot, identify, write_report
from stribeck.app.report.charts import POINTS
from stribeck.app.report.joints import replayed_torques
from stribeck.app.report.page import MINUS, THIN, matched, number, percent
from stribeck.app.report.write import branch_charts, branches
from stribeck.core.friction import get_law
from stribeck.core.result import Result
from stribeck.core.settings import Settings
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.robots import MODELS
from stribeck.simulation.sensors.measure import with_noise


def test_torques_over_the_log_show_what_friction_explains(result: Result) -> None:
    """Of two logs, one after the other; lines break where a foot stands, and the errors are those of the lines."""
    samples = result.evidence.samples
    assert replayed_torques(result, samples) is None  # without the measured torque
    load = 5.0 * np.sin(samples.time)[:, None]
    both = {name: np.concatenate(2 * [getattr(samples, name)]) for name in ARRAYS}
    samples = replace(samples, torque=np.tile(samples.friction_torque + load, (2, 1)), **both)
    found = replayed_torques(result, samples)
    name, joint = "left_hip_roll", result.joints["left_hip_roll"]
    chart = found.charts[f"o{samples.joint_names.index(name)}"]
    lines = {line["name"]: np.array([np.nan if y is None else y for y in line["y"]]) for line in chart["lines"]}
    measured, without, predicted = lines.values()
    assert list(lines) == ["measured", "without friction", "with friction"]
    points = [len(each["lines"][0]["y"]) - 1 for each in found.charts.values() if each["lines"]]
    assert sum(points) <= POINTS  # rounding may add one each
    assert chart["x"]["range"][1] == pytest.approx(2 * samples.time[-1], rel=0.01)
    assert 0.1 < np.isnan(measured).mean() < 0.9
    errors = [np.sqrt(np.nanmean((measured - line) ** 2)) for line in (without, predicted)]
    left = found.charts[f"o{samples.joint_names.index(name)}r"]
    assert (left["residual"], left["y"]["label"]) == (f"o{samples.joint_names.index(name)}", "residual [N m]")
    said = re.search(rf"{name}: error ([\d.]+) → ([\d.]+) N m", str(found.body))
    assert [float(said[1]), float(said[2])] == pytest.approx(errors, rel=0.05)
    assert errors[1] == pytest.approx(joint.residual_rms, rel=0.1)
    assert errors[1] < 0.3 * errors[0]


@pytest.fixture(scope="module")
def corrected() -> Result:
    arm = Robot.from_file(MODELS / "arm.toml")
    exact, _ = exact_log(arm, get_law("stribeck"), dict.fromkeys(arm.joint_names, TRUTH), duration=20.0, seed=1)
    log = with_noise(exact, position=1e-5, torque=0.05, seed=4)
    return identify(log, with_wrong_bodies(arm), Settings(method="whole-log", corrections="inertia"))


def test_branches_that_a_wrong_model_splits_close_and_the_report_draws_both(corrected: Result, tmp_path: Path) -> None:
    for joint in ("shoulder_pitch", "elbow"):
        splits = []  # an error of gravity depends on the posture, so it splits them as well
        for samples in corrected.evidence.correction:
            _, up, down = branches(samples, joint)
            splits.append(np.sqrt(np.nanmean((up - down) ** 2)))
        assert splits[1] < 0.1 * splits[0], joint
    write_report(corrected, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert [caption in page for _, caption in branch_charts(corrected)] == [True] * len(corrected.joints)


def test_a_share_is_shown_as_none_or_all_only_if_it_is() -> None:
    shown = {percent(share) for share in (0.0, 0.0002, 0.9996, 1.0)}
    assert shown == {f"{text}{THIN}%" for text in ("0", f"<{THIN}0.1", "99.9", "100")}


def parse(text: str) -> float:
    return float(text.replace(MINUS, "-").replace(THIN, ""))


@given(st.floats(min_value=-1e12, max_value=1e12).filter(lambda value: value == 0 or abs(value) > 1e-12))
def test_a_number_is_shown_within_its_last_digit(value: float) -> None:
    assert parse(number(value, 3)) == pytest.approx(value, rel=5.1e-3)


@given(st.floats(min_value=-1e4, max_value=1e4), st.floats(min_value=1e-4, max_value=1e3))
def test_a_value_keeps_the_digits_that_its_error_leaves(value: float, error: float) -> None:
    assert abs(parse(matched(value, error)) - value) <= max(0.051 * error, 0.5)
    if error < 1:
        assert abs(parse(matched(value, error)) - value) <= 0.051 * error
