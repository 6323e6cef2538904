"""Tables 6.1 and 6.2: all parameters of all leg joints, walking straight, and straight and sideways.

As in the paper, the logs have no noise; for comparison, the same walk is also identified from noisy sensors. The study
also shows the effect of the filter's window and of two settings: a robust `loss`, and `averaged_law`, which averages
the law as the filter averages the acceleration.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stribeck import Settings
from stribeck.settings import FilterSettings
from stribeck_simulation.sensors.measure import measure, sensors_for
from stribeck_simulation.sensors.profiles import get_profile
from studies.markdown import markdown_table
from studies.paper import figures
from studies.paper.identified import JOINTS, PARAMETERS, identified, mean_and_worst, read_paper
from studies.paper.study import Numbers
from studies.paper.walks import get_walk

WALKS = ("straight", "straight-and-sideways")
PLAIN = Settings()
SETTINGS = Settings(loss="huber", averaged_law=True)
FITS = {
    "as `identify` comes": PLAIN,
    "law averaged": Settings(averaged_law=True),
    "outliers heeded less": Settings(loss="huber"),
    "both": SETTINGS,
}
SENSORS = ("calibrated", "realistic")
SEED = 1
QUICK_STRIDE = 4
"""Stride of the samples in the quick variant."""
WINDOWS = (9, 15, 21, 31)
"""Windows of the filter [samples of 1 ms]; without noise, `auto` chooses the shortest."""
UNITS = ("N m s/rad", "N m", "1", "rad/s", "N m", "s/rad")
SYMBOLS = ("Fv", "Fc", "S", "vs", "offset", "a")
TITLES = ("viscous", "Coulomb", "Stribeck gain", "Stribeck velocity", "offset", "slope")
TURNING = ("right_hip_pitch", "right_knee", "left_hip_pitch", "left_knee")
"""Joints with fast reversals."""
BENT = (2, 3, 5)
"""Indices of the parameters that the filter distorts at reversals."""


def run(quick: bool) -> Numbers:
    both = get_walk("straight-and-sideways", quick)
    if quick:
        both = replace(both, log=both.log.take(slice(None, None, QUICK_STRIDE)))
    settings = {name: _short(each, quick) for name, each in FITS.items()}
    fits = {name: identified(both, each) for name, each in settings.items()}
    # two straight steps determine no joint's friction
    ahead = fits if quick else {name: identified(get_walk("straight"), each) for name, each in settings.items()}
    found = {"straight": ahead["both"], "straight-and-sideways": fits["both"]}
    logs = {name: measure(both.log, sensors_for(both.log, get_profile(name), SEED)) for name in SENSORS}
    noisy = {
        name: {fit: identified(both, settings[fit], log) for fit in ("as `identify` comes", "both")}
        for name, log in logs.items()
    }
    windows = {
        name: [_bent(identified(both, _windowed(settings[name], window))) for window in WINDOWS[: 1 if quick else None]]
        for name in ("outliers heeded less", "both")
    }
    return {
        "found": found,
        "truth": {joint: [both.truth.parameters[joint][name] for name in PARAMETERS] for joint in JOINTS},
        "fits": {name: mean_and_worst(rows) for name, rows in fits.items()},
        "straight_slopes": {name: [rows[joint]["error"][5] for joint in TURNING] for name, rows in ahead.items()},
        "noisy": {name: {fit: _noisy(rows) for fit, rows in fits.items()} for name, fits in noisy.items()},
        "windows": windows,
    }


def drawings(numbers: Numbers) -> dict[str, Callable[[Figure], None]]:
    """Make the figure of the errors of Table 6.2."""
    return {"tables-errors": partial(_draw_errors, numbers=numbers)}


def _short(settings: Settings, quick: bool) -> Settings:
    """Shorten the blocks for the quick variant, so that a few steps are sufficient."""
    return settings.model_copy(update={"block": 0.1}) if quick else settings


def _noisy(rows: dict[str, Numbers]) -> Numbers:
    """Compute errors, the number of joints with all parameters identified, and the coverage of the intervals."""
    return {
        **mean_and_worst(rows),
        "identified": sum(not np.any(row["weak"]) for row in rows.values()),
        "held": np.nanmean([row["held"] for row in rows.values()]),
    }


def _windowed(settings: Settings, window: int) -> Settings:
    return settings.model_copy(update={"filter": FilterSettings(kind="savitzky-golay", window=window)})


def _bent(rows: dict[str, Numbers]) -> list[float]:
    """Compute the mean errors of the parameters that the filter distorts at reversals [%]."""
    return [float(error) for error in mean_and_worst(rows)["mean"][list(BENT)]]


def _draw_errors(figure: Figure, numbers: Numbers) -> None:
    """Draw the error of each parameter of each joint in Table 6.2: the paper's, and ours with its interval."""
    figure.set_size_inches(figures.SIZE[0], 4.4)
    panels = figure.subplots(2, 3, sharex=True).ravel()
    paper, found = read_paper()["straight-and-sideways"], numbers["found"]["straight-and-sideways"]
    truth, places = numbers["truth"], np.arange(len(JOINTS))
    for k, axes in enumerate(panels):
        true = np.array([truth[joint][k] for joint in JOINTS])
        printed = 100 * (np.array([paper[joint]["found"][k] for joint in JOINTS]) / true - 1)
        error, width = ([found[joint][key][k] for joint in JOINTS] for key in ("error", "half_width"))
        axes.axhline(0, color=figures.ink(), lw=0.7)
        axes.plot(places - 0.15, printed, "o", color="C1", mfc="none", ms=4, label="the paper")
        bars = 100 * np.array(width) / true
        axes.errorbar(places + 0.15, error, bars, fmt="o", color="C0", ms=3, lw=1, label="here, with 95 % interval")
        axes.set_title(TITLES[k])
        labels = [f"{joint[0].upper()} {joint.split('_', 1)[1].replace('_', ' ')}" for joint in JOINTS]
        axes.set_xticks(places, labels, rotation=90, fontsize=6.5)
    for axes in panels[::3]:
        axes.set_ylabel("error [%]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)


def texts(numbers: Numbers) -> dict[str, str]:
    """Format both tables, their means and worst errors, and the figures that the statements quote."""
    paper = read_paper()
    fits, noisy, straight = numbers["fits"], numbers["noisy"], numbers["found"]["straight"]
    weak = [joint for joint, row in straight.items() if np.any(row["weak"])]
    known = [row["error"][k] for row in straight.values() for k in (3, 4)]
    bent = {name: [f"{value:.2g}" for value in numbers["windows"][name][-1]] for name in numbers["windows"]}
    return {
        **{f"{walk}": _table(paper[walk], numbers["found"][walk]) for walk in WALKS},
        "reasons": markdown_table(
            ("joint", "top speed [rad/s]", "errors of Fv, Fc, S here", "in the paper"),
            [_reason(joint, straight[joint], paper["straight"][joint]) for joint in weak],
        ),
        "summary": _summary(mean_and_worst(paper["straight-and-sideways"]), fits, noisy),
        "weak": str(len(weak)),
        "weak-worst": f"{max(abs(straight[joint]['error'][0]) for joint in JOINTS):.0f} %",
        "straight-known": f"{max(map(abs, known)):.1f} %",
        **{f"straight-{label}": _span(numbers["straight_slopes"][fit]) for label, fit in SPANS.items()},
        "paper-slopes": _span([paper["straight"][joint]["error"][5] for joint in TURNING]),
        "mean": _errors(fits["both"]["mean"]),
        "paper-mean": _errors(mean_and_worst(paper["straight-and-sideways"])["mean"]),
        "plain-slope": f"{fits['as `identify` comes']['worst'][5]:.2g} %",
        "both-slope": f"{fits['both']['worst'][5]:.2g} %",
        "window": str(WINDOWS[-1]),
        "window-plain": " / ".join(bent["outliers heeded less"]) + " %",
        "window-averaged": " / ".join(bent["both"]) + " %",
        **{name: " and ".join(str(fit["identified"]) for fit in fits.values()) for name, fits in noisy.items()},
        **{
            f"{name}-held": " and ".join(f"{100 * fit['held']:.0f} %" for fit in fits.values())
            for name, fits in noisy.items()
        },
    }


SPANS = {"plain": "as `identify` comes", "averaged": "law averaged", "heeded": "outliers heeded less", "both": "both"}


def _span(errors: Iterable[float]) -> str:
    sizes = [abs(error) for error in errors]
    return f"{min(sizes):.2g} to {max(sizes):.2g} %"


def _errors(values: Iterable[float]) -> str:
    return ", ".join(f"{symbol} {value:.2g}" for symbol, value in zip(SYMBOLS, values, strict=True)) + " %"


def _table(paper: Numbers, found: Numbers) -> str:
    """Format one of the paper's tables with two rows per joint: the paper's and ours."""
    head = ("joint", "", *(f"{symbol} [{unit}]" for symbol, unit in zip(SYMBOLS, UNITS, strict=True)))
    rows: list[tuple[str, ...]] = []
    for joint, row in found.items():
        name, printed = joint.replace("_", " "), paper[joint]
        cells = [
            f"{value:.4g}<br>{error:.2f} %" for value, error in zip(printed["found"], printed["error"], strict=True)
        ]
        rows.append((name, "paper", *cells))
        ours = zip(row["value"], row["half_width"], row["error"], row["weak"], strict=True)
        rows.append((f"**{row['verdict']}**", "here", *(_cell(*each) for each in ours)))
    return markdown_table(head, rows)


def _cell(value: float, half_width: float, error: float, weak: float) -> str:
    if np.isnan(value):
        return "–"
    size = f"{abs(error):.2f} %"
    return f"{value:.4g} ± {half_width:.1g}<br>{f'*{size}, weak*' if weak else size}"


def _reason(joint: str, row: Numbers, paper: Numbers) -> tuple[str, ...]:
    ours, printed = (" / ".join(_two(abs(error)) for error in each["error"][:3]) + " %" for each in (row, paper))
    return joint.replace("_", " "), f"{row['top_speed']:.2f}", ours, printed


def _two(value: float) -> str:
    """Format a number with two significant digits, from 100 on without decimals."""
    return f"{value:.2g}" if value < 100 else f"{value:,.0f}"


def _summary(paper: Numbers, fits: Numbers, noisy: Numbers) -> str:
    noise = {f"{fit}, `{name}` sensors": row for name, each in noisy.items() for fit, row in each.items()}
    cells = [
        (name, *(f"{_two(mean)} / {_two(worst)}" for mean, worst in zip(row["mean"], row["worst"], strict=True)))
        for name, row in {"the paper": paper, **fits, **noise}.items()
    ]
    return markdown_table(("mean / worst error [%]", *SYMBOLS), cells)
