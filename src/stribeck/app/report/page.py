"""Common page of all HTML outputs: templates with their filters, style sheet, sections, contents."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from statistics import median
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from stribeck.app.report.charts import Chart, Figures, to_json
from stribeck.app.templates import environment
from stribeck.core.base.outputs import whole_or_not_at_all
from stribeck.core.friction.law import FrictionLaw
from stribeck.core.friction.terms import BEYOND_VELOCITY
from stribeck.core.result import Result
from stribeck.core.result.estimates import verdict_place
from stribeck.core.result.log_spread import change_text
from stribeck.core.result.tables import advice, friction_text, main_parameters, rounded

MINUS = "\N{MINUS SIGN}"
THIN = "\N{NARROW NO-BREAK SPACE}"


def number(value: float, digits: int = 3) -> str:
    """Format a value with this many significant digits: `0.0123`, `1,520`, `1.2e7`."""
    if not math.isfinite(value):
        return "unknown" if math.isnan(value) else ("∞" if value > 0 else f"{MINUS}∞")
    if not value:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if exponent >= 7 or exponent < -5:
        text = f"{value:.{digits - 1}e}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
    else:
        text = f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return text.replace("-", MINUS)


def matched(value: float, error: float) -> str:
    """Format a value down to the second digit of its error."""
    if not (math.isfinite(value) and math.isfinite(error)) or error <= 0:
        return number(value, 4)
    decimals = 1 - math.floor(math.log10(error))
    if value and math.floor(math.log10(abs(value))) + decimals > 9:
        return number(value, 9)  # error of rounding size
    if decimals > 6 or abs(value) >= 1e7:
        return number(value, 3)
    text = f"{value:.{max(decimals, 0)}f}"
    return (text if float(text) else text.lstrip("-")).replace("-", MINUS)


def brief(value: float, error: float) -> tuple[str, str]:
    """Format a value and its error with the digits of `rounded`: `1.183`, `0.006`."""
    if not (math.isfinite(value) and math.isfinite(error)) or not 1e-6 < error < 1e6 or abs(value) >= 1e6:
        return number(value), number(error, 2)
    text, shown = rounded(value, error)
    return text.replace("-", MINUS), shown


def percent(share: float) -> str:
    """Format a share as a percentage: `97 %`, with one decimal for small values."""
    value = 100 * share
    if abs(value) >= 1e7:
        return f"{number(value, 3)}{THIN}%"
    if 0 < value < 0.05:
        return f"<{THIN}0.1{THIN}%"
    shown = f"{min(value, 99.9):.1f}" if 99 < value < 100 or 0 < value < 1 else f"{round(value)}"
    return f"{shown}{THIN}%".replace("-", MINUS)


def count(value: int) -> str:
    """Format a whole number with thousands separated: `600 000`."""
    return f"{value:,}".replace(",", THIN)


def duration(seconds: float) -> str:
    """Format a duration as `12.5 s`, `10 min 4 s` or `2 h 3 min`."""
    if seconds < 100:
        return f"{number(seconds)} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 120:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"


def unit(text: str) -> str:
    """Format a unit with superscripts: `kg m^2` is `kg m²`."""
    return text.replace("^2", "²")


def breakable(name: str) -> Markup:
    """Allow line breaks after underscores, slashes and dots of a name."""
    pieces = re.split(r"(?<=[_/.+])(?=.)", name)
    return Markup("<wbr>").join(pieces)


def named(joints: Sequence[str]) -> str:
    """List joints by name, or their number if there are many."""
    return ", ".join(joints) if len(joints) <= 3 else f"{len(joints)} joints"


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Strip the words that all names begin or end with, such as `_joint`; the rest begins with a letter."""
    whole = list(names)
    parts = [name.split("_") for name in whole]
    for end, rest in ((-1, slice(None, -1)), (0, slice(1, None))):
        while len(parts) > 1 and len({words[end] for words in parts}) == 1:
            shorter = [words[rest] for words in parts]
            if not all(words and words[0][:1].isalpha() for words in shorter):
                break
            parts = shorter
    return {name: "_".join(words) for name, words in zip(whole, parts, strict=True)}


def words(name: str) -> str:
    """Format a parameter's name: `stribeck_velocity` is `Stribeck velocity`."""
    text = name.replace("_", " ")
    return text[:1].upper() + text[1:]


def symbol(text: str) -> Markup:
    """Format a parameter's symbol with subscripts: `Fc+` is F<sub>c+</sub>, `tau_os` is τ<sub>os</sub>."""
    greek = {"tau": "τ", "delta": "δ", "mu": "μ", "alpha": "α"}
    head, _, index = text.partition("_")
    if head in greek:
        head = greek[head]
    elif not index:
        head, index = text[:1], text[1:]
    lowered = Markup("<sub>{}</sub>").format(index.replace("-", MINUS)) if index else ""
    return Markup("<i>{}</i>{}").format(head, lowered)


