"""The documentation says what the code does: its code runs, its tables are the code's, its links lead somewhere."""

import dataclasses
import json
import re
import shlex
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_args
from unittest import mock

import numpy as np
import pyarrow.parquet as pq
import pytest
import typer
from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from rosbags.typesys import Stores, get_typestore
from studies import (
    accuracy_cases,
    accuracy_table,
    across_logs,
    beyond_cases,
    beyond_the_laws,
    compensation,
    direct,
    least_error,
    lies,
    lugre,
    observer,
    plan_walks,
    replayed,
    step_coverage,
    verdicts,
    walking_compensation,
    what_is_told,
)
from studies import plan as planned
from tests.arm import arm_log, save_npz, write_arm
from tests.log.readers.formats import messages_of, write_messages
from tests.models import EXAMPLES, MODELS, STRIBECK

from stribeck import Robot, identify
from stribeck.audit import channels
from stribeck.cli.app import app
from stribeck.errors import StribeckError
from stribeck.finding import FRICTION, Finding
from stribeck.friction import AUTO, LAWS, LAWS_WITH_STATE, get_law
from stribeck.friction.terms import BEYOND_VELOCITY, LADDER
from stribeck.identification.judgement.curve import WIDEST
from stribeck.identification.whole_log.tests_of_fit.findings import SENTENCES, UNCLEAR
from stribeck.log.readers.mapping import UNITS, check_table
from stribeck.methods import METHODS
from stribeck.motion.filters import TAKES
from stribeck.result import (
    BodyCorrection,
    Corrections,
    HeldOutError,
    JointResult,
    LogSummary,
    ParameterEstimate,
    Result,
    TermVerdict,
    TorqueR2,
    Validation,
    read_result,
)
from stribeck.result.joint import Verdict, verdict_place
from stribeck.robot import from_robot_file
from stribeck.settings import (
    ChannelTable,
    ContactTable,
    FilterSettings,
    LogTable,
    Priors,
    RobotFile,
    RobotTable,
    Settings,
    SupportSettings,
)
from stribeck_simulation.demo import SCENARIO
from stribeck_simulation.robots.toro import ROBOT_FILE
from stribeck_simulation.run import friction_of, run_scenario
from stribeck_simulation.scenario import Scenario, read_scenario
from stribeck_simulation.walking.footsteps import Footprint, Steps
from stribeck_simulation.walking.plan import plan_walk

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {str(path.relative_to(ROOT)): path.read_text() for path in [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]}
SECTIONS: dict[str, type[BaseModel]] = {
    "`[robot]`": RobotTable,
    "`[contacts.<foot>]`": ContactTable,
    "`[log]`": LogTable,
    "`[log.<channel>]`": ChannelTable,
    "`[identify]`": Settings,
    "`[identify.filter]`": FilterSettings,
    "`[identify.support]`": SupportSettings,
    "`[identify.priors]`": Priors,
}
"""Headings of docs/robot-file.md and what they describe."""


class Block(NamedTuple):
    """A fenced block: what its fence says, and its text; `answer` is the `text` block that follows a wrong example."""

    kind: str
    text: str
    answer: str = ""


@cache
def blocks(page: str) -> list[Block]:
    found = [Block(*pair) for pair in re.findall(r"^```([^\n]*)\n(.*?)^```$", PAGES[page], re.MULTILINE | re.DOTALL)]
    followers = [*found[1:], Block("", "")]
    return [block._replace(answer=after.text.strip()) for block, after in zip(found, followers, strict=False)]


def all_blocks(kind: str) -> list[Any]:
    return [
        pytest.param(block, id=f"{page} {number}")
        for page in PAGES
        for number, block in enumerate(one for one in blocks(page) if one.kind == kind)
    ]


