"""The runs of the accuracy study as a file, and what its tables say of them."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypedDict

import numpy as np

from stribeck.outputs import whole_or_not_at_all
from stribeck.typing import Array
from studies.accuracy_cases import CASES, NAMES, ROBOTS

INTERVALS = ("coulomb", "viscous", "offset")
METHODS = CURVE_FIT, DEFAULT, WHOLE_LOG, TRUSTED = (
    "curve-fit",
    "default",
    "whole-log, law known",
    "whole-log, law and model known",
)


class Run(TypedDict):
    """What a method makes of one robot, case and seed; lists are over the leg joints that got numbers."""

    robot: str
    case: str
    method: str
    seed: int
    seconds: float  # a second of the log
    chi_square: float | None
    joints: list[str]
    relative: list[float]  # Coulomb friction's error [1]
    shape: list[float]  # [1]
    error: dict[str, list[float]]  # found less true, by parameter
    standard_error: dict[str, list[float]]
    held: dict[str, list[int]]  # whether the 95 % interval covers the true value
    weak: dict[str, list[int]]


Key = tuple[str, str, str, int]
"""Robot, case, method and seed of a run."""


def key_of(one: Run) -> Key:
    """Return which run it is."""
    return one["robot"], one["case"], one["method"], one["seed"]


def read_runs(path: Path) -> dict[Key, Run]:
    """Return the runs that a file holds."""
    runs: list[Run] = json.loads(path.read_text(encoding="utf-8"))["runs"] if path.exists() else []
    return {key_of(one): one for one in runs}


def in_order(runs: dict[Key, Run]) -> list[Run]:
    """Return runs as the table has them."""
    orders = list(ROBOTS), list(CASES), METHODS
    places = {key: (*(each.index(name) for each, name in zip(orders, key[:3], strict=True)), key[3]) for key in runs}
    return [runs[key] for key in sorted(runs, key=places.__getitem__)]


def write_runs(path: Path, runs: dict[Key, Run]) -> None:
    """Write runs, one a line, whole or not at all."""
    with whole_or_not_at_all(path) as temporary:
        lines = ",\n".join(json.dumps(each) for each in in_order(runs))
        temporary.write_text(f'{{"runs": [\n{lines}\n]}}\n', encoding="utf-8")


def summary(runs: list[Run]) -> dict[str, float]:
    """Return means over seeds and joints, worst joints, shares of intervals and verdicts, and the time.

    "worst_joint" is of the joint that is worst on average over the seeds, "worst" the mean of the worst of each seed.
    """
    row = {"joints": _mean(runs, lambda one: len(one["joints"])), "seconds": _mean(runs, lambda one: one["seconds"])}
    measures: dict[str, Callable[[Run], Array]] = {
        "coulomb": lambda one: np.array(one["relative"]),
        "shape": lambda one: np.array(one["shape"]),
        "viscous": lambda one: np.abs(one["error"]["viscous"]),
        "offset": lambda one: np.abs(one["error"]["offset"]),
    }
    for name, measure in measures.items():
        row[name] = float(np.mean([measure(one).mean() for one in runs]))
    for name, measure in list(measures.items())[:2]:  # which every joint has
        row[f"{name}_worst_joint"] = max(_by_joint(runs, measure).values())
        row[f"{name}_worst"] = float(np.mean([measure(one).max() for one in runs]))
    row |= {f"{name}_covered": float(np.mean([each for one in runs for each in one["held"][name]])) for name in NAMES}
    row["weak"] = float(np.mean([each for one in runs for name in NAMES for each in one["weak"][name]]))
    return row


def _by_joint(runs: list[Run], measure: Callable[[Run], Array]) -> dict[str, float]:
    """Return the mean over the seeds of each joint that got numbers."""
    found: dict[str, list[float]] = {}
    for one in runs:
        for joint, value in zip(one["joints"], measure(one).tolist(), strict=True):
            found.setdefault(joint, []).append(value)
    return {joint: float(np.mean(values)) for joint, values in found.items()}


def _mean(runs: list[Run], measure: Callable[[Run], float]) -> float:
    return float(np.mean([measure(one) for one in runs]))


def _rms_over_error(runs: list[Run], name: str) -> float:
    ratios = [np.divide(one["error"][name], one["standard_error"][name]) for one in runs]
    return float(np.sqrt(np.mean(np.concatenate(ratios) ** 2)))


HEAD = (
    "| robot | case | method | seeds | Coulomb % | shape % | viscous | offset | Coulomb coverage "
    "| viscous coverage | offset coverage | weak | joints | s per s |\n"
    "|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
)


DEVIATIONS_HEAD = (
    f"| robot | case | method | {' | '.join(name.replace('_', ' ') for name in NAMES)} |\n"
    f"|---|---|---|{'---:|' * len(NAMES)}"
)


def table(runs: Iterable[Run]) -> list[str]:
    """Return rows of the tables in docs/whole-log.md."""
    return [
        f"| {' | '.join(label)} | {len(found)} | {_numbers(summary(found))} |"
        for label, found in _together(runs).items()
    ]


def deviations(runs: Iterable[Run]) -> list[str]:
    """Return the rows of the table of errors over standard errors, root mean square: one if the intervals are right."""
    return [
        f"| {' | '.join(label)} | {' | '.join(f'{_rms_over_error(found, name):.2f}' for name in NAMES)} |"
        for label, found in _together(runs).items()
    ]


def _together(runs: Iterable[Run]) -> dict[tuple[str, str, str], list[Run]]:
    """Return the seeds of each robot, case and method."""
    together: dict[tuple[str, str, str], list[Run]] = {}
    for one in runs:
        together.setdefault((one["robot"], one["case"], one["method"]), []).append(one)
    return together


def _numbers(row: dict[str, float]) -> str:
    errors = [
        f"{100 * row[name]:.2f} / {100 * row[f'{name}_worst_joint']:.1f} / {100 * row[f'{name}_worst']:.1f}"
        for name in ("coulomb", "shape")
    ]
    held = [f"{100 * row[f'{name}_covered']:.0f} %" for name in INTERVALS]
    rest = [f"{100 * row['weak']:.0f} %", f"{row['joints']:.1f}", f"{row['seconds']:.3f}"]
    return " | ".join([*errors, f"{row['viscous']:.3f}", f"{row['offset']:.3f}", *held, *rest])
