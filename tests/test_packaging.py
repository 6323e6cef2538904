"""What is given away: the wheel, the source archive, the citation and the container hold what they should, no more."""

import shlex
import tomllib
import zipfile
from pathlib import Path, PurePosixPath

import pytest
import typer
import yaml

from stribeck import __version__
from stribeck.app.cli.app import app

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
SUFFIXES = {".md", ".py", ".pyi", ".typed", ".j2", ".js", ".css", ".toml", ".urdf", ".xml"}
"""Of what the packages need: code, templates of reports, and the robots that are simulated."""
WHEEL_BYTES = 1_019_000
"""At most; it was 0.78 MB when this was written."""
PACKAGED = {
    path.relative_to(ROOT / "src").as_posix()
    for path in (ROOT / "src").rglob("*")
    if path.is_file() and "__pycache__" not in path.parts and not path.parts[-2].endswith(".egg-info")
}


def test_packages_contain_only_code_templates_and_robots() -> None:
    assert {PurePosixPath(name).suffix for name in PACKAGED} <= SUFFIXES | {""}
    assert {name for name in PACKAGED if not PurePosixPath(name).suffix} == {"stribeck/app/report/uplot/LICENSE"}


def test_the_wheel_contains_only_the_packages(tmp_path: Path) -> None:
    builders = pytest.importorskip("hatchling.builders.wheel", reason="hatchling is not installed: nothing is built")
    (wheel,) = map(Path, builders.WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"]))
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        information = f"stribeck-{__version__}.dist-info"
        metadata = archive.read(f"{information}/METADATA").decode()
        scripts = archive.read(f"{information}/entry_points.txt").decode()
    packaged = {name for name in PACKAGED if not name.endswith(("README.md", "LICENSE")) and "/toro/" not in name}
    assert {name for name in names if not name.startswith(information)} == packaged
    assert f"{information}/licenses/LICENSE" in names
    assert "License-Expression: Apache-2.0" in metadata
    assert "stribeck = stribeck.app.cli:main" in scripts
    assert wheel.stat().st_size < WHEEL_BYTES


def test_the_citation_agrees_with_the_package() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors"} <= set(citation)  # what its schema 1.2.0 requires
    assert str(citation["version"]) == PROJECT["version"] == __version__
    known = (citation["title"], citation["license"], citation["keywords"])
    assert known == (PROJECT["name"], PROJECT["license"], PROJECT["keywords"])
    assert [author["name"] for author in citation["authors"]] == [author["name"] for author in PROJECT["authors"]]


def test_the_recipe_has_the_requirements_of_the_package() -> None:
    recipe = yaml.safe_load((ROOT / "packaging" / "recipe.yaml").read_text())
    own = {name.replace("pin>", "pinocchio>").replace(">", " >") for name in PROJECT["dependencies"]}
    assert set(recipe["requirements"]["run"]) == own | {f"python {PROJECT['requires-python']}"}
    assert recipe["package"] == {"name": PROJECT["name"], "version": __version__}
    assert recipe["build"]["python"]["entry_points"] == [f"{key} = {own}" for key, own in PROJECT["scripts"].items()]
    about = recipe["about"]
    assert (about["summary"], about["license"], about["license_file"]) == tuple(
        PROJECT[key] for key in ("description", "license", "license-files")
    )


def test_the_container_runs_the_demonstration_as_a_user() -> None:
    text = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")
    steps = [line.split(maxsplit=1) for line in text.splitlines() if line and not line.startswith("#")]
    ignored = (ROOT / ".dockerignore").read_text().splitlines()
    copied = [name for step, words in steps if step == "COPY" for name in shlex.split(words)[:-1]]
    for name in copied:
        assert (ROOT / name).exists(), name
        assert f"!{name}" in ignored, name
    assert {"pyproject.toml", "src", "LICENSE", Path(PROJECT["readme"]).name} <= set(copied)  # what the build reads
    last = dict(steps)  # of each kind the last step, which is what counts
    assert last["USER"] not in ("root", "0")
    assert last["ENTRYPOINT"] == '["stribeck"]'
    (command,) = yaml.safe_load(last["CMD"])
    assert command in typer.main.get_group(app).commands
    base = last["FROM"].removeprefix("python:").removesuffix("-slim")
    assert f"Programming Language :: Python :: {base}" in PROJECT["classifiers"]
