"""Markdown tables and numbers."""

import re
from collections.abc import Iterable, Sequence


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[object]], left: int = 1, right: int = 0) -> str:
    """Format a Markdown table; the first `left` and the last `right` columns contain text, all others numbers."""
    lines = [header, ["---"] * left + ["---:"] * (len(header) - left - right) + ["---"] * right, *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def short(value: float, digits: int = 2) -> str:
    """Format a number with this many significant digits; large ones without an exponent."""
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if "e+" in text else text


def percent(share: float, digits: int = 0) -> str:
    """Format a share [1] as a percentage with this many decimals."""
    return f"{100 * share:.{digits}f} %"


def with_table(page: str, table: str) -> str:
    """Replace the table of a page that has the same header; a ValueError names a header that is missing."""
    header = table.split("\n", 1)[0]
    found = re.compile(rf"^{re.escape(header)}\n(?:\|.*\n)*", re.MULTILINE)
    if not found.search(page):
        raise ValueError(f"the page has no table with the header {header}")
    return found.sub(lambda _: table + "\n", page)
