"""The command line as a user types it: exit codes, one-sentence errors, printed results, complete outputs or none."""

import json
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import typer
from tests.arm import arm_log, save_npz, write_arm
from tests.exporters.found import found_in
from tests.report.conftest import build_result
from tests.result.made import point

from stribeck import Robot, Settings, identify
from stribeck.app.cli import console, main
from stribeck.app.cli.app import app
from stribeck.app.cli.options import FORMATS, LAW_NAMES, METHOD_NAMES
from stribeck.app.exporters import TARGETS
from stribeck.core.errors import SettingsError
from stribeck.core.friction import AUTO, LAWS, LAWS_WITH_STATE
from stribeck.core.identify import METHODS
from stribeck.core.result import Result, TorqueR2, Validation
from stribeck.core.result.estimates import Verdict
from stribeck.core.result.tables import advice

OUTPUTS = ["friction_torque.parquet", "report.html", "result.json"]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with robot.toml, arm.urdf and a sound log.npz."""
    folder = tmp_path_factory.mktemp("arm")
    robot = Robot.from_file(write_arm(folder))
    save_npz(arm_log(robot, duration=12, rate=250), folder / "log.npz")
    return folder


def run(*arguments: object) -> int:
    """Run the command line in this process and return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["stribeck", *map(str, arguments)])
        handlers = {request: signal.getsignal(request) for request in (signal.SIGINT, signal.SIGTERM)}
        try:
            main()
        except SystemExit as stop:
            return int(stop.code or 0)
        finally:
            for request, handler in handlers.items():
                signal.signal(request, handler)
    return 0


