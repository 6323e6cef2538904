"""Puts numbers into the pages of docs/paper: `<!-- study.text -->...<!-- / -->` gets the text of that name.

`statements.toml` has the claims of the paper, in its own order: where, what, which study tests each, and what it finds,
in Markdown, where `{study.text}` stands for a text of a study.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from studies.markdown import markdown_table
from studies.paper.study import NUMBERS, ROOT, find_studies

STATEMENTS = Path(__file__).parent / "statements.toml"
PLACE = re.compile(r"<!-- (\w+\.[\w-]+) -->.*?<!-- / -->", re.DOTALL)


def all_texts() -> dict[str, str]:
    """Make the texts of all studies, by "study.text", and the table of statements."""
    texts: dict[str, str] = {}
    for name, study in find_studies().items():
        found = study.texts(json.loads((NUMBERS / f"{name}.json").read_text(encoding="utf-8")))
        texts |= {f"{name}.{label}": text for label, text in found.items()}
    return texts | {"statements.table": statements_table(texts)}


def read_statements() -> list[dict[str, str]]:
    """Read the statements in the order of the paper: place, claim, study, outcome and finding."""
    statements: list[dict[str, str]] = tomllib.loads(STATEMENTS.read_text(encoding="utf-8"))["statement"]
    return statements


def statements_table(texts: Mapping[str, str]) -> str:
    """Format the statements as a Markdown table, their findings filled with the studies' texts."""
    rows = []
    for number, each in enumerate(read_statements(), 1):
        finding = re.sub(r"\{(\w+\.[\w-]+)\}", lambda match: texts[match[1]], each.get("finding", ""))
        rows.append((number, each["place"], each["claim"], f"`{each['study']}`", f"**{each['outcome']}**", finding))
    return markdown_table(("", "where", "the paper says", "study", "outcome", "found"), rows, 6)


def filled(page: str, texts: Mapping[str, str]) -> str:
    """Put texts into a page; a KeyError names a text that no study has."""

    def put(match: re.Match[str]) -> str:
        text = texts[match[1]]
        gap = "\n\n" if "\n" in text else ""
        return f"<!-- {match[1]} -->{gap}{text}{gap}<!-- / -->"

    return PLACE.sub(put, page)


def pages() -> list[Path]:
    """List the pages that may have texts."""
    return sorted((ROOT / "docs" / "paper").glob("*.md"))


def fill_pages() -> None:
    """Bring all pages up to date."""
    texts = all_texts()
    for path in pages():
        path.write_text(filled(path.read_text(encoding="utf-8"), texts), encoding="utf-8")
