"""Docstrings are written for people who read the code; here they become reStructuredText without loss."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

CODE = re.compile(r"(`[^`]*`)")
"""What stands between backticks is taken as it is."""


def escape(line: str) -> str:
    """Return a line whose bars and stars are what they are: |v| and v * a, not a substitution and not emphasis."""
    pieces = CODE.split(line)
    pieces[::2] = [re.sub(r"(?<!\*)([|*])(?!\*)", r"\\\1", piece) for piece in pieces[::2]]
    return "".join(pieces)


def escape_all(_app: Sphinx, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Escape every line of a docstring in place."""
    lines[:] = [escape(line) for line in lines]


def short_defaults(
    _app: Sphinx, _what: str, _name: str, _thing: Any, _options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Write three dots for defaults that dataclasses make, which are no Python."""
    return signature and signature.replace("<factory>", "..."), returned


def leave_out(_app: Sphinx, what: str, name: str, _thing: Any, skip: bool, _options: Any) -> bool:
    """Leave out a module's constants: they stand beside the code that uses them."""
    return skip or (what == "module" and name.isupper())


def setup(app: Sphinx) -> dict[str, bool]:
    """Listen before napoleon, which turns sections into fields."""
    app.connect("autodoc-process-docstring", escape_all, priority=100)
    app.connect("autodoc-process-signature", short_defaults)
    app.connect("autodoc-skip-member", leave_out)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
