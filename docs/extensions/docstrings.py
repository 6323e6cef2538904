"""Docstrings are written for people who read the code; here they become reStructuredText without loss."""

import re
from typing import Any

from pydantic import BaseModel
from sphinx.application import Sphinx

CODE = re.compile(r"(`[^`]*`)")
"""What stands between backticks is taken as it is."""

ARRAY = re.compile(r"~?numpy\.ndarray\[tuple\[~?typing\.Any, \.\.\.\], ~?numpy\.dtype\[~?numpy\.(\w+)\]\]")
"""What NumPy's NDArray stands for."""


def short_types(text: str) -> str:
    """Return a signature with the names of array types that the source has."""
    return ARRAY.sub(lambda found: "Array" if found[1] == "float64" else f"NDArray[{found[1]}]", text)


def escape(line: str) -> str:
    """Return a line whose bars and stars are what they are: |v| and v * a, not a substitution and not emphasis."""
    pieces = CODE.split(line)
    pieces[::2] = [re.sub(r"(?<!\*)([|*])(?!\*)", r"\\\1", piece) for piece in pieces[::2]]
    return "".join(pieces)


def escape_all(_app: Sphinx, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Escape every line of a docstring in place."""
    lines[:] = [escape(line) for line in lines]


def short_signature(
    _app: Sphinx, _what: str, _name: str, thing: Any, _options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Write settings as their source has them, and three dots for defaults that dataclasses make."""
    if isinstance(thing, type) and issubclass(thing, BaseModel):
        kinds = thing.__annotations__
        keys = (f"{key}: {kinds[key]} = {field.default!r}" for key, field in thing.model_fields.items())
        return f"(*, {', '.join(keys)})", None
    short = signature and short_types(signature.replace("<factory>", "..."))
    return short, returned and short_types(returned)


def leave_out(_app: Sphinx, what: str, name: str, _thing: Any, skip: bool, _options: Any) -> bool:
    """Leave out a module's constants: they stand beside the code that uses them."""
    return skip or (what == "module" and name.isupper())


def setup(app: Sphinx) -> dict[str, bool]:
    """Listen before napoleon, which turns sections into fields."""
    app.connect("autodoc-process-docstring", escape_all, priority=100)
    app.connect("autodoc-process-signature", short_signature)
    app.connect("autodoc-skip-member", leave_out)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
