"""Public names: exactly these, imported at first use, each with an example that runs."""

import doctest
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from tests.arm import arm_log, save_npz, write_arm

import stribeck
from stribeck import Robot, Settings, identify
from stribeck.core import errors, result
from stribeck.core.friction import LAWS
from stribeck.core.settings import FilterSettings

ERRORS = {"LogError", "NothingIdentifiedError", "RobotFileError", "SettingsError", "StribeckError", "UnknownJointError"}
PUBLIC = ERRORS | {"FrictionLaw", "MomentumObserver", "OnlineFriction", "Result", "Robot", "RobotLog", "Settings"}
PUBLIC |= {"compare", "export", "identify", "inspect_log", "plan", "read_log", "read_result", "register_law"}
PUBLIC |= {"replay", "write_log", "write_report", "__version__"}
METHODS = {f"Result.{name}" for name in ("covariance", "predict", "score", "scores", "to_dataframe")}
METHODS |= {"JointResult.friction", "JointResult.plot", "Robot.from_file", "Robot.from_model"}
METHODS |= {"RobotLog.from_frame", "RobotLog.to_frame"}
WITHOUT_EXAMPLE = {"__version__"}


def test_the_public_names_are_these() -> None:
    assert set(dir(stribeck)) == PUBLIC
    assert {name for name in vars(errors) if name.endswith("Error")} == ERRORS
    assert all(getattr(stribeck, name) for name in PUBLIC)
    with pytest.raises(AttributeError, match="attribute indentify"):
        getattr(stribeck, "indentify")  # noqa: B009


def test_identify_imports_no_part_of_scipy() -> None:
    program = "import sys; from stribeck import identify; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not [name for name in loaded if name.startswith("scipy.") and name[6] != "_" and name != "scipy.version"]


def test_modules_are_found_by_their_old_names_too() -> None:
    for name in ("online.estimator", "log.readers.read", "result.compare", "friction.register", "pipeline"):
        module = import_module(f"stribeck.{name}")
        assert module.__name__ != f"stribeck.{name}"
        assert module is import_module(module.__name__)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Prepare the examples: a folder with the arm, a log and its result, and the public names."""
    folder = tmp_path_factory.mktemp("desk")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        log = arm_log(Robot.from_file(write_arm(Path())), duration=12)
        save_npz(log, Path("log.npz"))
        robot = Robot.from_file("robot.toml")
        result = identify("log.npz", robot)
        Path("out").mkdir()
        Path("out/result.json").write_text(result.to_json())
    names = {name: getattr(stribeck, name) for name in PUBLIC}
    names |= {"np": np, "Settings": Settings, "FilterSettings": FilterSettings}
    return names | {"folder": folder, "robot": robot, "log": log, "result": result}


@pytest.mark.parametrize("name", [*sorted(PUBLIC - WITHOUT_EXAMPLE), *sorted(METHODS)])
def test_the_example_of_each_public_name_runs(name, desk, monkeypatch, tmp_path):
    thing: Any = result if name.startswith("JointResult") else stribeck
    for part in name.split("."):
        thing = getattr(thing, part)
    for file in desk["folder"].rglob("*.*"):
        place = tmp_path / file.relative_to(desk["folder"])
        place.parent.mkdir(exist_ok=True)
        place.symlink_to(file)
    monkeypatch.chdir(tmp_path)
    text = inspect.getdoc(thing) or ""
    example = doctest.DocTestParser().get_doctest(text, dict(desk), name, None, 0)
    assert example.examples
    said: list[str] = []
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    with mock.patch.dict(LAWS):
        failed = doctest.DocTestRunner(optionflags=flags).run(example, out=said.append).failed
    assert not failed, "".join(said)


def test_objects_are_one_line_of_text_and_a_table_in_notebooks(desk: dict[str, Any]) -> None:
    result, robot, log = desk["result"], desk["robot"], desk["log"]
    others = (stribeck.compare(result, result), stribeck.plan(result, robot), stribeck.inspect_log(log, robot))
    for thing in (result, result.joints["elbow"], robot, log, *others):
        assert len(repr(thing)) < 250
        page = thing._repr_html_()
        assert page.startswith("<table><caption>")
        assert len(page) < 10_000
