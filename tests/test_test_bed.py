"""Single joint on a test bed, as in docs/test-bed.md: friction versus speed, load and temperature."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.cli.test_cli import refused, run

from stribeck import Robot
from stribeck.core.friction import get_law
from stribeck.core.result import read_result
from stribeck.simulation.prescribed.exact import exact_log
from stribeck.simulation.sensors.measure import with_noise

PAGE = (Path(__file__).parents[1] / "docs/test-bed.md").read_text()
TRUTH = {"viscous": 0.5, "coulomb": 1.2, "offset": 0.1}
MORE = {"load": 0.05, "coulomb_per_kelvin": -0.02, "viscous_per_kelvin": -0.008}


def make_bed(folder: Path, load_motor: bool) -> Path:
    """Write the page's model and robot file and a log to a folder; a load motor moves a flywheel."""
    blocks = dict(re.findall(r"^```(\w+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
    lever = '<origin xyz="0.4 0 0"/>'
    assert lever in blocks["xml"]
    model = blocks["xml"].replace(lever, '<origin xyz="0 0 0"/>') if load_motor else blocks["xml"]
    (folder / "bed.urdf").write_text(model)
    (folder / "bed.toml").write_text(blocks["toml"])
    robot = Robot.from_file(folder / "bed.toml")
    seconds = 90.0 if load_motor else 60.0
    log, known = exact_log(robot, get_law("coulomb-viscous"), {"drive": TRUTH}, duration=seconds, rate=250.0)
    warm = 19 * (1 - np.exp(-log.time[:, None] / (log.time[-1] / 3)))
    external = load_motor * 20 * np.sin(2 * np.pi * log.time[:, None] / 7.7)
    sign, above = np.sign(log.velocity), warm - warm.mean()
    friction = MORE["load"] * np.abs(log.torque - known.friction_torque - external) * sign
    friction += above * (MORE["coulomb_per_kelvin"] * sign + MORE["viscous_per_kelvin"] * log.velocity)
    noisy = with_noise(log, position=2e-5, torque=0.05)
    columns = {
        "time": log.time,
        "position.drive": noisy.position[:, 0],
        "torque.drive": (noisy.torque + friction - external)[:, 0],
        "temperature.drive": 25 + warm[:, 0],
    }
    assert ",".join(columns) == blocks["text"].splitlines()[0]
    if load_motor:
        noise = np.random.default_rng(1).normal(0.0, 0.05, len(log.time))
        columns["external_torque.drive"] = external[:, 0] + noise
    pd.DataFrame(columns).to_csv(folder / "bed.csv", index=False)
    return folder


@pytest.mark.parametrize("load_motor", [pytest.param(False, marks=pytest.mark.long), True])
def test_friction_over_speed_load_and_temperature_is_found(load_motor: bool, tmp_path: Path) -> None:
    bed = make_bed(tmp_path, load_motor)
    assert run("identify", bed / "bed.csv", "--robot", bed / "bed.toml", "-o", bed / "out") == 0
    joint = read_result(bed / "out/result.json").joints["drive"]
    assert joint.verdict == "identified"
    kept = {name for name, verdict in (joint.terms or {}).items() if verdict.kept}
    assert kept == {"viscous", "load", "coulomb_temperature", "viscous_temperature"}
    for name, true in (TRUTH | MORE).items():
        low, high = joint.parameters[name].interval_95
        assert low <= true <= high, name
    assert joint.parameters["load"].value == pytest.approx(MORE["load"], rel=0.05 if load_motor else 0.1)


@pytest.mark.parametrize("scale", [-1.0, 1000.0])
def test_a_load_torque_of_another_sign_or_unit_stops(scale, tmp_path, capsys):
    bed = make_bed(tmp_path, load_motor=True)
    (bed / "bed.toml").write_text((bed / "bed.toml").read_text() + f"[log.external_torque]\nscale = {scale}\n")
    sentence = refused(capsys, "identify", bed / "bed.csv", "--robot", bed / "bed.toml", "-o", bed / "out")
    assert float(sentence.split("Set scale = ")[1].split()[0]) == pytest.approx(1.0, rel=0.01)
    assert "stribeck explain external-torque" in sentence
