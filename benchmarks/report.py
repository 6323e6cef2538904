"""Print a benchmark's figures, save them, and compare them with saved figures."""

import argparse
import json
from pathlib import Path


def arguments(description: str, samples: int) -> argparse.Namespace:
    """Parse the options that all benchmarks share."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--samples", type=int, default=samples, help=f"length of the log, {samples} by default")
    parser.add_argument("--save", type=Path, metavar="FILE", help="save the figures as JSON")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="print the figures beside saved ones")
    return parser.parse_args()


def report(figures: dict[str, float], options: argparse.Namespace) -> None:
    """Print one line per figure, with its ratio to the saved figure if available."""
    before = json.loads(options.compare.read_text()) if options.compare else {}
    for name, value in figures.items():
        ratio = f"   was {before[name]:.4g}, now {value / before[name]:.2f} of it" if name in before else ""
        print(f"{name:<64}{value:>10.4g}{ratio}")
    if options.save:
        options.save.write_text(json.dumps(figures, indent=2) + "\n")
