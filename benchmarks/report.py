"""Print a benchmark's figures."""

import argparse


def arguments(description: str, samples: int) -> argparse.Namespace:
    """Parse the options that all benchmarks share."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--samples", type=int, default=samples, help=f"length of the log, {samples} by default")
    return parser.parse_args()


def report(figures: dict[str, float]) -> None:
    """Print one line per figure."""
    for name, value in figures.items():
        print(f"{name:<64}{value:>10.4g}")
