"""Robots of examples/robots: scenarios give logs, `identify` finds their friction, `init` drafts the robot file."""

import os
import tomllib
from pathlib import Path

import pytest

from stribeck import Settings, identify, write_log
from stribeck.check.init import draft_robot_file
from stribeck.simulation.run import run_scenario
from stribeck.simulation.scenario import read_scenario

ROBOTS = Path(__file__).parents[1] / "examples/robots"
NAMES = sorted(path.name for path in ROBOTS.iterdir() if path.is_dir())
LONG = {"a1", "anymal-c", "g1", "gen3", "go1", "h1", "icub", "iiwa14", "solo12", "ur10", "ur10e", "ur5", "ur5e"}
"""Robots similar to others that are always tested."""
TOLERANCE = 0.05
"""Relative tolerance of Coulomb friction, as in docs/robots.md."""


def require(model: str) -> None:
    """Skip a test whose model robot_descriptions would have to download first."""
    name = model.removeprefix("package:")
    if not name.endswith("_description"):
        return
    descriptions = pytest.importorskip("robot_descriptions").DESCRIPTIONS
    kept = Path(os.environ.get("ROBOT_DESCRIPTIONS_CACHE", "~/.cache/robot_descriptions")).expanduser()
    repository = descriptions[name].repository
    if not any((kept / repository).glob("[!.]*")):
        pytest.skip(f"{repository} is not in {kept}; `python -m robot_descriptions pull {name}` downloads it")


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.long] * (name in LONG)) for name in NAMES])
def test_friction_of_an_example_comes_back(name: str, tmp_path: Path) -> None:
    file = tomllib.loads((ROBOTS / name / "robot.toml").read_text())
    require(file["robot"]["model"])
    simulated = run_scenario(read_scenario(ROBOTS / name / "scenario.toml"), ROBOTS / name)
    found = identify(simulated.log, simulated.robot, Settings(method="curve-fit", law="coulomb-viscous"))
    for joint, result in found.joints.items():
        truth = simulated.truth.parameters[joint]
        assert result.verdict == "identified", f"{joint}: {result.reason}"
        assert result.parameters["coulomb"].value == pytest.approx(truth["coulomb"], rel=TOLERANCE), joint
    log = tmp_path / "log.npz"
    write_log(simulated.log, log)
    model = file["robot"]["model"]
    model = model if model.startswith("package:") else str(ROBOTS / name / model)
    drafted = tomllib.loads(draft_robot_file(model, log, tmp_path / "robot.toml").text)
    for key in ("base", "torque_source"):
        assert drafted["robot"][key] == file["robot"][key]
    assert set(drafted["robot"].get("locked", {})) == set(file["robot"].get("locked", {}))
    assert drafted.get("contacts", {}) == file.get("contacts", {})
    assert "log" not in drafted


@pytest.mark.parametrize("name", NAMES)
def test_every_example_stands_in_the_documentation(name: str) -> None:
    page = (ROBOTS.parents[1] / "docs/robots.md").read_text()
    file = tomllib.loads((ROBOTS / name / "robot.toml").read_text())
    row = next(line for line in page.splitlines() if f"../examples/robots/{name}/robot.toml" in line)
    assert f"| [{file['robot']['name']}](" in row
    assert f"| `{file['robot']['model']}` |" in row
