"""What to act on: findings with the lines that mend them, then the other warnings."""

import re

from stribeck.finding import Finding
from stribeck.report.page import Section, render
from stribeck.result import Result


def warnings(result: Result) -> Section | None:
    """Return the section with findings, then warnings that are no finding, or None without any."""
    findings, texts = parted(result)
    if not findings and not texts:
        return None
    body = render("warnings.html.j2", findings=findings, warnings=texts)
    return Section(anchor="warnings", title="Warnings", body=body)


def parted(result: Result) -> tuple[list[Finding], list[str]]:
    """Return the findings, the gravest first (they make every number wrong, or friction), and the other warnings."""
    said = {str(finding) for finding in result.findings}
    findings = sorted(result.findings, key=lambda finding: (not finding.stops, not finding.on_friction))
    return findings, list(dict.fromkeys(text for text in result.warnings if text not in said))


def flagged_joints(result: Result) -> set[str]:
    """Return the joints that a finding is about, or a warning names."""
    named = set(re.findall(r"[^\s,;:()]+", " ".join(result.warnings)))
    return {
        name for name in result.all_friction if name in named or any(name in each.joints for each in result.findings)
    }
