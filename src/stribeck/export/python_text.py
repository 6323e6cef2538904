"""What Python modules that are written have in common: their docstring, and numbers by joint."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stribeck.export.joints import JointTerms


def docstring(lines: Iterable[str]) -> str:
    """Return lines as a module's docstring, which none of their characters can end."""
    text = "\n".join(" ".join(line.split()).replace("\\", "/").replace('"', "'") for line in lines)
    return f'"""{text}\n"""\n'


def joints_text(joints: Mapping[str, JointTerms]) -> str:
    """Return `JOINTS`, a dictionary of joint -> word -> value in SI units."""
    numbers = {name: {word: value for word, (value, _) in terms.stated.items()} for name, terms in joints.items()}
    rows = [f"    {name!r}: {own!r}," for name, own in numbers.items()]
    return "\n".join(["JOINTS = {", *rows, "}"])
