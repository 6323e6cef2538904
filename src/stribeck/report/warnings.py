"""The warnings: what the reader must know before using a number."""

from __future__ import annotations

from stribeck.report.page import Section, render
from stribeck.result import Result


def warnings(result: Result) -> Section | None:
    """Return the section with a sentence a warning, or None without any."""
    if not result.warnings:
        return None
    return Section(anchor="warnings", title="Warnings", body=render("warnings.html.j2", warnings=result.warnings))