def rows_below(page: str, heading: str = "") -> Iterator[list[str]]:
    """Yield the cells of the table rows of a page or of one section, header and ruler left out."""
    text = section(page, heading) if heading else PAGES[page]
    lines = text.splitlines()
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        if line.startswith("|") and not re.match(r"\|[ :-]+\|", line) and not re.match(r"\|[ :-]+\|", after):
            yield [cell.strip().replace(r"\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def section(page: str, heading: str) -> str:
    _, _, rest = PAGES[page].partition(f"\n## {heading}\n")
    assert rest, f"{page} has no heading {heading}"
    return rest.partition("\n## ")[0]


def names_in(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as a user has one: a model, its robot file, a log, and what was found in it."""
    folder = tmp_path_factory.mktemp("docs")
    robot = Robot.from_file(write_arm(folder))
    log = arm_log(robot, duration=12)
    for name in ("log.npz", "walk.npz"):
        save_npz(log, folder / name)
    messages = messages_of(log.take(slice(None, None, 4)), get_typestore(Stores.ROS2_HUMBLE))
    write_messages(folder / "walk.mcap", messages)
    result = identify(folder / "log.npz", robot, table=_made(folder / "OUT") / "friction_torque.parquet")
    (folder / "OUT/result.json").write_text(result.to_json())
    return folder


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


@pytest.fixture
def here(workshop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same files, to work among."""
    for file in workshop.rglob("*"):
        if file.is_file():
            place = tmp_path / file.relative_to(workshop)
            place.parent.mkdir(exist_ok=True)
            place.write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("page", [page for page in PAGES if any(block.kind == "python" for block in blocks(page))])
def test_python_runs(page: str) -> None:
    namespace: dict[str, Any] = {"__name__": page}
    with mock.patch.dict(LAWS), mock.patch.dict(METHODS):
        for block in blocks(page):
            if block.kind == "python":
                exec(compile(block.text, page, "exec"), namespace)


@pytest.mark.parametrize("block", all_blocks("toml"))
def test_robot_files_are_valid(block: Block) -> None:
    document = tomllib.loads(block.text)
    file = RobotFile.model_validate({"robot": {"model": "robot.urdf"}, **document})
    check_table(file.log, "robot.toml")
    models = {Path(path).name: path for path, *_ in MODELS.values()}
    if file.robot.model in models:
        model = file.robot.model_copy(update={"model": models[file.robot.model]})
        robot = from_robot_file(file.model_copy(update={"robot": model}), EXAMPLES / "robot.toml")
        assert set(file.robot.locked).isdisjoint(robot.joint_names)


def test_a_humanoid_a_quadruped_and_an_arm_are_shown() -> None:
    shown = [tomllib.loads(block.text).get("robot", {}).get("model") for block in blocks("docs/robot-file.md")[:3]]
    assert shown == ["talos_reduced.urdf", "go2.urdf", "panda.urdf"]


@pytest.mark.parametrize("block", all_blocks("toml error"))
def test_wrong_robot_files_give_the_sentence_that_is_shown(block: Block, here: Path) -> None:
    (here / "robot.toml").write_text(block.text)
    with pytest.raises(StribeckError) as refused:
        app(["identify", "log.npz", "-r", "robot.toml", "-o", "new"], standalone_mode=False)
    assert str(refused.value) == block.answer
    assert refused.value.exit_code == 2


def commands() -> list[list[str]]:
    """Return the stribeck commands of all code, fenced or indented, each once; what two spaces set off is a remark."""
    found = {}
    for text in PAGES.values():
        for line in re.findall(r"^(?: {4,})?(?:\$ )?(stribeck .*)$", text, re.MULTILINE):
            words = shlex.split(re.split(r" {2,}", line)[0], comments=True)
            found[" ".join(words)] = words[1:]
    return list(found.values())


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_commands_are_spelt_right(words: list[str]) -> None:
    known = typer.main.get_group(app).commands
    assert words[0] in known
    known[words[0]].make_context(words[0], words[1:])


FILES = {"LOG": "log.npz", "LOG...": "log.npz", "A/result.json": "OUT/result.json", "B/result.json": "OUT/result.json"}
FILES |= {"walk.npz": "log.npz", "out": "OUT"}
"""What stands for the placeholders of commands; two that are then the same run once."""


@pytest.mark.parametrize("name", ["identify", "inspect"])
def test_commands_run_where_their_files_are_there(name: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ran: set[tuple[str, ...]] = set()
    for words in commands():
        words = [FILES.get(word, word) for word in words]
        inputs = [word for word in words if Path(word).suffix in (".toml", ".npz", ".json")]
        if words[0] == name and inputs and all((here / word).exists() for word in inputs) and tuple(words) not in ran:
            app([*words, "--overwrite"], standalone_mode=False)  # each page has a folder of its own in mind
            ran.add(tuple(words))
    assert ran
    assert "arm" in capsys.readouterr().out


@pytest.mark.parametrize("block", all_blocks("json"))
def test_results_are_of_the_schema(block: Block, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(block.text)
    assert json.loads(read_result(tmp_path / "result.json").to_json()) == json.loads(block.text)


def test_every_field_of_a_result_is_explained() -> None:
    named = {name.rsplit(".", 1)[-1] for row in rows_below("docs/result.md") for name in names_in(row[0])}
    for carrier in (
        Result,
        LogSummary,
        JointResult,
        ParameterEstimate,
        TermVerdict,
        Validation,
        TorqueR2,
        Corrections,
        BodyCorrection,
        HeldOutError,
    ):
        parts = {"evidence", "log", "validation", "torque_r2"}
        assert {field.name for field in dataclasses.fields(carrier)} - parts <= named


def test_the_result_shown_is_of_the_demonstrations_walk() -> None:
    """Its digits are one machine's: a walk on contacts magnifies rounding."""
    shown = json.loads(next(block.text for block in blocks("docs/result.md") if block.kind == "json"))
    scenario = read_scenario(SCENARIO)
    robot = Robot.from_file(ROBOT_FILE)
    assert shown["robot"] == robot.name
    walk = [Steps(**steps.model_dump()) for steps in scenario.walk]
    plan = plan_walk(walk, (Footprint(0.0, 0.1, 0.0), Footprint(0.0, -0.1, 0.0)), pulsation=3.0)
    assert shown["log"]["duration"] == pytest.approx((plan.samples - 1) * plan.period, abs=2e-3)
    ((name, joint),) = shown["joints"].items()
    truth = friction_of(scenario, robot).parameters[name]
    for parameter, numbers in joint["parameters"].items():
        low, high = numbers["interval_95"]
        assert low <= truth[parameter] <= high
        assert low <= numbers["value"] <= high


def test_the_accuracy_shown_is_the_studys() -> None:
    runs = accuracy_table.read_runs(ROOT / "studies/accuracy.json")
    for row in accuracy_table.table(accuracy_table.in_order(runs)):
        assert row in PAGES["docs/whole-log.md"]


def test_the_replayed_logs_shown_are_the_studys() -> None:
    rows = json.loads((ROOT / "studies/replayed.json").read_text())
    assert replayed.table(rows) in PAGES["docs/replay.md"]
    for row in rows:
        assert row["exported"]["velocity"][replayed.SHOWN] < row["as given"]["velocity"][replayed.SHOWN]


def test_the_promises_shown_are_the_studys() -> None:
    """What is planned from friction that is known comes true within 30 %, but for a few numbers."""
    plans = json.loads((ROOT / "studies/plan.json").read_text())["plans"]
    for one in plans:
        assert planned.row(one) in PAGES["docs/plan.md"]
    for one in plans:
        if one["plan"] == 2 or one["law"] == "coulomb-viscous":
            ratios = [ratio for each in one["runs"] for joint in each.values() for ratio in joint["curve"]]
            assert 1 / 1.3 < np.median(ratios) < 1.3


def test_the_promises_for_walks_shown_are_the_studys() -> None:
    walks = json.loads((ROOT / "studies/plan_walks.json").read_text())["walks"]
    for row in plan_walks.rows(walks):
        assert row in PAGES["docs/plan.md"]
    for walk in walks:
        for key in ("longer", "faster"):
            assert 1 / 1.5 < np.median([joint[key] for joint in walk["joints"].values()]) < 1.5


def test_the_verdicts_shown_are_the_studys() -> None:
    said = json.loads((ROOT / "studies/verdicts.json").read_text())["parameters"]
    for row in verdicts.table(said):
        assert row in PAGES["docs/verdicts.md"]
    of_whole_log = [each for each in said if each["method"] == "whole-log"]
    wrong, found, right, alarms = verdicts.flagged(of_whole_log)
    assert found > 0.95 * wrong
    assert alarms < 0.25 * right
    for each in of_whole_log:
        assert each["weak"] or each["width"] <= WIDEST


def test_what_holds_across_logs_is_the_studys() -> None:
    for one in json.loads((ROOT / "studies/across_logs.json").read_text())["robots"]:
        assert across_logs.row_of(one) in PAGES["docs/verdicts.md"]


def test_the_least_errors_shown_are_the_studys() -> None:
    found = json.loads((ROOT / "studies/least_error.json").read_text())["bounds"]
    assert {each["robot"] for each in found} == set(accuracy_cases.ROBOTS)
    for row in least_error.table(found):
        assert row in PAGES["docs/whole-log.md"]


def test_what_is_told_of_friction_beyond_the_laws_is_the_studys() -> None:
    told = json.loads((ROOT / "studies/beyond_the_laws.json").read_text())["told"]
    for row in beyond_the_laws.table(told):
        assert row in PAGES["docs/whole-log.md"]
    assert {one["case"] for one in told} == set(beyond_cases.CASES)
    whole_log = [one for one in told if one["method"] == "whole-log"]
    assert all(bool(one["kinds"]) == (one["case"] != beyond_cases.INSIDE) for one in whole_log)


def test_the_held_out_errors_shown_are_the_studys() -> None:
    robots = json.loads((ROOT / "studies/held_out.json").read_text())["robots"]
    shown = list(rows_below("docs/real-robots.md", "Held out, side by side"))
    assert shown == [
        [robot, joint, *(f"{error:.3g}" for error in row.values())]
        for robot, joints in robots.items()
        for joint, row in joints.items()
    ]


def test_the_direct_identifications_shown_are_the_studys() -> None:
    study = json.loads((ROOT / "studies/direct.json").read_text())
    others = json.loads((ROOT / "studies/held_out.json").read_text())["robots"]
    for row in (*direct.arm_table(study["arms"], others), *direct.walk_table(study["walk"])):
        assert row in PAGES["docs/direct.md"]


def test_the_lies_shown_are_the_studys() -> None:
    study = json.loads((ROOT / "studies/lies.json").read_text())
    assert lies.table(study["lies"]) in PAGES["docs/findings.md"]
    assert lies.clean_table(study["clean"]) in PAGES["docs/findings.md"]
    assert {row["lie"] for row in study["lies"]} == set(lies.LIES)
    assert sum(row["named"] for row in study["lies"]) > 0.9 * len(study["lies"])
    assert not any(found for each in study["clean"].values() for found, _ in each.values())
    assert not any(row["wrong"] for row in study["lies"])


def test_the_compensation_shown_is_the_studys_and_as_good_as_the_truth() -> None:
    found = json.loads((ROOT / "studies/compensation.json").read_text())
    assert compensation.table(found) in PAGES["docs/export.md"]
    assert all(compensation.gain_of(found, task) > 0.75 for task in compensation.TASKS[:2])
    walks = json.loads((ROOT / "studies/walking_compensation.json").read_text())
    assert walking_compensation.table(walks) in PAGES["docs/export.md"]
    assert walking_compensation.table_of_wrong(walks) in PAGES["docs/export.md"]
    for robot in walks.values():
        upright = [each for each in robot["walks"].values() if not (each["none"]["fell"] or each["true"]["fell"])]
        assert upright
        for each in upright:
            gains = [walking_compensation.gain(each, measure) for measure in ("error", "com", "foot")]
            assert min(gains) > 0.75


def test_the_observers_errors_shown_are_the_studys() -> None:
    found = json.loads((ROOT / "studies/observer.json").read_text())
    assert observer.table(found) in PAGES["docs/observer.md"]
    assert list(observer.METHODS) == [each["method"] for each in found if each["log"] == "arm"]
    by = {(each["log"], each["method"]): each["coulomb"][0] for each in found}
    assert all(by[log, "observer"] < 2 * by[log, "curve-fit"] for log in ("arm", "TORO-like"))


def test_what_lugre_finds_is_the_studys() -> None:
    found = json.loads((ROOT / "studies/lugre.json").read_text())
    page = PAGES["docs/laws/lugre.md"]
    assert lugre.table(found["simulated"]) in page
    assert lugre.real_table(found["real"]) in page
    by = {each["friction"]: each for each in found["simulated"]}
    assert list(by) == [*lugre.FRICTIONS, lugre.WALK]
    for kind in ("LuGre, 300 N m/rad", lugre.WALK):
        assert by[kind]["travel"]["identified"] > 0.7 * by[kind]["travel"]["of"]
        assert by[kind]["travel"]["error"] < 5
        assert by[kind]["held_out"]["lugre"] < 0.5 * by[kind]["held_out"]["stribeck"]
    assert by[lugre.NONE]["travel"]["identified"] == 0


def test_every_check_is_explained_with_an_example_and_a_cure() -> None:
    files = sorted((ROOT / "src/stribeck").rglob("*.py"))
    named = {name for file in files for name in re.findall(r'check="([\w-]+)"', file.read_text())}
    named |= {*channels.TEXTS, *(FRICTION + kind for kind in SENTENCES), UNCLEAR, "base-orientation-delay"}
    page = PAGES["docs/findings.md"]
    parts = dict(re.findall(r"^### ([\w-]+)\n(.*?)(?=^##|\Z)", page, re.MULTILINE | re.DOTALL))
    assert len(named) > 40
    assert set(parts) == named
    for name, text in parts.items():
        assert re.search(r"^> .*^Cure: ", text, re.MULTILINE | re.DOTALL), name
    finding = Finding(check="clock", text="")
    assert finding.place == "docs/findings.md#clock"


def test_every_verdict_is_explained_with_an_example_and_a_cure() -> None:
    parts = dict(re.findall(r"^## ([\w ]+)\n(.*?)(?=^##|\Z)", PAGES["docs/verdicts.md"], re.MULTILINE | re.DOTALL))
    for verdict in get_args(Verdict):
        heading = verdict.capitalize()
        assert re.search(r"^> .*^Cure: ", parts[heading], re.MULTILINE | re.DOTALL), verdict
        assert verdict_place(verdict) == f"docs/verdicts.md#{heading.lower().replace(' ', '-')}"


def test_the_coverage_where_steps_disagree_shown_is_the_studys() -> None:
    for case, held in json.loads((ROOT / "studies/step_coverage.json").read_text())["cases"].items():
        assert step_coverage.row_of(case, held) in PAGES["docs/whole-log.md"]


def test_the_terms_shown_are_the_studys() -> None:
    page, study = PAGES["docs/laws/auto.md"], json.loads((ROOT / "studies/terms.json").read_text())
    for key, c in study["arm"].items():
        held = f"{100 * c['held'] / c['intervals']:.0f} %" if c["intervals"] else "–"
        assert f"| {key} | {c['found']} of {c['joints']} | {c['other']} of {c['asked']} | {held} |" in page
    for name, found in study["walk"].items():
        assert f"| {name} | {found} |" in page


def test_every_column_of_the_table_is_explained(tmp_path: Path) -> None:
    rows = list(rows_below("docs/result.md", "`friction_torque.parquet`"))
    named = {names_in(row[0])[0] for row in rows}
    friction = {"common": STRIBECK, "joints": {"*": {}}}
    biped = Scenario.model_validate({"robot": "biped", "simulator": "exact", "duration": 16.0, "friction": friction})
    walked = run_scenario(biped)
    result = identify(walked.log, walked.robot, method="curve-fit", table=tmp_path / "friction_torque.parquet")
    places = {f".{joint}": ".<joint>" for joint in result.joints}
    places |= {f".{axis}": ".<axis>" for axis in ("fx", "fy", "fz", "tx", "ty", "tz")}
    columns = [name.partition(".") for name in pq.read_schema(tmp_path / "friction_torque.parquet").names]
    assert {kind + places[dot + place] if dot else kind for kind, dot, place in columns} == named


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_setting_is_named_with_its_default(heading: str) -> None:
    fields = SECTIONS[heading].model_fields
    rows = {names_in(row[0])[0]: row for row in rows_below("docs/robot-file.md", heading) if len(row) == 5}
    channels = set(UNITS) if heading == "`[log]`" else set()
    assert set(rows) | channels == set(fields)
    for key, row in rows.items():
        default = fields[key].get_default()
        if default is PydanticUndefined:
            assert row[2] == "required"
        elif isinstance(default, BaseModel):
            assert row[2] == "table"
        elif default is None:
            assert row[2] == "—"
        else:
            shown = tomllib.loads(f"value = {row[2].strip('`')}")["value"]
            assert shown == (list(default) if isinstance(default, tuple) else default)


def test_every_unit_is_named() -> None:
    rows = [row for row in rows_below("docs/robot-file.md", "`[log.<channel>]`") if len(row) == 2]
    assert {names_in(row[0])[0]: names_in(row[1]) for row in rows} == {
        name: list(units) for name, units in UNITS.items()
    }


def test_every_filter_is_named_with_what_it_uses() -> None:
    rows = [row for row in rows_below("docs/robot-file.md", "`[identify.filter]`") if len(row) == 3]
    assert {names_in(row[0])[0]: set(names_in(row[1])) for row in rows} == TAKES


@pytest.mark.parametrize("name", [*LAWS, *LAWS_WITH_STATE, AUTO])
def test_every_law_has_a_page(name: str) -> None:
    assert f"({name}.md)" in PAGES["docs/laws/index.md"]
    rows = {names_in(row[0])[0]: row for row in rows_below(f"docs/laws/{name}.md") if len(row) == 4}
    for parameter in (*get_law(name).parameters, *(BEYOND_VELOCITY if name == AUTO else ())):
        _, symbol, unit, bounds = rows.pop(parameter.name)
        assert (symbol, unit) == (parameter.symbol, parameter.unit)
        assert bounds == _bounds_text(parameter.lower, parameter.upper)
    assert not rows


def test_every_term_is_named_with_its_parameters() -> None:
    rows = rows_below("docs/laws/auto.md", "How terms are chosen")
    assert {names_in(row[0])[0]: tuple(names_in(row[1])) for row in rows} == {
        term.name: term.parameters for term in LADDER
    }


def _bounds_text(lower: float, upper: float) -> str:
    if lower == -float("inf"):
        return "none"
    return f"{lower:g} and more" if upper == float("inf") else f"{_short(lower)} to {_short(upper)}"


def _short(value: float) -> str:
    return {1e-4: "1e-4", 1e4: "1e4"}.get(value, f"{value:g}")


def test_the_coverage_shown_is_the_studys() -> None:
    cases = json.loads((ROOT / "studies/coverage.json").read_text())["cases"]
    expected = {}
    for case, rows in cases.items():
        shares = [row["coverage"] for row in rows.values()]
        expected[case] = [f"{100 * min(shares):.1f} %", f"{100 * max(shares):.1f} %"]
    page = PAGES["docs/verdicts.md"].partition("### Coverage")[2].partition("\n## ")[0]
    shown = re.findall(r"^\| ([^|]+) \| ([\d.]+ %) \| ([\d.]+ %) \|$", page, re.MULTILINE)
    assert {case: rest for case, *rest in shown} == expected


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    text = re.sub(r"^```.*?^```$", "", PAGES[page], flags=re.MULTILINE | re.DOTALL)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if link.startswith(("http:", "https:", "mailto:")):
            continue
        file, _, anchor = link.partition("#")
        target = (ROOT / page).parent / file if file else ROOT / page
        assert target.exists(), link
        if anchor:
            assert anchor in _anchors(target.read_text()), link


def _anchors(text: str) -> set[str]:
    """Return the anchors that headings get: lower case, words joined by hyphens, other signs dropped."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_readme_has_the_figures_of_the_study_and_no_gaps() -> None:
    readme = PAGES["README.md"]
    cases = json.loads((ROOT / "studies/log_coverage.json").read_text())["cases"]
    order = ("coulomb", "viscous", "offset", "stribeck_gain", "stribeck_velocity", "slope")
    for label, rows in cases.items():
        shares = [100 * row["coverage"] for row in rows.values()]
        errors = " | ".join(f"{100 * rows[name]['mean_error']:.2f} %" for name in order)
        assert f"| {label} | {errors} | {min(shares):.1f} to {max(shares):.1f} % |" in readme
    assert not re.search(r"@[A-Z]+@", readme)


def test_every_check_has_a_paragraph_on_findings() -> None:
    """Checks are the names in the code; each has a heading, an example and a cure."""
    source = "\n".join(path.read_text() for path in (ROOT / "src/stribeck").rglob("*.py"))
    named = set(re.findall(r'check="([\w-]+)"', source)) | {f"{FRICTION}{kind}" for kind in SENTENCES} | {UNCLEAR}
    named |= {"torque-delay", "base-orientation-delay"}
    parts = dict(re.findall(r"^### ([\w-]+)\n(.*?)(?=^##|\Z)", PAGES["docs/findings.md"], re.MULTILINE | re.DOTALL))
    assert named <= set(parts)
    assert [name for name in named - {"base-orientation-delay"} if "Cure:" not in parts[name]] == []


def test_how_often_findings_are_right_is_the_studys() -> None:
    told = json.loads((ROOT / "studies/what_is_told.json").read_text())["told"]
    for row in what_is_told.table(told):
        assert row in PAGES["docs/findings.md"]
