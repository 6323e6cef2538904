"""Write docs/findings.md and docs/findings-after.md from the catalogue: `python docs/extensions/findings.py`."""

from pathlib import Path
from textwrap import fill
from typing import Any

from stribeck.core.base.finding import catalogue, message

DOCS = Path(__file__).parents[1]

HEADS = {
    "findings.md": """# Findings

Each section quotes an example of a finding with its remedy and explains the check. [Findings after the
fit](findings-after.md) have a separate page.

The findings name the cause of 27 of 32 faults in the log of a UR5 with a wrong model, list it among others for 2, and
name a wrong one for 1. Of 34 faults in the walk of a quadruped, they name the cause of 25; four causes are wrong, and
four faults of torques leave joints that are called identified although they are wrong. Of 45 faults in a simulated walk
of the G1, on which no threshold was chosen, they name the cause of 37; two are wrong, and four leave wrong joints
identified. No remedy, applied as printed, makes a joint worse. Without a fault, nothing is found
(`python -m studies.first_hour`, 2026-11-28). Friction
that drives compensate is not detected.

*Generated from `src/stribeck/core/base/findings.toml`.*

## Before the fit

`identify` and `inspect` audit each log: first channels, then orientation and contacts, then torques versus the model.
A fault hides the checks that depend on it. Joints that carry little load, and short logs, get few findings. A finding
that would make every number wrong *stops* `identify` unless you pass `--force`.
""",
    "findings-after.md": """# Findings after the fit

A fit may converge although the law does not describe the friction, or although another effect looks like friction.
Effects that move the friction curve by less than its interval are not reported.

In simulation, these checks report 26 of 56 causes, with nine false findings in 836 cases
(`python -m studies.misfits`, 2026-11-28).

*Generated from `src/stribeck/core/base/findings.toml`.*
""",
}


def pages() -> dict[str, str]:
    """Format each page, by file name."""
    return {name: _page(HEADS[name], entries) for name, entries in zip(HEADS, catalogue().values(), strict=True)}


def _page(head: str, entries: dict[str, dict[str, Any]]) -> str:
    level = "###" if "\n## " in head else "##"
    parts = [head]
    for check, entry in entries.items():
        if "." not in check:
            parts.append(f"{level} {_paragraph(check, entry)}")
    return "\n".join(parts)


def _paragraph(check: str, entry: dict[str, Any]) -> str:
    stops = entry.get("stops")
    explanation = " ".join(entry["explanation"].split())
    if stops:
        explanation += " Stops." if stops is True else f" Stops {stops}."
    example = ". ".join(filter(None, message(entry, entry["example"]))).replace("<", "\\<") + "."
    quoted = fill(example, 128, initial_indent="> ", subsequent_indent="> ", break_on_hyphens=False)
    texts = [check, quoted, _wrapped(" ".join([explanation, entry.get("advice", "")]))]
    return "\n\n".join(texts) + "\n"


def _wrapped(text: str) -> str:
    return fill(text, 130, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    for name, text in pages().items():
        (DOCS / name).write_text(text, encoding="utf-8")
