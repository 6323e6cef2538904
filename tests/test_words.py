"""The package speaks the language of its field: words that it once had of its own stay out of code and documentation.

The right ones are in docs/glossary.md.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILES = [path for kind in ("src/**/*.py", "src/**/*.j2", "docs/**/*.md") for path in sorted(ROOT.glob(kind))]

RETIRED = {
    r"listen\w*|heard": "read, use; pilot",
    r"error levels?": "variance components",
    r"unrest": "contact variance scale",
    r"shak(e|es|en|ing)": "encoder-noise scale",
    r"fading": "autocorrelation",
    r"def driving|driving\(": "innovations",
    r"(?-i:Statistic)": "normal equations",
    r"narrowing": "basis",
    r"un?believ\w*|believ\w*|beliefs?": "prior, empirical Bayes",
    r"joints (\w+ ){0,3}(are|be|is) alike|(how|learn) alike|self\.alike|alike\s*[:=]": "group prior",
    r"(un)?doubt(s|ed)?": "overdispersion",
    r"disagreements?": "heterogeneity over folds",
    r"repeated columns|spread of repeated": "gait-phase random effects",
    r"suspects?": "misfits",
    r"lacks? of fit|lack warnings": "misfits",
    r"surpris(e|es|ing)": "-log10 p",
    r"restarts": "other starts",
    r"\.settled|(?-i:settled)\s*[:=]|log has settled": "converged; determined",
    r"bends?": "loss scale; shape of the curve",
    r"lazily": "equation sequence",
    r"calm\w*": "joint acceleration; of a support phase: steady",
    r"climb(s|ed|ing)?": "stepwise selection",
    r"tell(s|ing)? from zero|told from (zero|nothing)": "significant",
    r"told of": "flagged",
    r"what (the|a|its) (law|fit|solution) leaves|(left|leaves) over": "residual",
    r"(hold|holds|holding|held) the truth": "cover; coverage",
    r"feeds? (\w+ )?(energy|power) in|feed (energy|power) in": "violates passivity",
    r"(came|comes|come) to (no|its) end": "did not converge; converged",
    r"gives? or takes?": "+-",
    r"stretch(es)?": "segment, close-up, part",
}
"""Pattern -> what to say instead. Identifiers count as their words: `ErrorLevels`, `error_levels` as "error levels"."""

PLAIN_ENGLISH = {
    r"lazily": r"(loaded|imported) lazily|lazily (loaded|imported)",
    r"believ": r"simulation",
    r"bend": r"bristle|teeth|elbow|chapter3\.bend",
    r"settled": r"simulation",
    r"feed": r"docs/paper",
    r"disagreement": r"`disagreement`|disagreement: float|disagreement=|errors\.disagreement",  # a key of result.json
    r"stretch": r"simulation|docs/paper",
}
"""Part of a finding -> what its path or line has where the word is meant as everybody, or the paper, means it."""


def words(text: str) -> str:
    """Return a text with identifiers taken apart, line by line the same."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).replace("_", " ")


def findings(text: str, path: str = "") -> list[tuple[int, str, str]]:
    """Return line, words and what to say instead, wherever a text has a retired word."""
    text, found = words(text), []
    lines = text.splitlines()
    for pattern, say in RETIRED.items():
        spaced = pattern.replace(" ", r"""[\s"'#*>]+(?:f["'])?""")  # a phrase may go on in the next line
        for match in re.finditer(rf"(?<!\w)(?:{spaced})(?!\w)", text, re.IGNORECASE):
            number = text.count("\n", 0, match.start())
            place = f"{path}: {lines[number]}"
            if not any(key in match[0].lower() and re.search(why, place) for key, why in PLAIN_ENGLISH.items()):
                found.append((number + 1, " ".join(match[0].split()), say))
    return sorted(found)


def test_words_are_those_of_the_field() -> None:
    names = {str(path.relative_to(ROOT)): path for path in FILES}
    found = [(name, *each) for name, path in names.items() for each in findings(path.read_text(), name)]
    assert found == []
