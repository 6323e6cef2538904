"""Fatal errors stop `identify` unless forced; findings are in the result."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from tests.arm import arm_log, save_npz, write_arm
from tests.cli.test_cli import run

from stribeck import Robot, Settings, identify, read_result
from stribeck.core.base.finding import Finding, merged
from stribeck.core.base.spans import Span
from stribeck.core.errors import StribeckError
from stribeck.core.settings import FilterSettings


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder with an arm and its log in mN m."""
    place = tmp_path_factory.mktemp("arm")
    write_arm(place)
    log = arm_log(Robot.from_file(place / "robot.toml"), duration=6.0, rate=250.0)
    save_npz(log, place / "log.npz", torque=1000 * log.torque)
    return place


def test_a_fatal_error_writes_nothing_and_force_reports_it_everywhere(
    folder: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    command = ("identify", folder / "log.npz", "-r", folder / "robot.toml", "-o", tmp_path / "out")
    assert run(*command, "--method", "curve-fit") == 2
    assert re.search(r"as if they were in N mm or mN m.*scale = 0\.001.*--force", capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []
    assert run(*command, "--method", "curve-fit", "--force") == 0
    document = json.loads((tmp_path / "out" / "result.json").read_text())
    (finding,) = document["findings"]
    assert finding["check"] == "torque-scale"
    assert finding["stops"]
    line = f"{finding['text']}. {finding['cure']}"
    assert line in document["warnings"]
    assert line in capsys.readouterr().out.replace("\n", "")
    assert finding["cure"] in (tmp_path / "out" / "report.html").read_text()
    result = read_result(tmp_path / "out" / "result.json")
    assert result.findings[0].check == "torque-scale"


def test_a_finding_of_several_logs_is_reported_once(folder: Path) -> None:
    """If the evidence differs, the first log's is kept; other joints or channels are separate findings."""
    whole = arm_log(Robot.from_file(folder / "robot.toml"), duration=6.0, rate=250.0, seed=1)
    other = save_npz(whole.take(slice(0, 1200)), folder / "other.npz", torque=1000 * whole.torque[:1200])
    result = identify([folder / "log.npz", other], folder / "robot.toml", Settings(method="curve-fit"), force=True)
    other.unlink()
    (finding,) = result.findings
    assert finding.logs == (str(folder / "log.npz"), str(other))
    assert finding.text.startswith(f"{folder / 'log.npz'}: The torques are")
    assert finding.text.endswith(f" (also in {other})")
    assert result.warnings.count(str(finding)) == 1


def test_equal_findings_name_all_their_logs() -> None:
    dead, frozen = (Finding(check=check, channel="torque", text="it is", joints=("a",)) for check in ("dead", "frozen"))
    of_b = replace(dead, joints=("b",))
    by_log = [(f"{k}.npz", [dead]) for k in range(8)] + [("8.npz", [frozen, of_b])]
    found = merged(by_log)
    counted = [(each.check, each.joints, len(each.logs)) for each in found]
    assert counted == [("dead", ("a",), 8), ("frozen", ("a",), 1), ("dead", ("b",), 1)]
    assert found[0].text == "0.npz, 1.npz, 2.npz, 3.npz, 4.npz, 5.npz and 2 more: it is"
    assert merged([("0.npz", [dead])]) == [dead]
    pushed = [replace(dead, cure="exclude these spans", exclude=(Span(k, 9),)) for k in (3, 4)]
    (both,) = merged([(f"in/{k}.npz", [own]) for k, own in enumerate(pushed)])
    assert both.remedy == "exclude these spans: --exclude 0.npz:3:9 --exclude 1.npz:4:9"


@pytest.mark.parametrize("rows", [2, 15, 16, 30, 45])
def test_a_short_log_gives_one_sentence(rows: int, folder: Path, tmp_path: Path) -> None:
    robot = Robot.from_file(folder / "robot.toml")
    log = save_npz(arm_log(robot, duration=1.0, rate=1000.0).take(slice(100, 100 + rows)), tmp_path / "short.npz")
    enough = f"the log has {rows} samples; expected at least 16" if rows < 16 else r"takes 64.*|joint can be identified"
    for settings in (Settings(), Settings(filter=FilterSettings(kind="savitzky-golay", window=5))):
        with pytest.raises(StribeckError, match=enough):
            identify(log, robot, settings)
