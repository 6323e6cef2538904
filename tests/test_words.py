"""The project is written in plain English: wordings that came back most often stay out of code and documentation."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILES = [path for kind in ("src/**/*.py", "src/**/*.j2", "docs/**/*.md") for path in sorted(ROOT.glob(kind))]

RELAPSES = {
    r"\w+ alone[.,;)]": "only, before the word that it limits",
    r"heed\w*|mend(s|ed|ing)?": "use, fix",
    r"told (from|apart|of)": "distinguished, reported",
    r"listen\w*|heard|un?believ\w*|unrest|lack of fit": "read, prior, misfit",
    r"tells? from zero|(hold|holds|holding|held) the truth": "significant; cover",
    r"(came|comes|come) to (no|its) end": "did not converge; converged",
    r"feeds? (energy|power) in": "violates passivity",
    r"of (its|their) own": "a separate ..., its ...",
    r"Return (what|whose|who)": "say what the function does",
    r"(line|file|row|column|parameter|value)s? a (joint|log|foot|turn|second)": "per",
    r"next to nothing|to and fro|worked out|put down to": "almost zero; back and forth; computed; attributed to",
    r"what (was|is) (found|left)|nothing that is|none that": "result, residual: use a noun",
}
"""Pattern -> what to write instead."""


def findings(text: str) -> list[tuple[int, str, str]]:
    """Find line, words and what to write instead, wherever a text has one of the wordings."""
    found = []
    for pattern, instead in RELAPSES.items():
        spaced = pattern.replace(" ", r"\s+(?:#\s+)?")  # a phrase may continue in the next line
        for match in re.finditer(rf"(?<![\w-])(?:{spaced})(?!\w)", text):
            found.append((text.count("\n", 0, match.start()) + 1, " ".join(match[0].split()), instead))
    return sorted(found)


def test_wordings_stay_plain() -> None:
    found = {str(path.relative_to(ROOT)): hits for path in FILES if (hits := findings(path.read_text()))}
    assert found == {}


def test_the_wordings_are_found() -> None:
    hits = [words for _, words, _ in findings("a file\n    of its own; Return what is left, one line a joint")]
    assert hits == ["Return what", "line a joint", "of its own", "what is left"]
