"""Summarize the saved studies for docs/accuracy.md: one table and one figure per question.

`python -m studies pages` writes the tables into the page, and the figures.
"""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from benchmarks.contest.run import read_scores
from benchmarks.contest.table import summary_table
from matplotlib.figure import Figure

from studies import accuracy
from studies.accuracy import CURVE_FIT, DEFAULT
from studies.accuracy_cases import CASES
from studies.command import ROOT, Row, saved
from studies.harder_cases import CONDITIONS
from studies.markdown import markdown_table, percent, short, with_table
from studies.paper import figures

PAGE, ASSETS, SCORES = ROOT / "docs/accuracy.md", ROOT / "docs/assets", ROOT / "benchmarks/contest/scores.json"
Dots = Mapping[str, Mapping[str, Sequence[float]]]
"""Row -> method -> values."""
FITTED = ("curve-fit", "default")
"""Methods in the picture of real robots."""


def accuracy_rows(case: str, method: str) -> dict[str, list[Row]]:
    """Collect the runs of a case by robot."""
    found: dict[str, list[Row]] = {}
    for row in saved("accuracy"):
        if (row["case"], row["method"]) == (case, method):
            found.setdefault(row["robot"], []).append(row)
    return found


def walks_table(label: str, cases: Sequence[str]) -> str:
    """Format mean and worst error of Coulomb friction over all robots, and the coverage of the default's intervals."""
    cells = []
    for case in cases:
        curve, default = (accuracy_rows(case, method) for method in (CURVE_FIT, DEFAULT))
        covered = percent(accuracy.coverage([row for rows in default.values() for row in rows]))
        cells.append((case, _mean_and_worst(curve), _mean_and_worst(default), covered))
    return markdown_table((label, "curve fit, mean / worst [%]", "default, mean / worst [%]", "coverage"), cells)


def coulomb_errors(rows: Sequence[Row]) -> list[float]:
    """Average the relative errors of Coulomb friction over the seeds, per joint [%]."""
    by_joint: dict[str, list[float]] = {}
    for row in rows:
        for joint, value in zip(row["joints"], row["coulomb"], strict=True):
            by_joint.setdefault(joint, []).append(100 * value)
    return [float(np.mean(values)) for values in by_joint.values()]


def _mean_and_worst(robots: Mapping[str, list[Row]]) -> str:
    errors = [coulomb_errors(rows) for rows in robots.values()]
    return f"{short(float(np.mean([np.mean(each) for each in errors])))} / {short(max(map(max, errors)))}"


def _ratios() -> dict[str, dict[str, list[float]]]:
    """Divide the held-out errors of all joints by the errors without friction, by robot and method."""
    errors = {row["name"]: row["joints"].values() for row in saved("held_out")}
    return {
        robot: {name: [each[name] / each["no friction"] for each in joints] for name in FITTED}
        for robot, joints in errors.items()
    }


def tables() -> list[str]:
    """Format all tables of the page."""
    scores = read_scores(SCORES)
    return [
        walks_table("walks", list(CASES)),
        walks_table("disturbed walks", list(CONDITIONS)),
        "\n".join(summary_table(scores)),
    ]


def dots() -> dict[str, tuple[Dots, str]]:
    """Collect the values of all figures with the labels of their axes, by name."""
    percent = "mean error of Coulomb friction per robot [%]"
    walks, disturbed = (
        {
            case: {
                label: [float(np.mean(coulomb_errors(rows))) for rows in accuracy_rows(case, method).values()]
                for label, method in (("curve fit", CURVE_FIT), ("default", DEFAULT))
            }
            for case in cases
        }
        for cases in (CASES, CONDITIONS)
    )
    real = {robot: {"curve fit": each["curve-fit"], "default": each["default"]} for robot, each in _ratios().items()}
    return {
        "accuracy-walks": (walks, percent),
        "accuracy-disturbed": (disturbed, percent),
        "accuracy-real": (real, "held-out torque error per joint, relative to no friction"),
    }


def draw(figure: Figure, data: Dots, label: str) -> None:
    """Draw the values of each row on a logarithmic axis, one color per method."""
    figure.set_size_inches(figures.SIZE[0], 0.9 + 0.22 * len(data))
    axes = figure.subplots()
    for k, method in enumerate(("curve fit", "default")):
        for place, row in enumerate(data.values()):
            y = np.full(len(row[method]), place + 0.2 * (k - 0.5))
            axes.plot(row[method], y, "so"[k], color=f"C{1 - k}", ms=4, label="" if place else method)
    axes.set(xscale="log", xlabel=label, ylim=(len(data) - 0.5, -0.5))
    axes.set_yticks(range(len(data)), list(data))
    figure.legend(loc="outside upper right", ncols=2)


def main() -> None:
    for page in (PAGE, ROOT / "studies/accuracy.md"):
        text = page.read_text(encoding="utf-8")
        for table in (table for table in tables() if table.split("\n", 1)[0] in text):
            text = with_table(text, table)
        page.write_text(text, encoding="utf-8")
    for name, (data, label) in dots().items():
        figures.save(name, partial(draw, data=data, label=label), ASSETS)
