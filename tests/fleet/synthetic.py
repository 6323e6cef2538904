"""Stores with known friction, written at once: one merged file per robot."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from stribeck.service.fleet.store import SCHEMA, TABLES, folder_of

SPEEDS = (0.1, 0.2, 0.5, 1.0)


def write_store(
    store: Path,
    robots: int,
    logs: int,
    joints: int,
    seed: int = 0,
    wear: Mapping[tuple[int, int], tuple[int, float]] = {},
    odd: Mapping[int, float] = {},
) -> None:
    """Write logs of robots whose friction differs by 5 %, and by 2 % from log to log.

    `wear` are the first log and the factor of (robot, joint), `odd` factors of robots.
    """
    generator = np.random.default_rng(seed)
    usual = 1 + np.arange(joints)[:, None] + np.array(SPEEDS)
    for robot in range(robots):
        own = usual * (1 + 0.05 * generator.standard_normal((joints, 1))) * odd.get(robot, 1.0)
        friction = own * (1 + 0.02 * generator.standard_normal((logs, joints, 1)))
        for (worn, joint), (first, factor) in wear.items():
            if worn == robot:
                friction[first:, joint] *= factor
        pq.write_table(
            _rows(robot, friction), folder_of(store, f"r{robot:04d}") / "2026-01.parquet", compression="zstd"
        )


def _rows(robot: int, friction: np.ndarray) -> pa.Table:
    logs, joints, speeds = friction.shape
    count = joints * speeds
    error = 0.005 * friction.ravel()
    parts = {
        "joint": np.tile(np.repeat([f"joint_{k:02d}" for k in range(joints)], speeds), logs),
        "velocity": np.tile(SPEEDS, logs * joints),
        "friction": friction.ravel(),
        "standard_error": error,
        "low": friction.ravel() - 1.96 * error,
        "high": friction.ravel() + 1.96 * error,
        "unit": np.full(logs * count, "N m"),
        "speed_unit": np.full(logs * count, "rad/s"),
    }
    words = {"parameter": "coulomb", "unit": "N m", "verdict": "identified"}
    slow = {name: column[:: len(SPEEDS)] for name, column in parts.items()}
    slow |= {"value": slow["friction"], **{name: np.full(logs * joints, word) for name, word in words.items()}}
    start = [datetime(2026, 1, 1, tzinfo=UTC) + timedelta(days=k) for k in range(logs)]
    columns = {
        "key": [f"{robot:08d}{k:024d}" for k in range(logs)],
        "log": [f"log_{k:05d}.npz" for k in range(logs)],
        "sha256": [f"{robot}-{k}" for k in range(logs)],
        "start": start,
        "status": ["identified"] * logs,
        "version": ["1.0"] * logs,
        "finished": start,
        "curves": _lists("curves", parts, logs),
        "parameters": _lists("parameters", slow, logs),
    }
    missing = {name: pa.nulls(logs, SCHEMA.field(name).type) for name in SCHEMA.names if name not in columns}
    return pa.table({name: (columns | missing)[name] for name in SCHEMA.names}, SCHEMA)


def _lists(table: str, columns: Mapping[str, np.ndarray], logs: int) -> pa.ListArray:
    """Build the lists of a table of all logs, of equal length."""
    arrays = [pa.array(columns[name], kind) for name, kind in TABLES[table].items()]
    rows = pa.StructArray.from_arrays(arrays, fields=list(SCHEMA.field(table).type.value_type))
    return pa.ListArray.from_arrays(np.arange(logs + 1) * (len(rows) // logs), rows)
