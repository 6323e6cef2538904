"""Identification of all logs of a fleet, in parallel by joblib."""

import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import joblib

from stribeck.core.base.version import __version__
from stribeck.core.errors import SettingsError, StribeckError, require_extra
from stribeck.service.fleet.jobs import Job
from stribeck.service.fleet.store import IDENTIFIED, connect, locked, naming_damaged_files, set_aside, time_of
from stribeck.service.fleet.worker import Limits, Outcome, end_with, robot_hash, work

BACKENDS = {"loky": "joblib", "ray": "ray", "dask": "distributed"}
"""Backends, and the package that each needs."""


@dataclass(frozen=True, kw_only=True)
class FleetRun:
    """Outcome of a run: number of logs by status, outcomes of logs without a result, damaged files set aside."""

    counts: dict[str, int]
    failed: list[Outcome]
    damaged: list[str]

    @property
    def line(self) -> str:
        """One line, e.g. "200 logs: 193 identified, 5 refused, 2 known"."""
        said = ", ".join(f"{count} {status}" for status, count in self.counts.items())
        return f"{sum(self.counts.values())} logs: {said}"


def run_fleet(
    jobs: Sequence[Job],
    store: str | Path,
    *,
    workers: int = -1,
    backend: str = "loky",
    limits: Limits = Limits(),  # noqa: B008
    again: bool = False,
    progress: Callable[[str, float], None] = lambda *_: None,
) -> FleetRun:
    """Identify the friction of every log that the store does not have.

    Parameters
    ----------
    jobs
        Logs (see `jobs_of_logs` and `jobs_of_manifest`).
    store
        Folder of the store; all workers must see it.
    workers
        Number of logs at a time; -1 for one per core.
    backend
        "loky" (processes of this machine), "ray" (RAY_ADDRESS names a cluster) or "dask" (DASK_SCHEDULER_ADDRESS does).
    limits
        Limits of one log.
    again
        Whether logs that failed before are tried again.
    progress
        Callback `progress(message, fraction)`.

    Raises
    ------
    RobotFileError
        If a robot file is wrong.
    SettingsError
        If the backend is unknown or not installed, no worker is allowed, or another run writes to the store.
    StribeckError
        If a worker or its machine is lost. The store has the logs that are done.
    """
    if not -1 <= workers <= 100_000 or workers == 0:
        raise SettingsError(f"jobs: found {workers}, expected 1 to 100000 logs at a time, or -1 for one per core")
    place, outcomes, damaged = Path(store).absolute(), list[Outcome](), list[Path]()
    hashes = {file: robot_hash(file) for file in {job.robot_file for job in jobs}}
    with locked(place):
        try:
            known = _known(place, again)
        except SettingsError:
            damaged = set_aside(place)
            known = _known(place, again)
        todo = [job for job in jobs if _mark(job, hashes[job.robot_file]) not in known]
        with _engine(backend, min(workers, len(todo))) if todo else nullcontext():
            kind = "list" if backend == "ray" else "generator_unordered"  # Ray's joblib backend has no generators
            tasks = [joblib.delayed(work)(job, place, hashes[job.robot_file], limits, again) for job in todo]
            try:
                for outcome in joblib.Parallel(return_as=kind, batch_size=1)(tasks):
                    outcomes.append(outcome)
                    progress(f"{len(outcomes)} of {len(todo)} logs", len(outcomes) / len(todo))
            except (StribeckError, OSError):
                raise
            except Exception as error:  # each engine has its classes for a lost worker
                what = f"{store}: a worker of {backend} was lost ({type(error).__name__})"
                raise StribeckError(f"{what}; repeat the command, which continues with the logs left") from error
    counts = Counter(outcome.status for outcome in outcomes) + Counter(known=len(jobs) - len(todo))
    failed = [outcome for outcome in outcomes if outcome.status not in (IDENTIFIED, "known")]
    failed.sort(key=lambda outcome: outcome.log)
    return FleetRun(counts=dict(counts), failed=failed, damaged=[str(path) for path in damaged])


def _mark(job: Job, robot: str) -> tuple[str, str, str, int, float, int, str]:
    """List the fields that the store has for a finished log, in the order of `_known`."""
    start = round(time_of(job.start).timestamp() * 1e6)
    return job.log, job.robot, robot, job.size, job.modified, start, job.note


def _known(store: Path, again: bool) -> set[tuple[str, str, str, int, float, int, str]]:
    """Find the logs that this version has done, without reading them; `again`: failed ones are to be done again."""
    if not any(store.glob("robot=*/*.parquet")):
        return set()
    done = f"version = ? AND (status = '{IDENTIFIED}' OR ?)"
    query = f"SELECT log, robot, robot_sha256, size, modified, epoch_us(start), note FROM logs WHERE {done}"
    with connect(store) as connection, naming_damaged_files(store):
        rows = connection.execute(query, [__version__, not again]).fetchall()
    return set(rows)


@contextmanager
def _engine(backend: str, workers: int) -> Iterator[None]:
    """Let joblib use a backend inside."""
    if backend not in BACKENDS:
        raise SettingsError(f"backend: found '{backend}', expected one of {', '.join(BACKENDS)}")
    if backend != "loky":
        require_extra(backend, BACKENDS[backend])
    with ExitStack() as stack:
        options = {"initializer": end_with, "initargs": (os.getpid(),)} if backend == "loky" else {}
        if backend == "ray":
            import ray
            from ray.util.joblib import register_ray

            register_ray()  # type: ignore[no-untyped-call]
            if not ray.is_initialized():
                alone = workers > 0 and "RAY_ADDRESS" not in os.environ
                ray.init(num_cpus=workers if alone else None, log_to_driver=False)
            stack.callback(ray.shutdown)
        elif backend == "dask":
            import dask
            from distributed import Client

            dask.config.set({"distributed.worker.daemon": False})  # workers start a process per log
            alone = "DASK_SCHEDULER_ADDRESS" not in os.environ
            client = Client(**{"n_workers": max(workers, 1), "threads_per_worker": 1} if alone else {})  # type: ignore[no-untyped-call]
            stack.enter_context(client)
        stack.enter_context(joblib.parallel_config(backend=backend, n_jobs=workers, **options))
        yield
