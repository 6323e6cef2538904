"""Prints a benchmark's figures, saves them, and compares them with saved ones."""

import argparse
import json
from pathlib import Path


def arguments(description: str, samples: int) -> argparse.Namespace:
    """Return the options that every benchmark takes."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--samples", type=int, default=samples, help=f"length of the log, {samples} by default")
    parser.add_argument("--save", type=Path, metavar="FILE", help="save the figures as JSON")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="print the figures beside saved ones")
    return parser.parse_args()


def report(figures: dict[str, float], save: Path | None, compare: Path | None) -> None:
    """Print a line a figure, with the ratio to a saved one if there is one."""
    before = json.loads(compare.read_text()) if compare else {}
    for name, value in figures.items():
        ratio = f"   was {before[name]:.4g}, now {value / before[name]:.2f} of it" if name in before else ""
        print(f"{name:<64}{value:>10.4g}{ratio}")
    if save:
        save.write_text(json.dumps(figures, indent=2) + "\n")
