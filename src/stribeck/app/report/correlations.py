"""Picture of the correlations between the errors of all friction parameters."""

import numpy as np

from stribeck.app.report.charts import Chart, axis, image
from stribeck.app.report.page import Section, section
from stribeck.app.report.text import short_names
from stribeck.core.result import Result


def correlations(result: Result) -> Section | None:
    """Draw the matrix of correlations, and list the strongest; None with fewer than two known parameters."""
    joints = {name: joint for name, joint in result.joints.items() if joint.parameters}
    posterior, short = result.posterior, short_names(result.joints)
    count = sum(len(joint.parameters) for joint in joints.values())  # bodies follow
    error = np.sqrt(np.diag(posterior.covariance)[:count])
    if count < 2 or not error.any():
        return None
    matrix = posterior.covariance[:count, :count] / np.maximum(np.outer(error, error), 1e-300)
    pixels = np.zeros((count, count, 4), dtype=np.uint8)
    pixels[..., :3] = np.where(matrix[..., None] < 0, (64, 133, 224), (209, 72, 10))  # blue, orange
    pixels[..., 3] = 15 * np.round(17 * np.minimum(np.abs(matrix), 1.0))
    ends = np.cumsum([0, *(len(joint.parameters) for joint in joints.values())])
    middles, names = (ends[:-1] + ends[1:]) / 2, [short[name] for name in joints]
    chart: Chart = {
        "x": axis("", (0.0, count), at=middles.tolist(), names=names),
        "y": axis("", (0.0, count), at=(count - middles).tolist(), names=names),
        "lines": [],
        "images": [image(pixels, (0.0, count), (0.0, count))],
        "equal": True,
        "height": 560,
    }
    rows, columns = np.triu_indices(count, 1)
    strongest = np.argsort(-np.abs(matrix[rows, columns]))[:8]
    pairs = [
        (*(posterior.names[k] for k in (rows[n], columns[n])), float(matrix[rows[n], columns[n]])) for n in strongest
    ]
    caption = "Each square is a pair of parameters, in the order of the table of verdicts"
    return section(
        "correlations", "Correlations of the parameters", "correlations", {"m": (chart, caption)}, pairs=pairs
    )