def found_on_disk(arm: Path, folder: Path) -> Path:
    """Write a result of the arm and return its path."""
    (folder / "result.json").write_text(found_in(Robot.from_file(arm / "robot.toml"))[0].to_json())
    return folder / "result.json"


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run what must be refused; return the sentence, below what was found before."""
    assert run(*arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    *notes, sentence = printed.err.splitlines()
    assert all(note.startswith("stribeck: note: ") for note in notes), printed.err
    assert not sentence.startswith("stribeck: note: ")
    assert "Traceback" not in printed.err
    return sentence


def test_identify_writes_three_files(arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("identify", arm / "log.npz", "-r", arm / "robot.toml", "--method", "curve-fit")
    assert run(*arguments, "-o", tmp_path / "out") == 0
    assert sorted(os.listdir(tmp_path / "out")) == OUTPUTS
    assert os.listdir(tmp_path) == ["out"]
    printed = capsys.readouterr().out
    assert all(words in printed for words in ("identified", " N m at ", " N at ", "OK"))
    document = json.loads((tmp_path / "out/result.json").read_text())
    assert document["schema"] == 1
    assert list(document["joints"]) == ["shoulder", "elbow", "slide"]
    assert run(*arguments, "-o", tmp_path / "again", "-q") == 0
    assert capsys.readouterr() == ("", "")
    for file in OUTPUTS:
        assert (tmp_path / "out" / file).read_bytes() == (tmp_path / "again" / file).read_bytes()


def test_json_is_the_result_and_the_exit_code_says_that_nothing_is_identified(arm, tmp_path, capsys):
    robot = Robot.from_file(arm / "robot.toml")
    log = arm_log(robot, duration=6, rate=250)
    noise = 10 * np.random.default_rng(0).standard_normal(log.torque.shape)
    path = save_npz(replace(log, torque=log.torque + noise), tmp_path / "log.npz")
    options = "--method curve-fit --law coulomb-viscous --set filter.window=9 --set filter.kind=savitzky-golay --json"
    arguments = ("identify", path, "-r", robot.path, "-o", tmp_path / "out", *options.split(), "--force", "--overwrite")
    assert run(*arguments) == 0
    assert run(*arguments, "-q") == 3
    printed = capsys.readouterr().out
    text = (tmp_path / "out/result.json").read_text()
    assert printed == 2 * text
    assert {joint["verdict"] for joint in json.loads(text)["joints"].values()} == {"weak"}


def test_compare_names_results_and_writes_a_page(arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result, page = found_on_disk(arm, tmp_path), tmp_path / "compare.html"
    assert run("compare", result, tmp_path, "--names", "May, June", "-o", page) == 0
    printed = capsys.readouterr().out
    assert "May and June" in printed
    assert printed.endswith(f"{page}\n")
    for arguments, words in (
        ((result, result, "-o", page), "already exists"),
        ((result, result, result), "3 results were given; expected two"),
        ((result, result, "--names", "May"), "expected 2 different names"),
        ((result, "--names", "May"), "omit it to compare left and right"),
    ):
        assert words in refused(capsys, "compare", *arguments)
    assert run("compare", result, result, "--names", "May,June", "-o", page, "--overwrite", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["a"], found["b"], len(found["rows"])) == ("May", "June", 6)
    for row in found["rows"]:
        assert (row["difference"], row["percent"], row["agrees"], row["significant"]) == (0, 0, True, False)


@pytest.mark.parametrize("method", ["curve-fit", "whole-log"])
def test_notes_are_printed_when_nothing_is_identified(method, arm, tmp_path, capsys):
    log = arm_log(Robot.from_file(arm / "robot.toml"), duration=1.5, rate=250)
    position = np.rad2deg(log.position)
    position[100:110] = np.nan
    path = save_npz(log, tmp_path / "log.npz", position=position, velocity=None, acceleration=None)
    arguments = ("-r", arm / "robot.toml", "-o", tmp_path / "out", "--method", method, "--json", "--force")
    assert run("identify", path, *arguments) == 3
    printed = capsys.readouterr()
    assert printed.out == ""
    *notes, sentence = printed.err.splitlines()
    assert "no joint can be identified" in sentence
    for words in ("10 rows with missing values", "span more than four turns", "1 gaps longer than"):
        assert sum(note.startswith("stribeck: note: ") and words in note for note in notes) == 1
    assert os.listdir(tmp_path) == ["log.npz"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--law", "karnopp"], ["karnopp", "coulomb-viscous"]),
        (["--method", "hole-log"], ["'hole-log'", "did you mean 'whole-log'?"]),
        (["--set", "window=31"], ["unknown key 'window'; did you mean 'filter.window'?"]),
        (["--set", "filter.window"], ["KEY=VALUE"]),
        (["--set", "filter.windoe=31"], ["unknown key 'filter.windoe'; did you mean 'filter.window'?"]),
        (["--set", "filter.window=100000001"], ["key 'filter.window'", "expected a number from 3 to 99999"]),
        (["--set", "holdout=1"], ["holdout", "expected a number from 2 to 1e+06"]),
        (["--set", "law.name=1"], ["key 'law'", "valid string"]),
        (["--set", "filter.kind=butterworth", "--set", "filter.cutoff=900"], ["900 Hz", "below half"]),
    ],
)
def test_wrong_options(options, words, arm, tmp_path, capsys):
    sentence = refused(capsys, "identify", arm / "log.npz", "-r", arm / "robot.toml", "-o", tmp_path / "out", *options)
    for word in words:
        assert word in sentence


def _link(folder: Path, file: Path, *, hard: bool = False) -> Path:
    link = folder / "link"
    link.hardlink_to(file) if hard else link.symlink_to(file)
    return link


SPELLINGS: dict[str, Callable[[Path, Path], Path]] = {
    "itself": lambda file, _: file,
    "another spelling": lambda file, folder: folder / "sub" / ".." / file.name,
    "a symbolic link": lambda file, folder: _link(folder, file),
    "a hard link": lambda file, folder: _link(folder, file, hard=True),
}


@pytest.mark.parametrize("spell", SPELLINGS.values(), ids=SPELLINGS)
@pytest.mark.parametrize("name", ["log.npz", "result.json", "robot.toml", "arm.urdf"])
def test_inputs_are_not_written_over(name, spell, arm, tmp_path, capsys):
    for file in (arm / "log.npz", arm / "robot.toml", arm / "arm.urdf"):
        shutil.copy(file, tmp_path)
    (tmp_path / "sub").mkdir()
    found_on_disk(tmp_path, tmp_path)
    content = (tmp_path / name).read_bytes()
    output = spell(tmp_path / name, tmp_path)
    common = ("-r", tmp_path / "robot.toml", "-o", output, "--overwrite")
    if name != "result.json":
        assert "is read, and is not written over" in refused(capsys, "inspect", tmp_path / "log.npz", *common)
    if name != "log.npz":
        command = ("export", tmp_path / "result.json", "--to", "urdf")
        assert "is read, and is not written over" in refused(capsys, *command, *common)
    assert (tmp_path / name).read_bytes() == content


def test_the_table_is_not_written_over_its_log(arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = Path(shutil.copy(arm / "log.npz", tmp_path / "friction_torque.parquet"))
    content = log.read_bytes()
    arguments = ("identify", log, "-r", arm / "robot.toml", "-o", tmp_path, "--overwrite")
    assert f"{log}: is read" in refused(capsys, *arguments)
    (tmp_path / "link").symlink_to(log)
    with pytest.raises(SettingsError, match="link: is read"):
        identify(log, arm / "robot.toml", table=tmp_path / "link")
    assert log.read_bytes() == content


def test_outputs_are_written_over_only_when_asked_to(arm, tmp_path, capsys):
    page = tmp_path / "page.html"
    (tmp_path / "out").mkdir()
    for file in (page, tmp_path / "out/report.html", tmp_path / "log.truth.npz"):
        file.write_text("mine")
    scenario = Path(__file__).parents[2] / "examples/scenarios/arm.toml"
    inspect = ("inspect", arm / "log.npz", "-r", arm / "robot.toml", "-o", page)
    commands: list[tuple[object, ...]] = [
        inspect,
        ("identify", arm / "log.npz", "-r", arm / "robot.toml", "-o", tmp_path / "out"),
        ("simulate", scenario, "-o", tmp_path / "log.npz"),
        ("demo", "-o", tmp_path / "out"),
    ]
    for command in commands:
        assert "already exists; choose another -o, or pass --overwrite" in refused(capsys, *command)
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    assert "already exists" in refused(capsys, *inspect[:-1], tmp_path / "dangling")
    assert "is a folder" in refused(capsys, *inspect[:-1], tmp_path / "out", "--overwrite")
    assert "nope.urdf: no such file" in refused(capsys, "init", tmp_path / "nope.urdf", "-o", page)
    os.mkfifo(tmp_path / "pipe")
    for device in (tmp_path / "pipe", "/dev/null"):
        assert "is a pipe, a device or a socket" in refused(capsys, *inspect[:-1], device, "--overwrite")
    assert (tmp_path / "out/report.html").read_text() == "mine"
    assert run(*inspect, "--overwrite") == 0
    assert "250 Hz" in capsys.readouterr().out
    assert run(*inspect, "--overwrite", "--json") == 0
    assert json.loads(capsys.readouterr().out)["rate"] == pytest.approx(250)
    assert page.read_text().startswith("<!DOCTYPE html>")


def test_the_help_names_every_law_method_and_format(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("identify", "--help") == 0
    assert f"[default: {Settings().method}, or as" in " ".join(capsys.readouterr().out.split())
    assert set(LAW_NAMES) == {*LAWS, *LAWS_WITH_STATE, AUTO}
    assert set(METHOD_NAMES) == set(METHODS)
    assert set(FORMATS) == set(TARGETS)


def test_quiet_prints_only_errors_and_json(arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result, robot = found_on_disk(arm, tmp_path), ("-r", arm / "robot.toml", "-q")
    for command in (
        ("convert", arm / "log.npz", *robot, "-o", tmp_path / "log.parquet"),
        ("export", result, *robot, "--to", "urdf", "-o", tmp_path / "new.urdf"),
        ("export", result, *robot, "--to", "urdf", "-o", tmp_path / "draws", "--samples", 2),
        ("compare", result, result, "--quiet"),
    ):
        assert run(*command) == 0
        assert capsys.readouterr() == ("", "")
    assert len(os.listdir(tmp_path)) == 4
    assert run("compare", result, result, "-q", "--json") == 0
    assert json.loads(capsys.readouterr().out)["rows"]
    assert "already exists" in refused(capsys, "convert", arm / "log.npz", "-q", "-o", tmp_path / "log.parquet")


def test_every_command_that_writes_takes_overwrite_and_every_command_is_quiet() -> None:
    for name, command in typer.main.get_group(app).commands.items():
        options = {option for parameter in command.params for option in parameter.opts}
        assert ("--output" in options) <= ("--overwrite" in options) or name == "fleet", name  # a store only grows
        assert "--quiet" in options or name == "explain", name


def test_explain_prints_the_explanation_of_verdicts_and_checks(capsys: pytest.CaptureFixture[str]) -> None:
    names = {verdict.replace(" ", "-") for verdict in get_args(Verdict)}
    assert run("explain") == 0
    listed = capsys.readouterr().out.split()
    assert {*names, "torque-sign"} <= set(listed)
    for name in listed:
        assert run("explain", name) == 0
        assert re.search(r"\n(Remedy|Example): ", capsys.readouterr().out)
    assert "did you mean 'torque-sign'?" in refused(capsys, "explain", "torque-sing")


LONG = "left_arm_shoulder_abduction_joint"


@pytest.fixture(scope="module")
def found() -> Result:
    result = build_result(duration=8.0)
    curve = tuple(point(velocity, 1.0, 0.2) for velocity in (0.1, 0.5, 1.0))
    names = dict(zip(result.joints, (LONG, *list(result.joints)[1:]), strict=True))
    joints = {names[name]: replace(joint, curve=curve) for name, joint in result.joints.items()}
    last = list(joints)[-2]
    joints[last] = replace(joints[last], verdict="no friction", reason="no friction detected, below 1.2 N m")
    unseen = Validation(rms=0.1, rms_zero_friction=1.0, rms_coulomb_only=0.2)
    joints[LONG] = replace(joints[LONG], torque_r2=TorqueR2(nominal=0.5, corrected=0.987), validation=unseen)
    return replace(result, joints=joints)


@pytest.mark.parametrize("width", [70, 80, 120, 160])
@pytest.mark.parametrize("law", ["stribeck", "auto"])
def test_no_joint_s_name_is_cut_or_broken(found, monkeypatch, capsys, width: int, law: str) -> None:
    monkeypatch.setattr(console, "PLAIN_WIDTH", width)
    console.print_result(replace(found, law=law))
    console.say(["word " * 60])
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("  word word")
    assert max(map(len, lines)) <= width
    assert "…" not in "".join(lines)
    for name in found.joints:
        assert any(name in line for line in lines)


def test_a_joint_has_one_line_with_friction_fit_verdict_and_what_to_do(found, capsys) -> None:
    console.print_result(replace(found, law="auto"))
    lines = capsys.readouterr().out.splitlines()
    line = next(line for line in lines if LONG in line)
    assert all(f"1.0 ± 0.2 at {speed}" in line for speed in ("0.1", "0.5", "1"))
    assert "0.990" in line  # of friction, whatever that of the torque
    assert found.joints[LONG].verdict in line
    assert advice(found.joints[LONG]) in line
    folded = next(line for line in lines if "below 1.2 N m" in line)
    assert folded.startswith("friction below the resolution of the log: ")
