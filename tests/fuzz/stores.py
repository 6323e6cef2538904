"""Stores of fleets with damaged files, strange rows and broken links, and manifests."""

import os
import shutil
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from tests.fuzz.damage import NUMBERS, WORDS, bytes_damaged, pick, text_damaged

from stribeck.fleet.store import SCHEMA, compact, key_of, rows_of, time_of, write_row
from stribeck.result import read_result

ROBOTS, LOGS = ("R1", "R2", "a.b-c"), 3
ODD = (None, 0.0, -1.0, 1e-300, 1e300, -1e300, np.nan, np.inf, -np.inf)


def make_store(store, result):
    """Write a store of three robots from one result; the rows of the first robot are merged."""
    tables = rows_of(read_result(result))
    for robot in ROBOTS:
        for number in range(LOGS):
            about: dict[str, Any] = {
                "key": key_of(robot, str(number)),
                "log": f"log_{number}.npz",
                "sha256": f"{robot}{number}",
            }
            about |= {"start": time_of(1.7e9 + 1e6 * number), "finished": time_of(1.8e9), "version": "1.0", "note": ""}
            about |= {"status": "identified" if number or robot == "R2" else "refused", "size": 1, "modified": 0.0}
            write_row(store, robot, about | tables)
        if robot == ROBOTS[0]:
            compact(store)


def store(generator, folder, seeds):
    """Damage files of a store, change its rows or exchange its links; then read or compact it."""
    place = folder / pick(generator, ("store", "store [1]", "s*?", "robot=R9", "a'b"))
    shutil.copytree(seeds / "store", place, symlinks=generator.random() < 0.7)
    for _ in range(int(generator.geometric(0.6))):
        files = sorted(path for path in place.glob("robot=*/*.parquet") if path.is_file())
        link = pick(generator, sorted(place.glob("robot=*")))
        if not files:
            break
        file = pick(generator, files)
        match int(generator.integers(8)):
            case 0 | 1:
                file.write_bytes(bytes_damaged(generator, file.read_bytes()))
            case 2 | 3 | 4:
                rewrite(generator, file)
            case 5:
                file.write_bytes(pick(generator, (b"", b"PAR1", file.read_bytes()[:-50], b"PAR1" * 40)))
            case 6 if link.is_symlink():
                link.unlink()
                link.symlink_to(pick(generator, (".", "nowhere", link.name, ".versions/R1.x", ".versions")))
            case _:
                strange = pick(generator, (".versions/R1.x", "robot=R1/x.parquet", "robot=", "robot=R7/y.parquet"))
                (place / strange).mkdir(parents=True, exist_ok=True)
    return pick(
        generator,
        (
            ["trends", place.name],
            ["trends", place.name, "-o", "out", "--logs-per-false-alarm", pick(generator, ("10", "1e9", *NUMBERS))],
            ["trends", place.name, "--json"],
            ["fleet", "--compact", place.name],
        ),
    )


def rewrite(generator, file):
    """Give rows of a file other values, or the file other columns."""
    try:
        rows = pq.read_table(file, schema=SCHEMA, partitioning=None).to_pylist()
    except (pa.ArrowException, OSError):
        return
    row = pick(generator, rows)
    inner = pick(generator, row["curves"] or [{}])
    match int(generator.integers(7)):
        case 0:
            row[pick(generator, tuple(row))] = None
        case 1 | 2:
            for each in row["curves"] or ():
                each[pick(generator, ("friction", "standard_error", "velocity"))] = pick(generator, ODD)
        case 3:
            inner[pick(generator, ("joint", "unit", "speed_unit"))] = pick(
                generator, (None, "", "[/]", "<b>", "x" * 3000)
            )
        case 4:
            row["curves"] = pick(generator, (None, [], row["curves"][:1] if row["curves"] else []))
        case 5:
            days = int(pick(generator, (0, 1, 4_000_00, -700_000)))
            row["start"] = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=days)
        case 6:
            columns = {"a": [1], "key": [2]} if generator.random() < 0.5 else {"start": ["x"], "curves": [3]}
            pq.write_table(pa.table(columns), file)
            return
    pq.write_table(pa.Table.from_pylist(rows, SCHEMA), file)


def manifest(generator, folder, seeds):
    """Damage a manifest, or give an address; the run itself has no log to identify."""
    os.symlink("loop.npz", folder / "loop.npz")
    (folder / "self").symlink_to(".")
    text = f"log,robot_file,robot,start,note\nnone.npz,{seeds / 'robot.toml'},A,2026-01-01,\nx.npz,r,B,,b\n"
    if generator.random() < 0.5:
        for _ in range(int(generator.integers(1, 4))):
            text = text_damaged(generator, text)
        content = text.encode(errors="replace")
        (folder / "fleet.csv").write_bytes(bytes_damaged(generator, content) if generator.random() < 0.5 else content)
        return ["fleet", "--manifest", "fleet.csv", "-o", "out"]
    scheme = pick(generator, ("zip", "tar", "data", "reference", "memory", "file", "dir", "x", "simplecache", ""))
    word = pick(generator, (*WORDS, "x.npz", "*", "none/*.npz", "[1].npz", "127.0.0.1:1/x")).replace("/dev/zero", "")
    address = scheme + pick(generator, ("://", ":", "::", ":///")) * bool(scheme) + word
    return ["fleet", address.replace("\0", "") or "x", "-r", str(seeds / "robot.toml"), "-o", "out"]