def parameter_names(result: Result, law: FrictionLaw) -> list[str]:
    """List the law's parameters, followed by other fitted parameters (rotor inertia)."""
    fitted = list(dict.fromkeys(name for joint in result.joints.values() for name in joint.parameters))
    known = [p.name for p in law.parameters if p.neutral is None or p.name in fitted]
    return list(dict.fromkeys([*known, *(p.name for p in BEYOND_VELOCITY if p.name in fitted), *fitted]))


def symbols(law: FrictionLaw) -> dict[str, str]:
    """Collect the symbols of all parameters by name, for the law and for terms beyond velocity."""
    return {parameter.name: parameter.symbol for parameter in (*law.parameters, *BEYOND_VELOCITY)}


def gain(value: float) -> str:
    """Format the gain of a term: `4 932` with thousands separated, small values with a decimal, `2.1`."""
    text = count(round(value)) if abs(value) >= 10 else f"{value:.1f}"
    return "0" if abs(value) < 0.05 else text.replace("-", MINUS)


def share(value: float, decimals: int = 3) -> str:
    """Format a coefficient of determination, e.g. `0.987`; near one with more digits, never rounded to one."""
    if not math.isfinite(value):
        return number(value)
    if value < -9.995:
        return f"< {MINUS}10"
    decimals += value >= 1 - 0.5 * 10**-decimals
    return f"{min(value, 1 - 10**-decimals) if value < 1 else value:.{decimals}f}".replace("-", MINUS)


_OWN = (number, matched, brief, percent, count, gain, share, duration, words, unit, breakable, symbol, named)
_FILTERS: tuple[Any, ...] = (*_OWN, median, advice, change_text, main_parameters, friction_text)
FILTERS: dict[str, Any] = {"place": verdict_place, **{function.__name__: function for function in _FILTERS}}
"""Filters of the templates, by name."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """Section of a page: heading, anchor for the contents, HTML and charts.

    The HTML contains an element for each chart by name: `figure(name, caption)` of `figures.html.j2`.
    """

    anchor: str
    title: str
    body: Markup
    charts: Mapping[str, Chart] = field(default_factory=dict)


def section(anchor: str, title: str, template: str, figures: Figures | None = None, **values: Any) -> Section:
    """Render a section from a template, which gets the names and captions of the figures, if there are any."""
    charts = {name: chart for name, (chart, _) in (figures or {}).items()}
    if figures is not None:
        values["figures"] = [(name, caption) for name, (_, caption) in figures.items()]
    return Section(anchor=anchor, title=title, body=render(f"{template}.html.j2", **values), charts=charts)


@cache
def _environment() -> Environment:
    return environment("stribeck.app.report", FILTERS, autoescape=True)


def render(template: str, **values: Any) -> Markup:
    """Render a template of this package, e.g. `verdict_table.html.j2`."""
    return Markup(_environment().get_template(template).render(**values))  # Jinja escapes the values  # nosec B704


def render_page(
    title: str, sections: Sequence[Section | None], *, folded: Sequence[Section | None] = (), lead: Markup | None = None
) -> str:
    """Render a complete HTML document without external references.

    Parameters
    ----------
    title
        Plain text; escaped here.
    sections
        Sections in reading order; None for omitted ones.
    folded
        Sections after `sections`, each shown when opened.
    lead
        HTML between the title and the sections.
    """
    shown, behind = ([section for section in part if section is not None] for part in (sections, folded))
    charts = {name: chart for section in (*shown, *behind) for name, chart in section.charts.items()}
    return str(
        render(
            "page.html.j2",
            title=title,
            sections=shown,
            folded=behind,
            lead=lead or Markup(),
            charts=to_json(charts) if charts else "",
            style=[_file("uplot/uPlot.min.css"), _file("templates/style.css")],
            # uPlot 1.6.32, MIT: the files of `npm pack uplot`. It adds 50 kB to a page; Plotly adds 1.2 MB or 4.8 MB.
            licence=_file("uplot/LICENSE"),
            library=_file("uplot/uPlot.iife.min.js"),
            script=_file("templates/page.js"),
        )
    )


def write_page(path: str | Path, title: str, sections: Sequence[Section | None], **more: Any) -> None:
    """Write a page (see `render_page`), completely or not at all."""
    page = render_page(title, sections, **more)
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


@cache
def _file(name: str) -> Markup:
    return Markup((files("stribeck.app.report") / name).read_text(encoding="utf-8"))  # of this package  # nosec B704
