"""Explanations of verdicts and findings for the console."""

from textwrap import fill

from stribeck.base.finding import catalogue, message
from stribeck.errors import SettingsError, did_you_mean

WIDTH = 100
"""Width of an explanation [columns]."""

VERDICTS = {
    "identified": (
        "The friction curve is known to within ± 25 % (95 % interval), and the law explains samples that were not used "
        "for the fit. Single parameters can be less certain than the curve, because they compensate for each other.",
        "None is needed. Use the curve rather than single parameters that are marked weak.",
    ),
    "weak": (
        "The friction curve is known less well than ± 25 %, or another check failed: the law does not explain samples "
        "that were not used for the fit, or it would add power to the motion.",
        "Record more motion near the speed that the reason names; `stribeck plan` computes how much. If friction would "
        "add power or explains nothing, check signs, delays and the model first (`stribeck inspect`).",
    ),
    "no-friction": (
        "The friction is below the resolution of the log. The reason states its upper bound. Only the offset and the "
        "rotor inertia keep values.",
        "None is needed if the bound is small enough for you. Otherwise record a longer log with more reversals.",
    ),
    "not-excited": (
        "The joint moved too little for its friction to be identified. The reason names the missing motion.",
        "Record that motion. `stribeck plan` writes a trajectory for it.",
    ),
}
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
    if name in VERDICTS:
        text, remedy = VERDICTS[name]
        return "\n\n".join([name, fill(text, WIDTH), fill(f"Remedy: {remedy}", WIDTH)])
    entry = next((section[name] for section in catalogue().values() if "explanation" in section.get(name, {})), None)
    if entry is None:
        near = did_you_mean(name, explanation_names()) or "; `stribeck explain` lists all names"
        raise SettingsError(f"'{name}' is neither a verdict nor a check{near}")
    text, example = " ".join(entry["explanation"].split()), ". ".join(filter(None, message(entry, entry["example"])))
    parts = [text, f"Example: {example}.", entry.get("advice", "")]
    return "\n\n".join([name, *(fill(part, WIDTH) for part in parts if part)])
