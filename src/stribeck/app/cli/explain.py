"""Explanations of verdicts and findings for the console."""

import textwrap
import tomllib
from functools import partial
from pathlib import Path

from stribeck.core.base.finding import catalogue, message
from stribeck.core.errors import SettingsError, did_you_mean

VERDICTS: dict[str, dict[str, str]] = tomllib.loads(Path(__file__).with_name("verdicts.toml").read_text("utf-8"))
"""Explanation and remedy of each verdict, by its name in commands."""


def explanation_names() -> list[str]:
    """List the names that `explanation` accepts: verdicts, then checks."""
    checks = (check for section in catalogue().values() for check in section if "." not in check)
    return [*VERDICTS, *checks]


def explanation(name: str) -> str:
    """Format the explanation of a verdict or check, with its remedy or an example.

    Raises
    ------
    SettingsError
        If no verdict and no check has this name.
    """
    name = name.replace(" ", "-")
    fill = partial(textwrap.fill, width=100)  # [columns]
    if name in VERDICTS:
        text, remedy = VERDICTS[name]["text"], VERDICTS[name]["remedy"]
        return "\n\n".join([name, fill(text), fill(f"Remedy: {remedy}")])
    entry = next((section[name] for section in catalogue().values() if "explanation" in section.get(name, {})), None)
    if entry is None:
        near = did_you_mean(name, explanation_names()) or "; `stribeck explain` lists all names"
        raise SettingsError(f"'{name}' is neither a verdict nor a check{near}")
    text, example = " ".join(entry["explanation"].split()), ". ".join(filter(None, message(entry, entry["example"])))
    parts = [text, f"Example: {example}.", entry.get("advice", "")]
    return "\n\n".join([name, *(fill(part) for part in parts if part)])
