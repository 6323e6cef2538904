"""The public benchmark: its files say what was simulated, its scores what they are called, and a lie is found out."""

import hashlib
import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from benchmarks.contest.__main__ import main
from benchmarks.contest.cases import CONDITIONS, LATENCIES
from benchmarks.contest.contestants.command import torque_of
from benchmarks.contest.make import make
from benchmarks.contest.run import contestants, read_scores, run, write_scores
from benchmarks.contest.schema import ANSWER, CASE, PARAMETERS, SUMS, TRUTH, Case, Truth, cases_of, read, write
from benchmarks.contest.score import Score, score
from benchmarks.contest.table import lines, real_table, summary_table

from stribeck import Robot, read_log

ROOT = Path(__file__).parents[2]
SECONDS = 4.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("benchmark")
    make(made, ("arm",), seconds=SECONDS, progress=lambda _: None)
    return made


def true_answer(folder: Path, case: str, error: float = 0.0, **says: object) -> dict[str, object]:
    """An answer whose parameters are off by a share, and whose curves follow from them."""
    truth = read(Truth, folder / "truth" / case / TRUTH)
    joints = {
        joint: {name: {"value": (1 + error) * getattr(known, name), **says} for name in PARAMETERS}
        for joint, known in truth.joints.items()
    }
    return {"method": "a test", "version": "1", "joints": joints}


def scored(folder: Path, case: str, answer: dict[str, object], out: Path) -> Score:
    (out / ANSWER).write_text(json.dumps(answer), encoding="utf-8")
    return score("a test", folder / "cases" / case, folder / "truth" / case, out)


def test_files_describe_the_simulation_and_are_reproducible(folder: Path, tmp_path: Path) -> None:
    assert cases_of(folder) == sorted(f"arm/{condition}" for condition in CONDITIONS)
    case, truth = read(Case, folder / "cases/arm/load" / CASE), read(Truth, folder / "truth/arm/load" / TRUTH)
    robot = Robot.from_file(folder / "cases/arm/load/robot.toml")
    log = read_log(folder / "cases/arm/load" / case.logs[0], robot)
    assert set(case.joints) == set(truth.joints) == set(robot.joint_names)
    assert float(np.ptp(log.time)) == pytest.approx(case.seconds)
    assert 1 / np.median(np.diff(log.time)) == pytest.approx(case.rate)
    for line in (folder / SUMS).read_text().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    write(case, tmp_path / CASE)
    assert read(Case, tmp_path / CASE) == case
    make(tmp_path, ("arm",), seconds=SECONDS, progress=lambda _: None)
    assert (tmp_path / SUMS).read_text() == (folder / SUMS).read_text()


def test_errors_are_those_of_a_known_answer(folder: Path, tmp_path: Path) -> None:
    answer = true_answer(folder, "arm/clean", error=0.2, standard_error=0.01)
    found = scored(folder, "arm/clean", answer, tmp_path)
    truth = read(Truth, folder / "truth/arm/clean" / TRUTH).joints
    for joint, known in truth.items():
        assert found.relative["coulomb"][joint] == pytest.approx(0.2)
        assert found.offset[joint] == pytest.approx(0.2 * abs(known.offset), rel=1e-3)
    true = [getattr(known, name) for known in truth.values() for name in PARAMETERS]
    assert found.covered == (sum(abs(0.2 * value) < 1.96 * 0.01 for value in true), len(true))
    assert found.curve["elbow"] == pytest.approx(0.2, abs=0.05)
    assert not found.far
    assert {name for name in found.beyond if name.endswith("coulomb")} == {f"{joint} coulomb" for joint in truth}


def test_confident_errors_count_and_flagged_ones_do_not(folder: Path, tmp_path: Path) -> None:
    joints = len(read(Case, folder / "cases/arm/clean" / CASE).joints)
    lie = true_answer(folder, "arm/clean", error=0.5, standard_error=1e-3)
    liar = scored(folder, "arm/clean", lie, tmp_path)
    assert len(liar.far) == 2 * joints
    assert len(liar.beyond) >= 2 * joints
    assert liar.good == 3 * joints
    honest = scored(
        folder, "arm/clean", true_answer(folder, "arm/clean", 0.5, standard_error=1e-3, good=False), tmp_path
    )
    assert (honest.far, honest.beyond, honest.good) == ([], [], 0)
    assert "| 67 % |" in lines([liar])[0]  # Coulomb and viscous friction, of three numbers


def test_cases_run_in_separate_processes_and_failures_are_blank(folder, tmp_path, capsys):
    plain = contestants()["least squares"]
    found = run("least squares", plain, folder, "arm/clean")
    assert found.blank is None
    assert found.asked == len(found.curve) == 6
    assert found.seconds > 0
    assert 20 < found.memory < 2000
    failing = run("failing", [sys.executable, "-c", "raise SystemExit('no such thing')"], folder, "arm/clean")
    assert failing.blank == "ended with exit code 1: no such thing"
    assert not failing.curve
    saved = tmp_path / "scores.json"
    write_scores([found, failing], saved, "")
    assert read_scores(saved) == [found, failing]
    assert main(["run", str(folder), "--cases", "arm/clean", "--contestants", "nobody"]) == 2
    assert "contestant 'nobody' is not known" in capsys.readouterr().err


def test_cases_with_position_commands_have_gains_and_no_torques(tmp_path: Path) -> None:
    make(tmp_path, ("hobby-arm",), progress=lambda _: None)
    assert cases_of(tmp_path) == sorted(f"hobby-arm/{condition}" for condition in LATENCIES)
    case = read(Case, tmp_path / "cases/hobby-arm/5ms" / CASE)
    with np.load(tmp_path / "cases/hobby-arm/5ms" / case.logs[0]) as log:
        assert "torque" not in log
        assert np.ptp(log["time"]) == pytest.approx(case.seconds, abs=1.5 / case.rate)
        table = tomllib.loads((tmp_path / "cases/hobby-arm/5ms/robot.toml").read_text(encoding="utf-8"))["robot"]
        torque = torque_of(log, table, list(case.joints))
    assert np.abs(torque).max() == pytest.approx(2.5, abs=2)
    answer = true_answer(tmp_path, "hobby-arm/20ms")
    assert max(scored(tmp_path, "hobby-arm/20ms", answer, tmp_path).curve.values()) == 0


def test_the_tables_shown_are_those_of_the_saved_scores() -> None:
    scores = read_scores(ROOT / "benchmarks/contest/scores.json")
    page = (ROOT / "docs/accuracy.md").read_text(encoding="utf-8")
    assert all(line in page for line in summary_table(scores))
    assert set(real_table(scores)) < set(lines(scores))
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(line in readme for line in real_table(scores))
