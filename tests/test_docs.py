"""The documentation says what the code does: its code runs, its tables are the code's, its links lead somewhere."""

import dataclasses
import json
import re
import runpy
import shlex
import shutil
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_args
from unittest import mock

import pyarrow.parquet as pq
import pytest
import typer
from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from tests.arm import arm_log, save_npz, write_arm
from tests.log.readers.messages import messages_of, write_messages
from tests.models import EXAMPLES, MODELS, STRIBECK
from tests.test_layers import ROOMS

from stribeck import Robot, identify, read_result
from stribeck.app.cli.app import app
from stribeck.core import result, settings
from stribeck.core.base.finding import FRICTION, Finding, catalogue
from stribeck.core.estimator.fit_checks.misfits import KINDS
from stribeck.core.filters.filters import TAKES
from stribeck.core.friction import AUTO, LAWS, LAWS_WITH_STATE, get_law
from stribeck.core.friction.terms import BEYOND_VELOCITY, LADDER
from stribeck.core.identify import METHODS
from stribeck.core.result.estimates import Verdict, verdict_place
from stribeck.core.robot import robot_fields
from stribeck.io.readers.mapping import UNITS, check_table
from stribeck.simulation.run import run_scenario
from stribeck.simulation.scenario import Scenario

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {str(path.relative_to(ROOT)): path.read_text() for path in [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]}
SECTIONS: dict[str, type[BaseModel]] = {
    "`[robot]`": settings.RobotTable,
    "`[contacts.<foot>]`": settings.ContactTable,
    "`[log]`": settings.LogTable,
    "`[log.<channel>]`": settings.ChannelTable,
    "`[identify]`": settings.Settings,
    "`[identify.filter]`": settings.FilterSettings,
    "`[identify.support]`": settings.SupportSettings,
    "`[identify.priors]`": settings.Priors,
}
"""Headings of docs/robot-file.md and docs/settings.md, and what they describe."""


class Block(NamedTuple):
    """A fenced block: what its fence says, and its text."""

    kind: str
    text: str


@cache
def blocks(page: str) -> list[Block]:
    return [Block(*pair) for pair in re.findall(r"^```([^\n]*)\n(.*?)^```$", PAGES[page], re.MULTILINE | re.DOTALL)]


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
    log = arm_log(robot, duration=12, rate=250)
    for name in ("log.npz", "walk.npz"):
        save_npz(log, folder / name)
    write_messages(folder / "walk.mcap", messages_of(log))
    (folder / "OUT").mkdir()
    found = identify(folder / "log.npz", robot, table=folder / "OUT/friction_torque.parquet")
    (folder / "OUT/result.json").write_text(found.to_json())
    return folder


