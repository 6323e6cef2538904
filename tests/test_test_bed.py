"""A single joint on a test bed, as docs/test-bed.md has it: its friction over speed, load and temperature."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.cli.test_cli import run

from stribeck import Robot
from stribeck.friction import get_law
from stribeck.result import read_result
from stribeck_simulation.prescribed.exact import exact_log
from stribeck_simulation.sensors.measure import with_noise

PAGE = (Path(__file__).parents[1] / "docs/test-bed.md").read_text()
TRUTH = {"viscous": 0.5, "coulomb": 1.2, "offset": 0.1}
MORE = {"load": 0.05, "coulomb_per_kelvin": -0.02, "viscous_per_kelvin": -0.008}


@pytest.fixture
def bed(tmp_path: Path) -> Path:
    """Return a folder with the page's model and robot file, and a log."""
    blocks = dict(re.findall(r"^```(\w+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
    (tmp_path / "bed.urdf").write_text(blocks["xml"])
    (tmp_path / "bed.toml").write_text(blocks["toml"])
    robot = Robot.from_file(tmp_path / "bed.toml")
    log, known = exact_log(robot, get_law("coulomb-viscous"), {"drive": TRUTH}, duration=60.0, rate=500.0)
    assert log.velocity is not None
    warm = 19 * (1 - np.exp(-log.time[:, None] / 20))
    sign, above = np.sign(log.velocity), warm - warm.mean()
    friction = MORE["load"] * np.abs(log.torque - known.friction_torque) * sign
    friction += above * (MORE["coulomb_per_kelvin"] * sign + MORE["viscous_per_kelvin"] * log.velocity)
    noisy = with_noise(log, position=2e-5, torque=0.05)
    columns = {
        "time": log.time,
        "position.drive": noisy.position[:, 0],
        "torque.drive": (noisy.torque + friction)[:, 0],
        "temperature.drive": 25 + warm[:, 0],
    }
    assert ",".join(columns) == blocks["text"].splitlines()[0]
    pd.DataFrame(columns).to_csv(tmp_path / "bed.csv", index=False)
    return tmp_path


def test_friction_over_speed_load_and_temperature_is_found(bed: Path) -> None:
    assert run("identify", bed / "bed.csv", "--robot", bed / "bed.toml", "-o", bed / "out") == 0
    joint = read_result(bed / "out/result.json").joints["drive"]
    assert joint.verdict == "identified"
    kept = {name for name, verdict in (joint.terms or {}).items() if verdict.kept}
    assert kept == {"viscous", "load", "coulomb_temperature", "viscous_temperature"}
    for name, true in (TRUTH | MORE).items():
        low, high = joint.parameters[name].interval_95
        assert low <= true <= high, name
    assert joint.parameters["load"].value == pytest.approx(MORE["load"], rel=0.1)
