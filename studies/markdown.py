"""Markdown tables and numbers."""

import re
from collections.abc import Iterable, Sequence


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[object]], left: int = 1) -> str:
    """Format a Markdown table; the first `left` columns are aligned left, all others right."""
    lines = [header, [*["---"] * left, *["---:"] * (len(header) - left)], *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def short(value: float, digits: int = 2) -> str:
    """Format a number with this many significant digits; large ones without an exponent."""
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if "e+" in text else text


def with_table(page: str, table: str) -> str:
    """Replace the table of a page that has the same header; a ValueError names a header that is missing."""
    header = table.split("\n", 1)[0]
    found = re.compile(rf"^{re.escape(header)}\n(?:\|.*\n)*", re.MULTILINE)
    if not found.search(page):
        raise ValueError(f"the page has no table with the header {header}")
    return found.sub(lambda _: table + "\n", page)
