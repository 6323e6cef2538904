"""Puts the numbers into the pages of docs/paper: `<!-- study.text -->...<!-- / -->` gets the text of that name."""

import json
import re
from pathlib import Path

from studies.paper.statements import statements_table
from studies.paper.study import NUMBERS, ROOT, find_studies

FOLDER = ROOT / "docs" / "paper"
_PLACE = re.compile(r"<!-- (\w+\.[\w-]+) -->.*?<!-- / -->", re.DOTALL)


def all_texts() -> dict[str, str]:
    """Return the texts of all studies that have numbers, by "study.text", and the table of statements."""
    texts: dict[str, str] = {}
    for name, study in find_studies().items():
        file = NUMBERS / f"{name}.json"
        if file.exists():
            found = study.texts(json.loads(file.read_text(encoding="utf-8")))
            texts |= {f"{name}.{label}": text for label, text in found.items()}
    return texts | {"statements.table": statements_table(texts)}


def filled(page: str, texts: dict[str, str]) -> str:
    """Return a page with its texts put in.

    Raises
    ------
    KeyError
        If it asks for a text that no study gives.
    """

    def put(match: re.Match[str]) -> str:
        text = texts[match[1]]
        gap = "\n\n" if "\n" in text else ""
        return f"<!-- {match[1]} -->{gap}{text}{gap}<!-- / -->"

    return _PLACE.sub(put, page)


def pages() -> list[Path]:
    """Return the pages that may ask for texts."""
    return sorted(FOLDER.glob("*.md"))


def fill_pages() -> None:
    """Bring all pages up to date."""
    texts = all_texts()
    for path in pages():
        path.write_text(filled(path.read_text(encoding="utf-8"), texts), encoding="utf-8")
