"""Evidence of a saved result, from the friction_torque.parquet next to its result.json."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from stribeck.core.errors import SettingsError
from stribeck.core.result import Evidence, Result
from stribeck.core.result.samples import MOST_KEPT, FrictionSamples


def saved_evidence(result: Result) -> Evidence:
    """Read the samples of a saved result, evenly thinned.

    The table has no close-up, provenance, notes or accelerations; accelerations are computed by differences.

    Raises
    ------
    SettingsError
        If the result was not read from a file, or its table is missing or damaged.
    """
    path = Path(result.path).parent / "friction_torque.parquet"
    needed = "expected the friction_torque.parquet that `stribeck identify` wrote next to this result.json"
    if not result.path:
        raise SettingsError(f"{result.robot}: the result has no samples; {needed}")
    if not path.is_file():
        raise SettingsError(f"{path}: no such file; {needed}")
    try:
        table = pq.read_table(path)
        every = max(1, -(-len(table) // MOST_KEPT))
        columns = {name: table[name].to_numpy()[::every] for name in table.column_names}
        names = tuple(name.removeprefix("velocity.") for name in columns if name.startswith("velocity."))
        kinds = ("velocity", "friction_torque", "usable")
        velocity, torque, usable = (np.stack([columns[f"{kind}.{name}"] for name in names], 1) for kind in kinds)
        time, support_text = columns["time"].astype(float), columns["support"].astype(str)
    except (pa.ArrowException, OSError, KeyError, ValueError) as error:
        raise SettingsError(f"{path}: is not the table of this result ({error}); {needed}") from error
    support_names, support = np.unique(support_text, return_inverse=True)
    samples = FrictionSamples(
        joint_names=names,
        period=1.0 / result.log.rate,
        time=time,
        velocity=velocity.astype(float),
        acceleration=np.gradient(velocity.astype(float), every / result.log.rate, axis=0),
        friction_torque=torque.astype(float),
        usable=usable.astype(bool),
        block=columns["block"],
        support=support,
        support_names=tuple(support_names.tolist()),
        stride=every,
    )
    edges = np.flatnonzero(np.diff(support) | np.diff(columns["log"])) + 1
    phases = [
        (float(time[rows[0]]), float(time[rows[-1]]), str(support_names[support[rows[0]]]), bool(usable[rows].any()))
        for rows in np.split(np.arange(len(time)), edges)
    ]
    prismatic = frozenset(name for name, joint in result.all_friction.items() if joint.slides)
    return Evidence(
        samples=samples, phases=phases, close_up=None, provenance=[], prismatic=prismatic, torque_source=None
    )
