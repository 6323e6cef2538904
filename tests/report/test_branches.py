"""The branches of a friction curve come together when the model's errors are found."""

from pathlib import Path

import numpy as np
import pytest
from tests.whole_log.logs import TRUTH, with_wrong_bodies

from stribeck import Robot, identify, write_report
from stribeck.friction import get_law
from stribeck.report.details import branch_charts, branches
from stribeck.result import Result
from stribeck.settings import Settings
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.robots import MODELS
from stribeck_simulation.sensors.measure import with_noise


@pytest.fixture(scope="module")
def corrected() -> Result:
    arm = Robot.from_file(MODELS / "arm.toml")
    exact, _ = exact_log(arm, get_law("stribeck"), dict.fromkeys(arm.joint_names, TRUTH), duration=20.0, seed=1)
    log = with_noise(exact, position=1e-5, torque=0.05, seed=4)
    return identify(log, with_wrong_bodies(arm), Settings(method="whole-log", corrections="inertia"))


def test_branches_that_a_wrong_model_splits_close(corrected: Result) -> None:
    assert corrected.evidence is not None
    assert corrected.evidence.correction is not None
    for joint in ("shoulder_pitch", "elbow"):
        splits = []  # an error of gravity depends on the posture, so it splits them as well
        for samples in corrected.evidence.correction:
            _, up, down = branches(samples, joint)
            splits.append(np.sqrt(np.nanmean((up - down) ** 2)))
        assert splits[1] < 0.1 * splits[0], joint


def test_the_report_draws_them(corrected: Result, tmp_path: Path) -> None:
    figures = branch_charts(corrected)
    assert len(figures) == len(corrected.joints)
    write_report(corrected, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    for _, caption in figures:
        assert caption in page
