"""Tables of text, for consoles and notebooks."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """Title, headings of text, number and text columns, rows of cells, and sentences below the table."""

    title: str
    left: Sequence[str]
    right: Sequence[str] = ()
    last: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    notes: Sequence[str] = ()

    def html(self) -> str:
        """Format for notebooks."""
        head = "".join(f"<th>{escape(name)}</th>" for name in (*self.left, *self.right, *self.last))
        rows = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in self.rows)
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        below = "".join(f"<p>{escape(note)}</p>" for note in self.notes)
        title = f"<caption>{escape(self.title)}</caption>"
        return f"<table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{below}"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Format rows of cells as lines with columns of equal width."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def number(value: float) -> str:
    """Format a number with four significant digits."""
    return f"{value:.4g}"


def span(ends: Sequence[float]) -> str:
    """Format a range, e.g. "-1.2 to 0.8"."""
    return f"{number(ends[0])} to {number(ends[1])}"
