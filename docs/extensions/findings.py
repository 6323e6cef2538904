"""Write docs/findings.md from the catalogue: `python docs/extensions/findings.py`."""

from pathlib import Path
from textwrap import fill
from typing import Any

from stribeck.core.base.finding import catalogue, message

DOCS = Path(__file__).parents[1]

HEAD = """# Findings

Each section has the first sentence of a finding, its remedy, and the explanation of the check. `stribeck explain NAME`
prints an example with its evidence.

| logs | faults | cause named | wrong cause |
|---|---:|---:|---:|
| UR5, wrong model | 32 | 27 (4 more among others) | 1 |
| quadruped's walk | 34 | 26 (1 more among others) | 5 |
| G1's walk (no threshold was chosen on it) | 45 | 37 | 2 |

Four faults of the G1 leave wrong joints identified. No remedy makes a joint worse. Without a fault, nothing is
found (`python -m studies.first_hour`, 2026-11-30). Friction that drives compensate is not detected.

*Generated from `src/stribeck/core/base/findings.toml`.*
"""
SECTIONS = (
    """## Before the fit

`identify` and `inspect` audit each log: first channels, then orientation and contacts, then torques versus the model.
A fault hides the checks that depend on it. Joints that carry little load, and short logs, get few findings. A finding
that would make every number wrong *stops* `identify` unless you pass `--force`.
""",
    """## After the fit

A fit may converge although the law does not describe the friction, or although another effect looks like friction.
Effects that move the friction curve by less than its interval are notes. In simulation, these checks name 7 of
17 causes in logs of the humanoid on which their thresholds were chosen, and 17 of 39 in logs of a G1 and an arm. They
report 8 causes in 836 cases without them (`python -m studies.misfits`, 2026-11-30).
""",
)


def page() -> str:
    """Format the whole page."""
    parts = [HEAD]
    for head, entries in zip(SECTIONS, catalogue().values(), strict=True):
        parts += [head, *(_paragraph(check, entry) for check, entry in entries.items() if "." not in check)]
    return "\n".join(parts)


def _paragraph(check: str, entry: dict[str, Any]) -> str:
    stops = entry.get("stops")
    explanation = " ".join(entry["explanation"].split())
    if stops:
        explanation += " Stops." if stops is True else f" Stops {stops}."
    text, remedy = message(entry, entry["example"])
    example = ". ".join(filter(None, (text.partition(". ")[0], remedy))).replace("<", "\\<") + "."
    texts = [f"### {check}", _wrapped(f"*{example}*"), _wrapped(" ".join([explanation, entry.get("advice", "")]))]
    return "\n\n".join(texts) + "\n"


def _wrapped(text: str) -> str:
    return fill(text, 130, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    (DOCS / "findings.md").write_text(page(), encoding="utf-8")