@pytest.fixture
def here(workshop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same files, to work among."""
    shutil.copytree(workshop, tmp_path, dirs_exist_ok=True)
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
    robot_table = {"model": "robot.urdf", **document.pop("robot", {})}
    file = settings.RobotFile.model_validate({"robot": robot_table, **document})
    check_table(file.log, "robot.toml")
    models = {Path(path).name: path for path, *_ in MODELS.values()}
    if file.robot.model in models:
        model = file.robot.model_copy(update={"model": models[file.robot.model]})
        robot = Robot(**robot_fields(file.model_copy(update={"robot": model}), EXAMPLES / "robot.toml"))
        assert set(file.robot.locked).isdisjoint(robot.joint_names)


def commands() -> list[list[str]]:
    """Return the stribeck commands of code and of last columns, each once; what two spaces set off is a remark."""
    found = {}
    for text in PAGES.values():
        in_tables = re.findall(r"\| `(stribeck .*)` \|$", text, re.MULTILINE)
        for line in re.findall(r"^(?: {4,})?(?:\$ )?(stribeck .*)$", text, re.MULTILINE) + in_tables:
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
    settings = {name for term in LADDER for name in term.settings}
    assert all(f"`{name}`" in PAGES["docs/laws/auto.md"] for name in settings)
    carriers = [
        each for each in vars(result).values() if dataclasses.is_dataclass(each) and each is not result.Evidence
    ]
    for carrier in carriers:
        parts = {"evidence", "log", "validation", "torque_r2", *settings}
        assert {field.name for field in dataclasses.fields(carrier)} - parts <= named, carrier
    assert len(carriers) >= 10


@pytest.mark.parametrize("name", ["findings", "cli", "library"])
def test_generated_pages_are_current(name: str) -> None:
    page = runpy.run_path(str(DOCS / f"extensions/{name}.py"))["page"]()
    assert page == PAGES[f"docs/{name}.md"], f"run `python docs/extensions/{name}.py`"


def test_every_finding_of_the_code_is_in_the_catalogue_with_an_explanation_and_an_example() -> None:
    source = "\n".join(file.read_text() for file in (ROOT / "src/stribeck").rglob("*.py"))
    entries = {kind: entry for section in catalogue().values() for kind, entry in section.items()}
    named = {kind for kind in entries if f'"{kind}"' in source} | {FRICTION + kind for kind in (*KINDS, "unclear")}
    assert set(re.findall(r'Finding\.of\(\s*"([^"]+)"', source)) <= named == set(entries)
    for kind, entry in entries.items():
        assert "." in kind or {"explanation", "example", "text"} <= entry.keys()
    assert Finding(check="clock", text="").place == "stribeck explain clock"


def test_every_verdict_is_explained_with_an_example_and_a_remedy() -> None:
    parts = dict(re.findall(r"^## ([\w ]+)\n(.*?)(?=^##|\Z)", PAGES["docs/verdicts.md"], re.MULTILINE | re.DOTALL))
    for verdict in get_args(Verdict):
        heading = verdict.capitalize()
        assert re.search(r"^> .*^Remedy: ", parts[heading], re.MULTILINE | re.DOTALL), verdict
        assert verdict_place(verdict) == f"stribeck explain {heading.lower().replace(' ', '-')}"


def test_every_column_of_the_table_is_explained(tmp_path: Path) -> None:
    rows = list(rows_below("docs/result.md", "`friction_torque.parquet`"))
    named = {names_in(row[0])[0] for row in rows}
    friction = {"common": STRIBECK, "joints": {"*": {}}}
    biped = Scenario.model_validate({"robot": "biped", "simulator": "exact", "duration": 8.0, "friction": friction})
    walked = run_scenario(biped)
    found = identify(walked.log, walked.robot, method="curve-fit", table=tmp_path / "friction_torque.parquet")
    places = {f".{joint}": ".<joint>" for joint in found.joints}
    places |= {f".{axis}": ".<axis>" for axis in ("fx", "fy", "fz", "tx", "ty", "tz")}
    columns = [name.partition(".") for name in pq.read_schema(tmp_path / "friction_torque.parquet").names]
    assert {kind + places[dot + place] if dot else kind for kind, dot, place in columns} == named


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_setting_is_named_with_its_default(heading: str) -> None:
    fields = SECTIONS[heading].model_fields
    page = "docs/settings.md" if "[identify" in heading else "docs/robot-file.md"
    rows = {names_in(row[0])[0]: row for row in rows_below(page, heading) if len(row) == 5}
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


TABLES = [
    ("docs/robot-file.md", "`[log.<channel>]`", 2, list, {name: list(units) for name, units in UNITS.items()}),
    ("docs/settings.md", "`[identify.filter]`", 3, set, TAKES),
    ("docs/laws/auto.md", "How terms are chosen", 3, tuple, {term.name: term.names for term in LADDER}),
]
"""Page, heading and columns of tables that have, by a name, other names; whether their order counts; those names."""


@pytest.mark.parametrize(("page", "heading", "columns", "kind", "known"), TABLES, ids=["units", "filters", "terms"])
def test_tables_name_what_the_code_has(page: str, heading: str, columns: int, kind: type, known: object) -> None:
    rows = [row for row in rows_below(page, heading) if len(row) == columns]
    assert {name: kind(names_in(row[1])) for row in rows for name in names_in(row[0])} == known


def test_the_map_of_the_house_has_every_room_and_recipes_name_existing_files() -> None:
    house = runpy.run_path(str(DOCS / "diagrams.py"))["HOUSE"]
    assert {room for floor in house for room in floor} == set(ROOMS)
    drawn = (DOCS / "assets/house-light.svg").read_text()
    assert all(f">{room}<" in drawn for room in ROOMS)
    for name in re.findall(r"`([\w/]+\.(?:py|toml))`", PAGES["docs/extending.md"]):
        assert list(ROOT.glob(name)) or list(ROOT.glob(f"src/stribeck/**/{name}")), name


@pytest.mark.parametrize("name", [*LAWS, *LAWS_WITH_STATE, AUTO])
def test_every_law_has_a_page(name: str) -> None:
    assert f"({name}.md)" in PAGES["docs/laws/index.md"]
    rows = {names_in(row[0])[0]: row for row in rows_below(f"docs/laws/{name}.md") if len(row) == 4}
    for parameter in (*get_law(name).parameters, *(BEYOND_VELOCITY if name == AUTO else ())):
        _, symbol, unit, bounds = rows.pop(parameter.name)
        assert (symbol, unit) == (parameter.symbol, parameter.unit)
        assert bounds == _bounds_text(parameter.lower, parameter.upper)
    assert not rows


def _bounds_text(lower: float, upper: float) -> str:
    if lower == -float("inf"):
        return "none"
    low, high = ({1e-4: "1e-4", 1e4: "1e4"}.get(bound, f"{bound:g}") for bound in (lower, upper))
    return f"{low} and more" if upper == float("inf") else f"{low} to {high}"


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


ESTIMATOR = "".join((ROOT / "docs" / name).read_text() for name in ("estimator.md", "estimator-fit.md"))


def test_modules_are_there() -> None:
    named = re.findall(r"`([\w/]+\.py)`", ESTIMATOR)
    assert len(named) > 20
    for name in named:
        assert (ROOT / "src/stribeck" / name).is_file(), name


def test_equations_are_numbered_in_order() -> None:
    numbers = [int(number) for number in re.findall(r"\\text\{\((\d+)\)\}", ESTIMATOR)]
    assert numbers == list(range(1, len(numbers) + 1))
