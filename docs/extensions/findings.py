"""Write docs/findings.md from the catalogue: `python docs/extensions/findings.py`."""

from pathlib import Path
from textwrap import fill
from typing import Any

from stribeck.base.finding import catalogue, message

PAGE = Path(__file__).parents[1] / "findings.md"

HEAD = """# Findings

Look up a finding here when `inspect`, `identify` or the report shows one. The headings are the names of the checks.
Each section quotes an example with its remedy and explains the check.

In simulation, the audit detects all 61 faults of 34 kinds, and no log without a fault has a finding
(`python -m studies.faults --save studies/faults.json`). Checks after the fit report 22 of 56 causes, with five false
findings in 794 cases (`python -m studies.misfits --save studies/misfits.json`).

*Generated from `src/stribeck/base/findings.toml`.*
"""

INTRODUCTIONS = {
    "before": """## Before the fit

`identify` and `inspect` audit each log: first channels, then orientation and contacts, then torques versus the model.
A fault hides the checks that depend on it. Joints that carry little load, and short logs, get few findings. A finding
that would make every number wrong *stops* `identify` (exit code 2). With `--force` it continues, and the finding
becomes part of the result.
""",
    "after": """## After the fit

A fit may converge although the law does not describe the friction, or although another effect looks like friction.
Effects that move the friction curve by less than its interval are not reported.
""",
}


def page() -> str:
    """Format the whole page."""
    parts = [HEAD]
    for section, entries in catalogue().items():
        parts.append(INTRODUCTIONS[section])
        for check, entry in entries.items():
            if "." not in check:
                variants = [other for name, other in entries.items() if name.startswith(f"{check}.")]
                parts.append(_paragraph(check, [entry, *variants]))
    return "\n".join(parts)


def _paragraph(check: str, entries: list[dict[str, Any]]) -> str:
    entry, stops = entries[0], entries[0].get("stops")
    explanation = " ".join(entry["explanation"].split())
    if stops:
        explanation += " Stops." if stops is True else f" Stops {stops}."
    examples = [". ".join(filter(None, message(each, each["example"]))) for each in entries if "example" in each]
    quoted = [
        fill(text.replace("<", "\\<") + ".", 128, initial_indent="> ", subsequent_indent="> ", break_on_hyphens=False)
        for text in examples
    ]
    texts = [f"### {check}", *quoted, _wrapped(" ".join([explanation, entry.get("advice", "")]))]
    return "\n\n".join(texts) + "\n"


def _wrapped(text: str) -> str:
    return fill(text, 130, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
