"""Friction of all logs of a store, in one array for statistics."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stribeck.core.base.typing import Array
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.result.tables import MAIN
from stribeck.service.fleet.store import IDENTIFIED, connect, naming_damaged_files


@dataclass(frozen=True)
class JointSpeed:
    """Joint and speed at which its friction is followed, with their units."""

    joint: str
    velocity: float
    unit: str
    speed_unit: str

    @property
    def speed(self) -> str:
        """Speed with its unit, e.g. "0.5 rad/s"."""
        return f"{self.velocity:g} {self.speed_unit}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Fleet:
    """Friction of N logs, sorted by robot and start, in C channels: joints, each at some speeds.

    Attributes
    ----------
    robots, start, log
        Robot id, start and path of each log, shape (N,).
    channels
        Joint and speed of each column.
    friction, error
        Friction and its standard error [N m], shape (N, C); NaN where a log has none.
    """

    robots: NDArray[np.str_]
    start: NDArray[np.datetime64]
    log: NDArray[np.object_]
    channels: list[JointSpeed]
    friction: Array
    error: Array

    @cached_property
    def logarithm(self) -> Array:
        """Logarithm of the friction, shape (N, C); NaN where it is not positive."""
        return np.log(np.where(self.friction > 0, self.friction, np.nan))


@dataclass(frozen=True)
class TypeParameter:
    """Parameter of a joint in all logs of a robot type: median, and the range of 90 % of the logs."""

    joint: str
    parameter: str
    value: float
    low: float
    high: float
    unit: str
    logs: int

    def __str__(self) -> str:
        """State the parameter, e.g. "coulomb 1.2 (1.1 to 1.3) N m"."""
        return f"{self.parameter} {self.value:.3g} ({self.low:.3g} to {self.high:.3g}) {self.unit}"


def read_parameters(store: str | Path) -> list[TypeParameter]:
    """Read Coulomb and viscous friction, and rotor inertia, of all logs."""
    names = " OR ".join(f"parameter LIKE '{name}%'" for name in MAIN.values())
    with connect(store) as connection, naming_damaged_files(store):
        rows = connection.execute(
            "SELECT joint, parameter, median(value), quantile_cont(value, 0.05), quantile_cont(value, 0.95), unit, "
            f"count(*) FROM parameters WHERE {names} GROUP BY joint, parameter, unit ORDER BY joint, parameter"
        ).fetchall()
    return [TypeParameter(*row) for row in rows]


def read_fleet(store: str | Path) -> Fleet:
    """Read the friction of all logs, at up to three speeds per joint that at least 80 % of its logs reach."""
    speeds = """CREATE TEMP TABLE channel AS
        WITH counts AS (SELECT joint, velocity, unit, speed_unit, count(*) AS n FROM curves GROUP BY ALL),
        usual AS (SELECT *, row_number() OVER (PARTITION BY joint ORDER BY velocity) AS k,
                         count(*) OVER (PARTITION BY joint) AS m
                  FROM counts QUALIFY n >= 0.8 * max(n) OVER (PARTITION BY joint))
        SELECT joint, velocity, unit, speed_unit, row_number() OVER (ORDER BY joint, velocity) - 1 AS c FROM usual
        WHERE m <= 3 OR k IN (1, (m + 1) // 2, m)"""
    with connect(store) as connection, naming_damaged_files(store):
        connection.execute("SET memory_limit = '1GB'; SET preserve_insertion_order = false")
        connection.execute(speeds)
        channels = connection.execute("SELECT * EXCLUDE c FROM channel ORDER BY c").fetchall()
        connection.execute(
            "CREATE TEMP TABLE place AS SELECT key, robot, start, log, "
            f"row_number() OVER (ORDER BY robot, start, log) - 1 AS n FROM logs WHERE status = '{IDENTIFIED}'"
        )
        logs = connection.execute("SELECT robot, start, log FROM place ORDER BY n").fetchnumpy()
        connection.execute(
            "CREATE TEMP TABLE point AS SELECT n, c, friction, standard_error FROM curves "
            "JOIN channel USING (joint, velocity, unit, speed_unit) JOIN place USING (key, robot)"
        )
        estimates = np.full((2, len(logs["robot"]), len(channels)), np.nan)
        for c in range(len(channels)):  # all at once would take several gigabytes
            rows = connection.execute("SELECT n, friction, standard_error FROM point WHERE c = ?", [c]).fetchnumpy()
            estimates[:, rows["n"], c] = rows["friction"], rows["standard_error"]
    size, error = np.abs(estimates[0]), estimates[1]
    sound = (size > 1e-100) & (size < 1e100) & (error >= 0) & (error < 1e100)  # squares are finite
    estimates[:, ~sound] = np.nan
    followed = np.any(estimates[0] > 0, axis=0)
    if not followed.any():
        raise NothingIdentifiedError(f"{store}: no log has the friction of a joint; run `stribeck fleet` first")
    return Fleet(
        robots=np.array(logs["robot"], dtype=str),
        start=np.array(logs["start"], dtype="datetime64[us]"),
        log=np.array(logs["log"], dtype=object),
        channels=[JointSpeed(*channel) for channel, kept in zip(channels, followed, strict=True) if kept],
        friction=estimates[0][:, followed],
        error=estimates[1][:, followed],
    )
