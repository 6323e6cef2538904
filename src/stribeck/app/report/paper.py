"""Page of `stribeck paper`: figures of the term paper for a log, with the texts of `paper.toml`."""

import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from stribeck.app.report.charts import POINTS, Chart, axis, line, over_time, robust_limits
from stribeck.app.report.page import section, write_page


def write_paper(parts: Iterable[Any], path: str | Path, robot: str) -> list[str]:
    """Write what the service `paper_sections` computed as one self-contained HTML file; return its main sentences."""
    every = tomllib.loads((files("stribeck.app.report") / "paper.toml").read_text(encoding="utf-8"))
    sections, sentences = [], []
    for part in parts:
        texts, points = every[part.key], POINTS // max(len(part.charts), 1)
        charts = [_chart(part, chart, texts, points) for chart in part.charts]
        about = texts[part.about].format(reason=part.reason)
        figures = {f"{part.key}{k}": chart for k, chart in enumerate(charts)}
        sections.append(section(part.key, texts["title"], "paper", figures, about=about, legend=texts["legend"]))
        sentences.append(" ".join([f"{texts['title']}:", about, *(f"{caption}." for _, caption in charts[:1])]))
    write_page(path, f"{robot}: figures of the term paper", sections)
    return sentences


def _chart(part: Any, chart: Any, texts: Mapping[str, Any], points: int) -> tuple[Chart, str]:
    """Draw the lines of a joint over time, frequency or velocity, and format its caption."""
    slides, other = chart.samples.slides(chart.column), chart.samples.torque_unit(chart.column)
    position, torque = "m" if slides else "rad", other or ("N" if slides else "N m")
    units = {"position": position, "torque": torque, "power": f"{torque} {position}/s" if other else "W"}
    units["joint"] = chart.samples.joint_names[chart.column]
    caption, x, y = (texts[key].format(*chart.numbers, **units) for key in ("caption", "x", "y"))
    legend = [*texts["legend"]] * (len(chart.values) // len(texts["legend"]))
    if x == "time [s]":
        return over_time(chart.along - chart.along[0], y, chart.values, legend, points, part.key), caption
    shown = np.concatenate(chart.values[: 1 if len(part.marks) else None])  # the spectrum of noise grows without end
    return {
        "x": axis(x, robust_limits(chart.along, share=0.0, margin=0.02)),
        "y": axis(y, robust_limits(shown[np.isfinite(shown)], share=0.0)),
        "lines": [line(chart.along, values, *key, width=1.5) for values, key in zip(chart.values, legend, strict=True)],
        "marks": list(part.marks),
    }, caption
