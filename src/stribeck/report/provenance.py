"""Settings and provenance: what a reader needs to get the same numbers again."""

from __future__ import annotations

from stribeck.report.page import Section, render
from stribeck.result import Evidence, Result


def provenance(result: Result, evidence: Evidence) -> Section:
    """Return the section with logs and their hashes, versions, settings, and what was done to the log on the way."""
    paths = [result.log.path] if isinstance(result.log.path, str) else result.log.path
    hashes = [result.log.sha256] if isinstance(result.log.sha256, str) else result.log.sha256
    return Section(
        anchor="provenance",
        title="Settings and provenance",
        body=render(
            "provenance.html.j2",
            logs=list(zip(paths, hashes, strict=True)),
            rows=evidence.provenance,
            notes=evidence.notes,
        ),
    )
