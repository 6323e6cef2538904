"""Sound inputs, one of every kind, from which the wrong ones are made."""

import gc
import shutil
from importlib import import_module
from pathlib import Path

from fuzz.log_file import make_logs
from stribeck.pipeline import identify
from stribeck.robot import Robot
from stribeck.settings import Settings
from stribeck_simulation.files import write_simulated
from stribeck_simulation.run import run_scenario
from stribeck_simulation.scenario import FrictionTable, Scenario

MODELS = Path(__file__).parent / "models"
"""The same arm as URDF and MJCF, with its robot file."""
USED = (
    *("stribeck.inspection", "stribeck.report", "stribeck.report.inspection", "stribeck.export"),
    *("stribeck.replay.replay", "stribeck.report.replay"),
    *(
        "stribeck.result.compare",
        "stribeck.robot.mjcf",
        "stribeck.log.readers.arrays",
        "stribeck.log.readers.matlab",
        "stribeck.log.readers.tables",
    ),
    *("stribeck.log.readers.bags", "stribeck_simulation.run", "stribeck.cli.console"),
)


def make_seeds(folder: Path) -> None:
    """Write an arm's models, its robot file, a log (log.npz), and what is found in a longer one (result.json)."""
    for path in MODELS.iterdir():
        shutil.copy(path, folder)
    scenario = Scenario(
        robot="robot.toml",
        simulator="exact",
        sensors="realistic",
        duration=8.0,
        friction=FrictionTable(law="coulomb-viscous", joints={"*": {"viscous": 0.2, "coulomb": 0.5, "offset": 0.1}}),
    )
    long = run_scenario(scenario, folder)
    short = run_scenario(scenario.model_copy(update={"duration": 1.0}), folder)
    write_simulated(short.log, short.truth, folder / "log.npz")
    make_logs(folder / "logs", short.log.joint_names)
    found = identify(long.log, Robot.from_file(folder / "robot.toml"), Settings())
    write_simulated(long.log, long.truth, folder / "long/log.npz")
    (folder / "result.json").write_text(found.to_json(), encoding="utf-8")


def import_all() -> None:
    """Import what commands import when they need it, once for all inputs, and keep its memory shared with children."""
    for name in USED:
        import_module(name)
    gc.freeze()
