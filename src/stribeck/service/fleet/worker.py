"""Identification of one log in a separate process, with limits of time and memory, and the tables of its result."""

import multiprocessing
import os
import resource
import signal
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from threading import Thread
from time import monotonic, sleep, time
from typing import Annotated, Any, ClassVar

import fsspec
import numpy as np
from pydantic import Field

from stribeck.core.base.checked_table import Table
from stribeck.core.base.files import sha256
from stribeck.core.base.version import __version__
from stribeck.core.errors import StribeckError
from stribeck.core.identify.pipeline import identify
from stribeck.core.result import JointResult, Result
from stribeck.core.result.tables import parameter_rows
from stribeck.core.robot import Robot
from stribeck.service.fleet.jobs import Job
from stribeck.service.fleet.store import IDENTIFIED, TABLES, key_of, row_of, time_of, write_row

OUT_OF_MEMORY = 77
"""Exit code of a process that needs more memory than allowed."""


class Limits(Table):
    """Limits of one log: time [s] and memory [GB]; None for none.

    Raises
    ------
    SettingsError
        If a limit is not a positive, finite number.
    """

    options: ClassVar[str] = "fleet --timeout, --memory"
    timeout: Annotated[float, Field(ge=1e-3, le=1e6, allow_inf_nan=False)] | None = None
    memory: Annotated[float, Field(ge=1e-3, le=1e6, allow_inf_nan=False)] | None = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Status of a log after a run, and its error if it has no result; "known" if the store had it."""

    log: str
    status: str
    error: str = ""


def robot_hash(robot_file: str) -> str:
    """Compute a hash of a robot file and its model.

    Raises
    ------
    RobotFileError
        If the robot file or its model is wrong.
    """
    return key_of(sha256(robot_file), sha256(Robot.from_file(robot_file).model_path))


def work(job: Job, store: Path, robot: str, limits: Limits, again: bool) -> Outcome:
    """Identify the friction of a log unless the store has it, and write its row.

    Parameters
    ----------
    job
        The log.
    store
        Folder of the store, which all workers see.
    robot
        Hash of the robot file (see `robot_hash`).
    limits
        Limits of time and memory.
    again
        Whether a log that failed before is tried again.
    """
    began = monotonic()
    about = {name: value for name, value in vars(job).items() if name != "robot"}  # the folder names the robot
    about |= {"robot_sha256": robot, "start": time_of(job.start), "version": __version__}
    about |= _content(job.log, job, robot)  # until the log is read
    with tempfile.TemporaryDirectory(prefix="stribeck-") as folder:
        try:
            path = _local(job.log, Path(folder))
        except Exception as error:  # file systems differ in what they raise
            about |= _refused(job, error)
        else:
            about |= _in_process(path, job, store, about, limits, again)
    if about["status"] not in (IDENTIFIED, "known"):
        write_row(store, job.robot, about | {"seconds": monotonic() - began, "finished": time_of(time())})
    return Outcome(log=job.log, status=about["status"], error=about["error"])


def _content(sha: str, job: Job, robot: str) -> dict[str, str]:
    """Make the columns that depend on a log's content, or on its path if it cannot be read."""
    return {"sha256": sha, "key": key_of(sha, robot, job.robot, __version__)}


def _refused(job: Job, error: Exception) -> dict[str, str]:
    return {"status": "refused", "error": f"{job.log}: cannot be read ({error})"}


