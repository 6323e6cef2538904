"""The claims of the paper, which study tests each, and what it finds (`statements.toml`), as a table."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

FILE = Path(__file__).parent / "statements.toml"


class Statement(BaseModel):
    """One claim of the paper."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    place: str  # section, equation or figure, and page
    claim: str  # in our words, short
    study: str  # module of this package
    outcome: Literal["confirmed", "sharpened", "contradicted", "open"]
    finding: str = ""  # Markdown; `{study.text}` stands for a text of a study


def read_statements() -> list[Statement]:
    """Return the statements in the order of the paper."""
    return [Statement(**each) for each in tomllib.loads(FILE.read_text(encoding="utf-8"))["statement"]]


def statements_table(texts: Mapping[str, str]) -> str:
    """Return the statements as a Markdown table, their findings filled with the studies' texts.

    Raises
    ------
    KeyError
        If a finding asks for a text that no study gives.
    """
    rows = []
    for number, each in enumerate(read_statements(), 1):
        finding = re.sub(r"\{(\w+\.[\w-]+)\}", lambda match: texts[match[1]], each.finding)
        rows.append(f"| {number} | {each.place} | {each.claim} | `{each.study}` | **{each.outcome}** | {finding} |")
    head = "| | where | the paper says | study | outcome | found |\n|---:|---|---|---|---|---|"
    return "\n".join([head, *rows])
