"""Write the table of statements into README.md, and print all numbers of the studies.

`statements.toml` lists the claims of the paper in their order: place, claim, the study that tests the claim, outcome
and finding, where `{study.text}` stands for a text of a study.
"""

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

from studies.markdown import markdown_table, with_table
from studies.paper.study import NUMBERS, ROOT, find_studies

PAGE = ROOT / "studies" / "paper" / "README.md"
STATEMENTS = Path(__file__).parent / "statements.toml"


def all_texts() -> dict[str, str]:
    """Format the kept numbers of all studies as texts, by "study.text"."""
    texts: dict[str, str] = {}
    for name, study in find_studies().items():
        found = study.texts(json.loads((NUMBERS / f"{name}.json").read_text(encoding="utf-8")))
        texts |= {f"{name}.{label}": text for label, text in found.items()}
    return texts


def read_statements() -> list[dict[str, str]]:
    """Read the statements in the order of the paper: place, claim, study, outcome and finding."""
    statements: list[dict[str, str]] = tomllib.loads(STATEMENTS.read_text(encoding="utf-8"))["statement"]
    return statements


def filled(page: str, texts: Mapping[str, str]) -> str:
    """Replace the table of statements in a page; a KeyError names a text that no study has.

    Of the confirmed statements, the page has only the tables of the paper.
    """
    shown = (each for each in read_statements() if each["outcome"] != "confirmed" or "Table" in each["place"])
    return with_table(page, _table(shown, texts))


def _table(statements: Iterable[Mapping[str, str]], texts: Mapping[str, str]) -> str:
    rows = []
    for each in statements:
        finding = re.sub(r"\{(\w+\.[\w-]+)\}", lambda match: texts[match[1]], each.get("finding", ""))
        rows.append((each["place"], each["claim"], f"**{each['outcome']}**", finding))
    return markdown_table(("place", "the paper", "outcome", "here"), rows, 4)


def fill_page() -> None:
    """Bring the page up to date."""
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), all_texts()), encoding="utf-8")


def print_numbers() -> None:
    """Print all statements, then each study's description, texts and numbers."""
    print(_table(read_statements(), all_texts()))
    for name, study in find_studies().items():
        print(f"\n# {name}\n\n{study.__doc__}")
        numbers = json.loads((NUMBERS / f"{name}.json").read_text(encoding="utf-8"))
        for label, text in study.texts(numbers).items():
            print(f"\n## {label}\n\n{text}\n" if "\n" in text else f"{label}: {text}")
        print(json.dumps(numbers, indent=1))
