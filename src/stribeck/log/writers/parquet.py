"""Parquet tables: a column a signal, `time`, then `<channel>.<label>`."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from stribeck.log.readers.source import JOINT_CHANNELS, VECTOR_CHANNELS, WRENCH
from stribeck.log.robot_log import RobotLog
from stribeck.log.storage import BLOCK_ROWS


def write_parquet(log: RobotLog, path: Path) -> list[str]:
    """Write every channel; there is none without a place."""
    labels = (
        dict.fromkeys(JOINT_CHANNELS, log.joint_names)
        | VECTOR_CHANNELS
        | {"contact": log.foot_names, "foot_force": log.foot_names}
    )
    labels["foot_wrench"] = tuple(f"{foot}.{axis}" for foot in log.foot_names for axis in WRENCH)
    columns = {}
    for channel, values in log.channels().items():
        if channel == "time":
            columns["time"] = values
        else:
            flat = values.reshape(len(values), -1)
            columns |= {f"{channel}.{label}": flat[:, k] for k, label in enumerate(labels[channel])}
    table = pa.table({name: np.ascontiguousarray(values) for name, values in columns.items()})
    pyarrow.parquet.write_table(table, path, row_group_size=BLOCK_ROWS, write_page_checksum=True)
    return []
