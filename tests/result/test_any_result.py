"""Results with odd names and values: printed as they are, exported, or refused by key."""

import io
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from tests.exporters.found import found_in
from tests.result.made import estimate, joint, result
from tests.robot.test_robot import write_robot

from stribeck.app.cli import console
from stribeck.app.comparison import compare
from stribeck.app.exporters import export
from stribeck.core.errors import SettingsError
from stribeck.core.result import Result, read_result
from stribeck.core.robot import Robot
from stribeck.simulation import truth_table


def printed(show: Callable[[Any], None], found: Any) -> str:
    with redirect_stdout(io.StringIO()) as out:
        show(found)
    return out.getvalue()


def plain(name: str = "shoulder", value: float = 1.0, standard_error: float = 0.1) -> Result:
    """Return a result with one parameter of one joint."""
    found = replace(estimate(1.0), value=value, standard_error=standard_error)
    made = result("coulomb-viscous", "walk.npz", **{name: joint({"coulomb": found}, samples=9)})
    return replace(made, robot="arm")


@pytest.mark.parametrize("name", ["[/]", "[red]", "[left]", ":cat:", "left's", "el\\", "\\[x]"])
def test_names_are_printed_as_they_are(name: str) -> None:
    result = replace(plain(name), robot=name)
    silent = replace(result.joints[name], parameters={}, reason=name)
    assert printed(console.print_result, result).count(name) == 3  # title, line, parameters
    assert f"{name}\\" not in printed(console.print_result, result)
    assert printed(console.print_comparison, compare(result, result)).count(name) == 2  # conclusion and line
    quiet = replace(result, joints={name: silent})
    assert printed(lambda found: console.print_table(truth_table(found, {})), quiet).count(name) == 3


@pytest.mark.parametrize("name", ["walk---1.npz", "walk\x01.npz", "walk\n-->.npz"])
def test_a_model_may_name_any_log(tmp_path: Path, name: str) -> None:
    robot = Robot.from_file(write_robot(tmp_path))
    result, _ = found_in(robot)
    export(replace(result, log=replace(result.log, path=name)), robot, tmp_path / "out.urdf", "urdf")
    ElementTree.parse(tmp_path / "out.urdf")


UNSOUND = {
    "not a number": ('"value": 1.0', '"value": NaN', "is not JSON"),
    "infinite": ('"value": 1.0', '"value": 1e999', "is not JSON"),
    "text": ('"value": 1.0', '"value": "1"', "key 'joints.shoulder.parameters.coulomb.value' is '1'"),
    "no interval": ("[\n            0.8,\n            1.2\n          ]", "[0.8]", "parameters.coulomb.interval_95"),
    "a truth for a number": ('"samples": 9', '"samples": true', "key 'joints.shoulder.samples' is True"),
    "nothing": ('"joints": {', '"joints": null, "x": {', "key 'joints' is None"),
    "deep": ('"schema": 1', '"schema": 1, "x": ' + "[" * 10**5 + "]" * 10**5, "is not JSON"),
    "mark": ("{\n", "\ufeff{\n", None),
}


@pytest.mark.parametrize("case", UNSOUND)
def test_an_unsound_result_is_refused_by_key(tmp_path: Path, case: str) -> None:
    old, new, words = UNSOUND[case]
    text = plain().to_json()
    assert old in text
    path = tmp_path / "result.json"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    if words is None:
        assert read_result(path) == plain()
        return
    with pytest.raises(SettingsError, match=words) as caught:
        read_result(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value)) < 600
