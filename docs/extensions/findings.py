"""Write docs/findings.md from the catalogue: `python docs/extensions/findings.py`."""

from pathlib import Path
from textwrap import fill
from typing import Any

from stribeck.base.finding import catalogue, message

PAGE = Path(__file__).parents[1] / "findings.md"

HEAD = """# Findings

A finding is a problem in a log, a robot file or a fit. `Result.findings` contains the name of its check, the message,
the affected joints and a remedy. `Result.warnings`, the console and the report show each finding in one line. The
headings below are the names of the checks. This page is generated from `src/stribeck/base/findings.toml`.

In simulation, the audit detects all 61 faults of 34 kinds, and no log without a fault has a finding
(`python -m studies.faults --save studies/faults.json`). Checks after the fit report half of the causes, with one false
finding in 794 cases (`python -m studies.misfits --save studies/misfits.json`).
"""

INTRODUCTIONS = {
    "before": """## Before the fit

`identify` audits every log before the fit, and `inspect` shows the same findings. The audit first checks single
channels, then orientation, contacts and kinematics against one another, then the torques against the model's. Each
joint's torque is regressed on the model's torque and shapes of friction. A finding requires a model torque that
varies much more than friction and noise. A joint that carries little, or a log of one second, therefore gets few of
these findings. A fault that makes the model's torque wrong hides the checks that depend on it: with exchanged feet or
frozen positions, torques give no information. A finding that makes every number wrong *stops* `identify` (exit code
2). With `--force` it goes on, and the finding becomes part of the result. The audit compares at most 30,000 samples
with the model, in evenly spaced parts of the log.
""",
    "after": """## After the fit

A fit may converge and still mean little, because its law does not describe the friction, or because another effect is
taken for friction. Each of these findings was tested on logs with its cause and on logs with another cause. An effect
that moves the friction curve by less than its interval is not reported.
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
    examples = ["; ".join(filter(None, message(each, each["example"]))) for each in entries if "example" in each]
    quoted = [
        fill(text.replace("<", "\\<"), 128, initial_indent="> ", subsequent_indent="> ", break_on_hyphens=False)
        for text in examples
    ]
    texts = [f"### {check}", _wrapped(explanation), *quoted, _wrapped(f"Remedy: {entry['advice']}")]
    return "\n\n".join(texts) + "\n"


def _wrapped(text: str) -> str:
    return fill(text, 130, break_long_words=False, break_on_hyphens=False)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
