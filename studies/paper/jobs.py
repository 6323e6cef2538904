"""Tasks that worker processes import: make a walk, run a study."""

import json

from studies.paper import figures, walks
from studies.paper.study import NUMBERS, ROOT, find_studies, plain

QUICK = ROOT / "build" / "quick"
"""Folder that quick runs write to."""


def run_study(name: str, quick: bool) -> None:
    """Run a study and write its numbers and figures; a quick run writes to build/."""
    study = find_studies()[name]
    numbers = plain(study.run(quick))
    path = (QUICK if quick else NUMBERS) / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    for figure, draw in getattr(study, "drawings", lambda _: {})(numbers).items():
        figures.save(figure, draw, QUICK if quick else figures.FOLDER)


def make_walk(name: str, quick: bool) -> None:
    """Simulate a walk that is not yet available."""
    walks.get_walk(name, quick)
