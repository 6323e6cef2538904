"""The page that every HTML output of stribeck shares: templates, style sheet, sections, contents."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from stribeck.report.text import FILTERS


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of the page: its heading, the anchor that the contents link to, and its finished HTML."""

    anchor: str
    title: str
    body: Markup


@cache
def _environment() -> Environment:
    """Every text is escaped, and a name that a template does not get is an error."""
    environment = Environment(
        loader=PackageLoader("stribeck.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(FILTERS)
    return environment


def render(template: str, **values: Any) -> Markup:
    """Return the HTML of one template of this package, e.g. `verdict_table.html.j2`."""
    return Markup(_environment().get_template(template).render(**values))  # Jinja escapes the values  # nosec B704


def render_page(
    title: str,
    sections: Sequence[Section],
    *,
    folded: Sequence[Section] = (),
    lead: Markup | None = None,
    plots: bool = False,
) -> str:
    """Return a whole HTML document without any reference to the outside.

    Parameters
    ----------
    title
        Plain text; escaped here.
    sections
        In reading order.
    folded
        Behind them, each shown when it is opened.
    lead
        HTML between the title and the sections: what the page is about, in numbers.
    plots
        Whether it has curves for the plotting library to make live.
    """
    library, library_style = plotting_library() if plots else (Markup(), Markup())
    return str(
        render(
            "page.html.j2",
            title=title,
            sections=sections,
            folded=folded,
            lead=lead or Markup(),
            style=Markup(library_style + _file("style.css")),  # files of this package  # nosec B704
            scripts=[library, _file("first_screen.js")] if plots else [],
        )
    )


def _file(name: str) -> Markup:
    text = (files("stribeck.report") / "templates" / name).read_text(encoding="utf-8")
    return Markup(text)  # a file of this package  # nosec B704


@cache
def plotting_library() -> tuple[Markup, Markup]:
    """Return the script and the style sheet of uPlot, its licence in front.

    uPlot 1.6.32, MIT: the files are those that `npm pack uplot` has. It adds 50 kB to a page and draws thirty curves in
    a quarter of a second; Plotly adds 1.2 MB (basic) or 4.8 MB and takes three to five times as long.
    """
    folder = files("stribeck.report") / "uplot"
    script, style, licence = (
        (folder / name).read_text(encoding="utf-8") for name in ("uPlot.iife.min.js", "uPlot.min.css", "LICENSE")
    )
    return Markup(f"/* uPlot\n{licence}*/\n{script}"), Markup(style)  # files of this package  # nosec B704
