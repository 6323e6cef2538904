"""A store of many logs: what is done once, what fails, what is interrupted, and what the tables hold."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import polars
import pyarrow.parquet as pq
import pytest
from tests.arm import arm_log, save_npz, write_arm

from stribeck import LogError, SettingsError, identify
from stribeck.core.robot import Robot
from stribeck.service.fleet import compact, connect, run_fleet
from stribeck.service.fleet.jobs import Job, jobs_of_logs, jobs_of_manifest
from stribeck.service.fleet.store import TABLES, views
from stribeck.service.fleet.worker import Limits

SAME = "SELECT * EXCLUDE (finished, seconds, peak_memory) FROM logs ORDER BY key"
"""Rows that two runs have in common; the others are times and memory."""
QUICK = '\n[identify]\nmethod = "curve-fit"\n[identify.filter]\nkind = "savitzky-golay"\nwindow = 31\n'


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make three logs of two robots each."""
    folder = tmp_path_factory.mktemp("fleet")
    robot = Robot.from_file(write_arm(folder, QUICK))
    for seed in range(6):
        place = folder / "logs" / f"R{seed % 2}" / f"log_{seed}.npz"
        place.parent.mkdir(parents=True, exist_ok=True)
        save_npz(arm_log(robot, duration=8, rate=200, seed=seed), place)
        start = 1.7e9 + 2e6 * seed
        os.utime(place, (start, start))
    return folder