def _in_process(path: str, job: Job, store: Path, about: dict[str, Any], limits: Limits, again: bool) -> dict[str, str]:
    """Identify a log in a process that starts with all libraries loaded, and return its content, status and error."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__, "pandas"])  # PyArrow imports pandas, if there, in a second
    receiver, sender = context.Pipe(duplex=False)
    task = path, job, store, about, limits.memory, again, sender
    process = context.Process(target=_identify, args=task, daemon=True)
    process.start()
    sender.close()
    process.join(limits.timeout)
    overrun = process.is_alive()
    if overrun:
        process.kill()
        process.join()
    answer = dict[str, str]()
    with suppress(EOFError):
        while True:
            answer |= receiver.recv()
    if "status" in answer:
        return answer
    status, error = (
        ("timeout", f"took more than {limits.timeout:g} s; allow more time") if overrun else _ended(process, limits)
    )
    return answer | {"status": status, "error": f"{job.log}: {error}"}


def _ended(process: BaseProcess, limits: Limits) -> tuple[str, str]:
    """Explain the end of a process that could not report."""
    code = process.exitcode or 0
    if code == OUT_OF_MEMORY or (code and limits.memory):  # libraries may abort
        return "memory", f"needs more than {limits.memory or 0:g} GB of memory; allow more"
    if code == -signal.SIGKILL:
        return "memory", "was ended by the system, most likely as memory ran out; run fewer at a time"
    return "failed", f"its process ended with code {code}"


def _identify(
    path: str, job: Job, store: Path, about: dict[str, Any], memory: float | None, again: bool, sender: Connection
) -> None:
    """Identify a log unless the store has it, write its row, and send its content, status and error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the worker ends this process
    end_with(os.getppid())
    if memory:
        resource.setrlimit(resource.RLIMIT_DATA, (int(memory * 1e9),) * 2)
    try:
        content = _content(sha256(path), job, about["robot_sha256"])
        sender.send(content)
        (store / f"robot={job.robot}" / f"{about['key']}.parquet").unlink(missing_ok=True)  # it can be read now
        before = row_of(store, job.robot, content["key"])
        if before and (before["status"] == IDENTIFIED or not again):
            declared = {"start": about["start"], "note": about["note"]}
            if before["log"] == job.log and not declared.items() <= before.items():
                write_row(store, job.robot, before | declared | {"finished": time_of(time())})
            sender.send({"status": "known", "error": ""})
            return
        began, robot = monotonic(), Robot.from_file(job.robot_file)
        result = identify(path, robot)
        row = about | content | {"settings": robot.settings.model_dump_json(), "status": IDENTIFIED}
        row |= {"duration": result.log.duration, "seconds": monotonic() - began, "finished": time_of(time())}
        row |= {"peak_memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6}
        write_row(store, job.robot, row | rows_of(result))
        sender.send({"status": IDENTIFIED, "error": ""})
    except MemoryError:
        os._exit(OUT_OF_MEMORY)
    except StribeckError as error:
        if isinstance(error.__cause__, MemoryError):
            os._exit(OUT_OF_MEMORY)
        sender.send({"status": "refused", "error": str(error).replace(path, job.log)})
    except OSError as error:
        sender.send(_refused(job, error))
    except Exception as error:  # a fault of ours must not stop the other logs
        sender.send({"status": "failed", "error": f"{job.log}: {type(error).__name__}: {error}"})


def end_with(parent: int) -> None:
    """End this process soon after its parent, whose process id is given; a killed parent cannot tell its children."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(0.5)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def _local(url: str, folder: Path) -> str:
    """Copy a remote log to a folder; a local one stays where it is."""
    files, path = fsspec.core.url_to_fs(url)
    if "file" in files.protocol:
        return str(path)
    target = folder / Path(path).name
    files.get(path, str(target), recursive=files.isdir(path))
    return str(target)


def rows_of(result: Result) -> dict[str, list[dict[str, Any]]]:
    """Make the tables of a log from its result."""
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in TABLES}
    for joint, estimate in result.all_friction.items():
        row = {"joint": joint, "verdict": estimate.verdict, "reason": estimate.reason, "samples": estimate.samples}
        row |= {"top_speed": max(map(abs, estimate.velocity_range)), "residual_rms": estimate.residual_rms}
        rows["joints"].append(row | {"torque_r2": estimate.torque_r2.best if estimate.torque_r2 else None})
        rows["curves"] += _curve(joint, estimate)
    rows["parameters"] = [row for row in parameter_rows(result.all_friction) if row["parameter"]]
    rows["findings"] = [
        {"check": finding.check, "joints": list(finding.joints), "text": finding.text, "remedy": finding.remedy}
        for finding in result.findings
    ]
    rows["corrections"] = list(_corrections(result))
    return rows


def _curve(joint: str, estimate: JointResult) -> Iterator[dict[str, Any]]:
    """Evaluate the friction of a joint at common speeds that its log reaches: mean of both directions."""
    # the same speeds [rad/s], [m/s] for all logs, so that they can be compared
    speeds = tuple(digit * 10.0**power for power in range(-3, 3) for digit in (1, 2, 5))
    reached = [v for v in speeds if estimate.curve and estimate.curve[0].velocity <= v <= estimate.curve[-1].velocity]
    forward, backward = (estimate.band(sign * np.array(reached)) for sign in (1.0, -1.0))
    if not reached or forward is None or backward is None or forward[1] is None:
        return
    half = (forward[1][1] - forward[1][0]) / 2
    units = dict(zip(("speed_unit", "unit"), estimate.units(), strict=True))
    for k, velocity in enumerate(reached):
        friction, margin = float(forward[0][k] - backward[0][k]) / 2, float(half[k])
        ends = {"standard_error": margin / 1.96, "low": friction - margin, "high": friction + margin}
        yield {"joint": joint, "velocity": velocity, "friction": friction} | ends | units


def _corrections(result: Result) -> Iterator[dict[str, Any]]:
    estimates = result.corrections
    if estimates is None:
        return
    by_joint = (("torque_gain", "1"), ("encoder_zero", "rad"), ("command_delay", "s"))
    pairs = [(name, joint, *pair, unit) for name, unit in by_joint for joint, pair in getattr(estimates, name).items()]
    pairs += [("mass", body, fit.mass[1] - fit.mass[0], fit.mass_error, "kg") for body, fit in estimates.bodies.items()]
    for name in ("torque_delay", "base_delay"):
        if getattr(estimates, name):
            pairs.append((name, "", *getattr(estimates, name), "s"))
    for name, of, value, error, unit in pairs:
        yield {"correction": name, "of": of, "value": value, "standard_error": error, "unit": unit}
