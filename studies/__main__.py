"""List the saved studies with their dates, or repeat those that are not current, and update the pages that show them.

    python -m studies [run | pages] [STUDY ...]

`run` starts with the least time; after an interruption it continues where it stopped. Then it writes tables, dates and
figures into the pages, as `pages` does.
"""

import argparse
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from studies import robots, summary
from studies.command import ROOT, of_code, of_estimates, of_simulated, read
from studies.markdown import markdown_table, with_table

REAL, EVERYDAY = "STRIBECK_REAL_LOGS", "STRIBECK_EVERYDAY"
STUDIES: dict[str, tuple[float, tuple[str, ...]]] = {
    "compensation": (0.5, ()),
    "lugre": (1, ()),
    "replayed": (1.5, (REAL,)),
    "coverage": (2, ()),
    "robots": (3, (REAL,)),
    "held_out": (3, (REAL,)),
    "baselines": (4, (REAL,)),
    "plan": (10, ()),
    "misfits": (15, ()),
    "online": (15, ()),
    "legs": (17, (EVERYDAY,)),
    "walking": (18, ()),
    "first_hour": (21, ()),
    "fleet": (25, ()),
    "accuracy": (42, ()),
    "ablation": (60, (REAL, EVERYDAY)),
}
"""Processor time on one core [min], and the variables with folders of logs that are needed; `legs` shows baselines."""
SHOWING = ("README.md", "docs/**/*.md", "docs/extensions/*.py", "studies/*.md")
PAGES = sorted(page for pattern in SHOWING for page in ROOT.glob(pattern))


def path_of(study: str) -> Path:
    """Return the file of a study."""
    return ROOT / "studies" / f"{study}.json"


def state(study: str) -> str:
    """Return `current`, the number of missing runs, or `stale` if numbers may have changed since."""
    if not path_of(study).exists():
        return "missing"
    saved = read(path_of(study))
    if (left := saved["runs"] - len(saved["rows"])) > 0:
        return f"{left} runs missing"
    now = of_estimates() if REAL in STUDIES[study][1] else of_simulated()
    return "current" if saved["digest"] in (now, of_code("simulation")) else "stale"


def listed(names: Sequence[str]) -> str:
    """Format the table of some studies."""
    dates = {name: read(path_of(name))["date"] if path_of(name).exists() else "–" for name in names}
    cells = [(name, f"{STUDIES[name][0]:g}", dates[name], state(name)) for name in names]
    return markdown_table(("study", "minutes", "date", "state"), cells, right=2)


def run(names: Sequence[str]) -> None:
    """Run the studies that are not current."""
    for name in (name for name in names if state(name) != "current"):
        if missing := [variable for variable in STUDIES[name][1] if variable not in os.environ]:
            print(f"{name} is skipped: set {missing[0]} to a folder of logs", file=sys.stderr)
            continue
        command = [sys.executable, "-m", f"studies.{name}", "--save", str(path_of(name))]
        subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)


def dated(text: str, study: str, date: str) -> str:
    """Put the date of a study behind each command that prints it."""
    return re.sub(rf"(`python -m studies\.{study}`)(,\s\d{{4}}-\d\d-\d\d)?", rf"\1, {date}", text)


def write_pages() -> None:
    """Write the tables and dates of all complete studies into the pages that show them, and the figures."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for study in (study for study in STUDIES if state(study) in ("current", "stale")):
            saved = read(path_of(study))
            text = dated(text, study, saved["date"])
            for table in import_module(f"studies.{study}").tables(saved["rows"]):
                if table.split("\n", 1)[0] in text:
                    text = with_table(text, table)
        page.write_text(text, encoding="utf-8")
    robots.PAGE.write_text(robots.page(), encoding="utf-8")
    summary.main()


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("act", nargs="?", choices=("list", "run", "pages"), default="list")
    parser.add_argument("studies", nargs="*", metavar="STUDY", help="only these")
    options = parser.parse_args()
    names = [name for name in STUDIES if name in options.studies or not options.studies]
    if options.act == "run":
        run(names)
    if options.act != "list":
        write_pages()
    print(listed(names))


if __name__ == "__main__":
    main()
