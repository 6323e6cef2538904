"""Commands that need the simulation packages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stribeck.base.outputs import check_outputs, staged_folder
from stribeck.cli import console, options
from stribeck.cli.options import REPORT, RESULT, TABLE
from stribeck.errors import SettingsError, require_extra

if TYPE_CHECKING:
    from stribeck.result import Result


def simulate(
    scenario: Annotated[
        Path, typer.Argument(metavar="SCENARIO", help="Scenario file: robot, motion, sensors and friction.")
    ],
    output: Annotated[Path, options.output("FILE", "Log to write (.npz).")],
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate a robot: write a log and its ground truth."""
    require_extra("simulation", "mujoco", "daqp")
    from stribeck_simulation.files import truth_file, write_simulated
    from stribeck_simulation.run import run_scenario
    from stribeck_simulation.scenario import read_scenario

    if output.suffix != ".npz":
        raise SettingsError(f"--output {output}: the suffix is '{output.suffix}'; simulated logs are written as .npz")
    chosen = read_scenario(scenario)
    check_outputs([output, truth_file(output)], [scenario, scenario.parent / chosen.robot], overwrite)
    with console.progress_bar(quiet) as progress:
        found = run_scenario(chosen, scenario.parent, lambda share: progress(f"simulating {scenario.stem}", share))
    truth = write_simulated(found.log, found.truth, output)
    if not quiet:
        console.print_paths([output, truth, Path(found.robot.path)])


def demo(
    output: Annotated[Path, options.output("FOLDER", "Folder for the log and the results.")] = Path("demo"),
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Identify a simulated walking humanoid, compare with truth."""
    require_extra("simulation", "mujoco", "daqp")
    from stribeck.pipeline import identify as run
    from stribeck.report import write_report
    from stribeck.robot import Robot
    from stribeck_simulation.demo import FILES, make_demo, truth_reference
    from stribeck_simulation.pictures.section import walk_section

    check_outputs([output / name for name in (*FILES, RESULT, REPORT, TABLE)], [], overwrite)
    with staged_folder(output) as staging, console.progress_bar(quiet) as progress:
        example = make_demo(staging, lambda share: progress("simulating a walk", share))
        machine = Robot.from_file(example.robot_file)
        result = run([example.log], machine, table=staging / TABLE, progress=progress)
        result = _moved(result, str(staging), str(output))
        progress("writing the report", 0.9)
        (staging / RESULT).write_text(result.to_json(), encoding="utf-8")
        truth = truth_reference(result, example.law, example.parameters)
        write_report(result, staging / REPORT, reference=truth, further=[walk_section(example.walk)])
    if not quiet:
        console.print_truth(result, example.parameters)
        console.print_paths([output / name for name in (example.log.name, RESULT, TABLE, REPORT)])


def _moved(result: Result, staging: str, output: str) -> Result:
    """Replace the staging folder by the output folder in the paths of a result with one log."""
    assert isinstance(result.log.path, str)
    assert result.evidence is not None
    provenance = [(label, text.replace(staging, output)) for label, text in result.evidence.provenance]
    return replace(
        result,
        log=replace(result.log, path=result.log.path.replace(staging, output)),
        evidence=replace(result.evidence, provenance=provenance),
    )