@pytest.fixture(scope="module")
def store(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Identify these logs."""
    place = tmp_path_factory.mktemp("store")
    run_fleet(all_jobs(logs), place, workers=1)
    return place


def all_jobs(folder: Path) -> list[Job]:
    return jobs_of_logs([str(folder / "logs")], folder / "robot.toml")


def rows(store: Path, query: str = SAME) -> list[Any]:
    with connect(store) as connection:
        return connection.execute(query).fetchall()


def test_tables_contain_the_numbers_of_results(logs: Path, store: Path) -> None:
    job = all_jobs(logs)[0]
    result = identify(job.log, job.robot_file)
    where = f"JOIN logs USING (key) WHERE log = '{job.log}'"
    found = rows(store, f"SELECT joint, parameter, value, low FROM parameters {where} ORDER BY ALL")
    wanted = [
        (joint, name, each.value, each.interval_95[0])
        for joint, own in result.joints.items()
        for name, each in own.parameters.items()
    ]
    assert found == sorted(wanted)
    curves = rows(store, f"SELECT joint, velocity, friction, low, high FROM curves {where}")
    for joint, velocity, friction, low, high in curves:
        assert low < friction < high
        assert friction == pytest.approx(float(result.joints[joint].friction(velocity)), rel=0.05)
    units = rows(store, "SELECT DISTINCT unit, speed_unit FROM curves WHERE joint = 'slide'")
    assert units == [("N", "m/s")]
    assert rows(store, "SELECT robot, count(*) FROM logs GROUP BY 1 ORDER BY 1") == [("R0", 3), ("R1", 3)]


def test_a_log_is_known_by_its_content_and_its_robot_file(logs: Path, store: Path, tmp_path: Path) -> None:
    own = tmp_path / "store"
    shutil.copytree(store, own, symlinks=True)
    assert run_fleet(all_jobs(logs), own, workers=1).counts == {"known": 6}
    copied = tmp_path / "logs/R0/other.npz"
    copied.parent.mkdir(parents=True)
    shutil.copy(logs / "logs/R0/log_0.npz", copied)
    assert run_fleet(jobs_of_logs([str(copied)], logs / "robot.toml"), own, workers=1).counts == {"known": 1}
    changed = write_arm(tmp_path, QUICK.replace("31", "41"))
    assert run_fleet(jobs_of_logs([str(copied)], changed), own, workers=1).counts == {"identified": 1}
    assert len(rows(own)) == 6  # views show the newest row of a log


def test_logs_that_fail_are_rows_and_stop_no_other(logs: Path, tmp_path: Path) -> None:
    place, own = tmp_path / "logs/R7", tmp_path / "store"
    place.mkdir(parents=True)
    (place / "damaged.npz").write_bytes((logs / "logs/R0/log_0.npz").read_bytes()[:5000])
    shutil.copy(logs / "logs/R0/log_2.npz", place / "good.npz")
    jobs = jobs_of_logs([str(place)], logs / "robot.toml")
    for limits, status, words in (
        (Limits(memory=0.15), "memory", "needs more than 0.15 GB"),
        (Limits(timeout=0.02), "timeout", "took more than 0.02 s"),
    ):
        found = run_fleet(jobs, own, workers=1, limits=limits, again=True)
        damaged, good = rows(own, "SELECT status, error FROM logs ORDER BY log")
        assert damaged[1].startswith(str(place / "damaged.npz"))
        assert good[0] == status
        assert words in good[1]
        assert len(found.failed) == 2
    last = run_fleet(jobs, own, workers=1, again=True)
    assert last.counts == {"identified": 1, "refused": 1}
    assert [each.status for each in last.failed] == ["refused"]


@pytest.mark.parametrize("backend", ["loky", pytest.param("dask", marks=pytest.mark.long)])
def test_backends_give_the_same_store(logs: Path, store: Path, tmp_path: Path, backend: str) -> None:
    if backend == "dask":
        pytest.importorskip("distributed")
    assert run_fleet(all_jobs(logs), tmp_path / "s", workers=2, backend=backend).counts == {"identified": 6}
    assert rows(tmp_path / "s") == rows(store)


@pytest.mark.long
def test_a_killed_run_on_a_ray_cluster_is_resumed(logs: Path, store: Path, tmp_path: Path, monkeypatch: Any) -> None:
    """The cluster of two nodes is found by its address."""
    cluster = pytest.importorskip("ray.cluster_utils").Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    cluster.add_node(num_cpus=1)
    monkeypatch.setenv("RAY_ADDRESS", cluster.address)
    try:
        with running(logs, tmp_path / "s", 2, "--backend", "ray") as run:
            run.kill()
        run_fleet(all_jobs(logs), tmp_path / "s", workers=2, backend="ray")
    finally:
        cluster.shutdown()
    assert rows(tmp_path / "s") == rows(store)


@contextmanager
def running(logs: Path, store: Path, done: int, *options: object) -> Iterator[subprocess.Popen[str]]:
    """Start a run in a session of its own, and wait until the store has some rows."""
    words = ["fleet", logs / "logs", "-r", logs / "robot.toml", "-o", store, "--jobs", 2, *options]
    command = [sys.executable, "-m", "stribeck", *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
        while not (store / ".lock").exists() or len(list(store.glob("robot=*/*.parquet"))) < done:
            assert run.poll() is None
            time.sleep(0.02)
        yield run


def test_an_interrupted_run_ends_with_a_line(logs: Path, tmp_path: Path) -> None:
    with running(logs, tmp_path / "s", 0) as run:
        run.send_signal(signal.SIGINT)
        complaint = run.communicate()[1]
    left = f"{tmp_path / 's'} has the logs that are done; repeat the command to continue"
    assert f"stribeck: interrupted; {left}\n" in complaint  # joblib may add warnings
    assert run.returncode == 130


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.long) for k in range(1, 10))])
def test_the_workers_of_a_killed_run_end_and_it_is_resumed(logs: Path, store: Path, tmp_path: Path, seed: int) -> None:
    generator = np.random.default_rng(seed)
    with running(logs, tmp_path / "s", int(generator.integers(6))) as run:
        time.sleep(generator.uniform(0, 0.3))
        run.kill()
        run.communicate(timeout=10)  # every process of the run holds the pipe
    run_fleet(all_jobs(logs), tmp_path / "s", workers=1)
    assert rows(tmp_path / "s") == rows(store)


@pytest.mark.long
def test_a_lost_worker_ends_a_run_that_can_be_repeated(logs: Path, store: Path, tmp_path: Path) -> None:
    with running(logs, tmp_path / "s", 2) as run:
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
        worker = next(pid for pid in children if "LokyProcess" in Path(f"/proc/{pid}/cmdline").read_text())
        os.kill(int(worker), signal.SIGKILL)
        assert "a worker of loky was lost (TerminatedWorkerError); repeat the command" in run.communicate()[1]
    assert run.returncode == 2
    run_fleet(all_jobs(logs), tmp_path / "s", workers=1)
    assert rows(tmp_path / "s") == rows(store)


def test_compaction_keeps_every_row_and_readers(logs: Path, store: Path, tmp_path: Path) -> None:
    own = tmp_path / "store"
    shutil.copytree(store, own, symlinks=True)
    before = rows(own)
    listed = list(own.glob("robot=*/*.parquet"))
    opened = [path.resolve() for path in listed]
    assert compact(own) == (6, 6, [])  # each log is of a month of its own
    assert all(path.exists() for path in opened)
    assert rows(own) == before
    assert run_fleet(all_jobs(logs), own, workers=1).counts == {"known": 6}
    assert compact(own) == (6, 6, [])
    assert not any(path.exists() for path in opened)


def test_damaged_files_are_named_and_their_logs_done_again(logs: Path, store: Path, tmp_path: Path) -> None:
    own = tmp_path / "store [1]*?"  # characters that have a meaning in patterns
    shutil.copytree(store, own, symlinks=True)
    wanted = rows(own)
    empty, cut, changed, text = files = sorted(own.glob("robot=*/*.parquet"))[:4]
    empty.write_bytes(b"")
    cut.write_bytes(cut.read_bytes()[:-100])
    content = bytearray(changed.read_bytes())
    content[4:1000] = bytes(996)  # only the data, so the file opens
    changed.write_bytes(content)
    pq.write_table(pq.read_table(text, partitioning=None), text, compression="none")
    text.write_bytes(text.read_bytes().replace(text.stem.encode(), b"\x80" * 32))  # no UTF-8
    with pytest.raises(SettingsError, match=rf"{empty.name}: is damaged .*--compact .* sets it aside"):
        connect(own)
    found = run_fleet(all_jobs(logs), own, workers=1)
    assert found.counts == {"identified": 4, "known": 2}
    names = {f"{path.parent.name.removeprefix('robot=')}.{path.name}" for path in files}
    assert {Path(path).name for path in found.damaged} == names
    assert rows(own) == wanted
    merged = compact(own)
    assert merged == (6, 6, [])
    month = next(own.glob("robot=R0/*.parquet"))
    month.write_bytes(b"PAR1")
    assert compact(own)[2] == [own / ".damaged" / f"R0.{month.name}"]
    assert run_fleet(all_jobs(logs), own, workers=1).counts == {"identified": 1, "known": 5}
    assert rows(own) == wanted


@pytest.mark.parametrize("parent", ["store", "robot=panda"])
def test_a_store_copied_without_links_is_compacted(store: Path, tmp_path: Path, parent: str) -> None:
    own = tmp_path / parent / "copy"
    shutil.copytree(store, own)  # folders in place of links
    (own / "robot=R8").symlink_to("nowhere")
    wanted = rows(own)
    assert compact(own) == compact(own) == (6, 6, [])
    assert rows(own) == wanted
    assert {row[0] for row in rows(own, "SELECT robot FROM logs")} == {"R0", "R1"}
    assert len(list((own / ".versions").iterdir())) == 4  # the last two of each robot


def test_a_corrected_start_or_note_changes_the_row(logs: Path, store: Path, tmp_path: Path) -> None:
    own, manifest = tmp_path / "store", logs / "corrected.csv"
    shutil.copytree(store, own, symlinks=True)
    compact(own)
    note = "new\u2028gear\nand oil"
    for day in (1, 2):  # of a merged row, then of a separate one
        line = f'logs/R0/log_0.npz,robot.toml,R0,2026-03-0{day}T00:00:00+00:00,"{note}"'
        manifest.write_text(f"log,robot_file,robot,start,note\n{line}\n")
        assert run_fleet(jobs_of_manifest(manifest), own, workers=1).counts == {"known": 1}
        query = "SELECT log, note, day(timezone('UTC', start)) FROM logs WHERE note <> ''"
        assert rows(own, query) == [(str(logs / "logs/R0/log_0.npz"), note, day)]
        assert len(rows(own)) == 6
    assert compact(own) == (7, 6, [])
    assert len(rows(own)) == 6


def test_other_tools_read_the_store(store: Path, tmp_path: Path) -> None:
    script = tmp_path / "views.sql"
    script.write_text(views(store))
    with duckdb.connect() as connection:
        connection.execute(script.read_text())
        for name in TABLES:
            connection.execute(f"SELECT * FROM {name}").fetchall()
    frame = polars.read_parquet(f"{store}/robot=*/*.parquet", hive_partitioning=True)
    curves = frame.select("robot", "curves").explode("curves").unnest("curves")
    assert len(curves) == rows(store, "SELECT count(*) FROM curves")[0][0]


def test_logs_are_found_by_globs_and_urls(logs: Path, tmp_path: Path) -> None:
    import fsspec

    found = jobs_of_logs([str(logs / "logs/*/log_[01].npz")], logs)
    assert [Path(job.log).name for job in found] == ["log_0.npz", "log_1.npz"]
    memory = fsspec.filesystem("memory")
    memory.put(str(logs / "logs/R0/log_0.npz"), "/plant/R9/log.npz")
    jobs = jobs_of_logs(["memory://plant"], logs / "robot.toml")
    assert [(job.log, job.robot) for job in jobs] == [("memory:///plant/R9/log.npz", "R9")]
    memory.mv("/plant/R9/log.npz", "/plant/moved.npz")
    assert run_fleet(jobs, tmp_path / "s", workers=1).counts == {"refused": 1}
    memory.mv("/plant/moved.npz", "/plant/R9/log.npz")
    assert run_fleet(jobs, tmp_path / "s", workers=1, again=True).counts == {"identified": 1}
    assert len(rows(tmp_path / "s")) == 1
    with pytest.raises(LogError, match="has no log"):
        jobs_of_logs([str(tmp_path / "nowhere")], logs / "robot.toml")
