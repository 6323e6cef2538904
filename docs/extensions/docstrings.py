"""Convert docstrings, which are written for readers of the code, to reStructuredText."""

import re
from typing import Any

from pydantic import BaseModel
from sphinx.application import Sphinx

CODE = re.compile(r"(`[^`]*`)")
"""Text between backticks, which stays unchanged."""

ARRAY = re.compile(r"~?numpy\.ndarray\[tuple\[~?typing\.Any, \.\.\.\], ~?numpy\.dtype\[~?numpy\.(\w+)\]\]")
"""Expanded form of NumPy's NDArray."""


def short_types(text: str) -> str:
    """Replace expanded array types by the names in the source."""
    return ARRAY.sub(lambda found: "Array" if found[1] == "float64" else f"NDArray[{found[1]}]", text)


def escape(line: str) -> str:
    """Escape bars and stars of |v| and v * a, which would become a substitution or emphasis."""
    pieces = CODE.split(line)
    pieces[::2] = [re.sub(r"(?<!\*)([|*])(?!\*)", r"\\\1", piece) for piece in pieces[::2]]
    return "".join(pieces)


def escape_all(_app: Sphinx, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Escape every line of a docstring in place."""
    lines[:] = [escape(line) for line in lines]


def short_signature(
    _app: Sphinx, _what: str, _name: str, thing: Any, _options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Format settings like their source, and factory defaults as three dots."""
    if isinstance(thing, type) and issubclass(thing, BaseModel):
        kinds = thing.__annotations__
        keys = (f"{key}: {kinds[key]} = {field.default!r}" for key, field in thing.model_fields.items())
        return f"(*, {', '.join(keys)})", None
    short = signature and short_types(signature.replace("<factory>", "..."))
    return short, returned and short_types(returned)


def leave_out(_app: Sphinx, what: str, name: str, _thing: Any, skip: bool, _options: Any) -> bool:
    """Leave out constants of modules, which are documented next to the code that uses them."""
    return skip or (what == "module" and name.isupper())


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect before napoleon, which turns sections into fields."""
    app.connect("autodoc-process-docstring", escape_all, priority=100)
    app.connect("autodoc-process-signature", short_signature)
    app.connect("autodoc-skip-member", leave_out)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
