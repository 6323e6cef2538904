"""Commands that need the simulation packages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stribeck.app.cli import console, options
from stribeck.app.cli.console import print_table, say
from stribeck.app.cli.options import REPORT, RESULT, TABLE, argument, option, output_option
from stribeck.core.base.outputs import check_outputs, staged_folder
from stribeck.core.errors import SettingsError, StribeckError, require_extra

if TYPE_CHECKING:
    from stribeck.core.result import Result


def simulate(
    scenario: Annotated[Path, argument("SCENARIO", "Scenario file: robot, motion, sensors and friction.")],
    output: Annotated[Path, output_option("FILE", "Log to write (.npz).")],
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate a robot: write a log and its ground truth."""
    require_extra("simulation", "mujoco", "daqp")
    from stribeck.simulation import read_scenario, run_scenario, truth_file, write_simulated

    if output.suffix != ".npz":
        raise SettingsError(f"--output {output}: the suffix is '{output.suffix}'; simulated logs are written as .npz")
    chosen = read_scenario(scenario)
    check_outputs([output, truth_file(output)], [scenario, scenario.parent / chosen.robot], overwrite)
    with console.progress_bar(quiet) as progress:
        simulation = run_scenario(chosen, scenario.parent, lambda share: progress(f"simulating {scenario.stem}", share))
    truth = write_simulated(simulation.log, simulation.truth, output)
    if not quiet:
        console.print_paths([output, truth, Path(simulation.robot.path)])


def demo(
    output: Annotated[Path, output_option("FOLDER", "Folder for the log and the results.")] = Path("demo"),
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Identify a simulated walking humanoid, compare with truth."""
    require_extra("simulation", "mujoco", "daqp")
    from stribeck.core.identify.pipeline import identify as run
    from stribeck.core.robot import Robot
    from stribeck.simulation import FILES, make_demo, truth_reference, truth_table

    check_outputs([output / name for name in (*FILES, RESULT, REPORT, TABLE)], [], overwrite)
    with staged_folder(output) as staging, console.progress_bar(quiet) as progress:
        example = make_demo(staging, lambda share: progress("simulating a walk", share))
        machine = Robot.from_file(example.robot_file)
        result = run([example.log], machine, table=staging / TABLE, progress=progress)
        result = _moved(result, str(staging), str(output))
        truth = truth_reference(result, example.law, example.parameters)
        options.write_result(result, staging, progress, reference=truth)
    if not quiet:
        print_table(truth_table(result, example.parameters))
        console.print_paths([output / name for name in (example.log.name, RESULT, TABLE, REPORT)])


def rehearse(
    robot: Annotated[Path, argument("ROBOT", "Robot file (robot.toml).")],
    log: Annotated[Path | None, argument("LOG", "A log with the motion to expect.")] = None,
    output: Annotated[Path, output_option("FOLDER", "Folder for the simulated log and its result.")] = Path(
        "rehearsal"
    ),
    duration: Annotated[float, option("SECONDS", "Duration of the motion without LOG.")] = 60.0,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate and identify your robot, to see what to expect.

    Simulates motion, rate, noise and friction of LOG and its result, or the trajectory of `plan`.
    """
    require_extra("simulation", "mujoco", "daqp")
    from stribeck.core.identify.pipeline import identify as run
    from stribeck.core.robot import Robot
    from stribeck.design import first_motion, measured_robot, motion_of_log
    from stribeck.design import rehearse as simulated
    from stribeck.io import write_log
    from stribeck.simulation import expectation_table, truth_reference

    machine = Robot.from_file(robot)
    outputs = [output / name for name in ("log.npz", RESULT, REPORT, TABLE)]
    options.check_files(outputs, [*([log] if log else []), *options.files_of(machine)], overwrite)
    with staged_folder(output) as staging, console.progress_bar(quiet) as progress:
        progress("reading the motion" if log else "planning the motion", 0.05)
        try:
            before = run(log, machine, progress=progress) if log else None
        except StribeckError:
            before = None  # motion and noise of the log are known without a result
        motion = motion_of_log(machine, log, before) if log else first_motion(machine, duration)
        machine = measured_robot(machine)
        recording, law, parameters = simulated(machine, motion)
        write_log(recording, staging / "log.npz")
        result = run(recording, machine, table=staging / TABLE, progress=progress)
        options.write_result(result, staging, progress, reference=truth_reference(result, law, parameters))
    if not quiet:
        conclusion, table = expectation_table(result, parameters, motion.notes)
        say([conclusion])
        print_table(table)
        console.print_paths(outputs)


def _moved(result: Result, staging: str, output: str) -> Result:
    """Replace the staging folder by the output folder in the paths of a result with one log."""
    log, robot_file, evidence = result.log, result.robot_file, result.evidence
    assert isinstance(log.path, str)
    assert robot_file
    assert evidence
    provenance = [(label, text.replace(staging, output)) for label, text in evidence.provenance]
    log = replace(log, path=log.path.replace(staging, output))
    robot_file = replace(robot_file, path=robot_file.path.replace(staging, output))
    return replace(result, log=log, robot_file=robot_file, evidence=replace(evidence, provenance=provenance))
