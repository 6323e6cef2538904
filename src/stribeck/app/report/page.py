"""Common page of all HTML outputs: templates, style sheet, sections, contents."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from stribeck.app.report.charts import Chart, Figures, to_json
from stribeck.app.report.text import FILTERS
from stribeck.core.base.outputs import whole_or_not_at_all


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
    """Create the Jinja environment, which escapes every text and raises an error for undefined names."""
    environment = Environment(
        loader=PackageLoader("stribeck.app.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(FILTERS)
    return environment


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
