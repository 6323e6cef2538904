"""What Python modules that are written have in common: their docstring, and numbers by joint."""

from collections.abc import Iterable, Mapping

from stribeck.export.joints import JointTerms


def docstring(lines: Iterable[str]) -> str:
    """Return lines as a module's docstring, which none of their characters can end."""
    text = "\n".join(" ".join(line.split()).replace("\\", "/").replace('"', "'") for line in lines)
    return f'"""{text}\n"""\n'


def joints_text(joints: Mapping[str, JointTerms]) -> str:
    """Return `JOINTS`, a dictionary of joint -> word -> value in SI units."""
    numbers = {name: {word: value for word, (value, _) in terms.stated.items()} for name, terms in joints.items()}
    return dictionary_text("JOINTS", numbers)


def dictionary_text(name: str, entries: Mapping[str, object]) -> str:
    """Return a dictionary of Python by its name, a line an entry."""
    return "\n".join([f"{name} = {{", *(f"    {key!r}: {own!r}," for key, own in entries.items()), "}"])
