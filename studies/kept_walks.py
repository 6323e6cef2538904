"""Cache of simulated walks under build/, valid until the scenario, the robot or the simulator changes."""

import hashlib
from importlib.metadata import version
from pathlib import Path

import stribeck
from stribeck import Robot, read_log
from stribeck.simulation.files import read_truth, write_simulated
from stribeck.simulation.run import Simulated, robot_file, run_scenario
from stribeck.simulation.scenario import Scenario
from studies.command import ROOT, of_code

FOLDER = ROOT / "build" / "walks"
SOURCES = ("simulation", "core/friction", "core/robot")
"""Packages that a simulated log depends on."""


def kept_walk(label: str, scenario: Scenario, folder: Path = Path()) -> Simulated:
    """Load the walk of a scenario, or simulate it and replace an outdated walk with the same label.

    Parameters
    ----------
    label
        Name of its file.
    scenario
        Scenario that defines the walk completely.
    folder
        Folder that the robot file's path is relative to.
    """
    file = robot_file(scenario, folder)
    path = FOLDER / f"{label}.{_digest(scenario, file)}.npz"
    if not path.exists():
        found = run_scenario(scenario, folder)
        FOLDER.mkdir(parents=True, exist_ok=True)
        for outdated in FOLDER.glob(f"{label}.*.npz"):
            outdated.unlink()
        write_simulated(found.log, found.truth, path)
    robot = Robot.from_file(file)
    return Simulated(robot, read_log(path, robot), read_truth(path))


def _digest(scenario: Scenario, robot_file: Path) -> str:
    """Compute a short hash of all inputs of a simulated log."""
    there = str(Path(stribeck.__file__).parent)  # the package's location does not matter
    parts = [scenario.model_dump_json(), robot_file.read_text(encoding="utf-8").replace(there, "")]
    text = "\n".join([*parts, version("mujoco"), version("pin"), of_code(*SOURCES)])
    return hashlib.sha256(text.encode()).hexdigest()[:12]
