"""The page that every HTML output of stribeck shares: templates, style sheet, sections, contents."""

from __future__ import annotations

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
    return Markup(_environment().get_template(template).render(**values))


def render_page(title: str, sections: Sequence[Section], *, lead: Markup | None = None) -> str:
    """Return a whole HTML document without any reference to the outside.

    Parameters
    ----------
    title
        Plain text; escaped here.
    sections
        In reading order; the contents at the top link to them.
    lead
        HTML between the title and the contents: what the page is about, in numbers.
    """
    style = Markup((files("stribeck.report") / "templates" / "style.css").read_text(encoding="utf-8"))
    return str(render("page.html.j2", title=title, sections=sections, lead=lead or Markup(), style=style))
