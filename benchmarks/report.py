"""Print a benchmark's figures."""


def report(figures: dict[str, float]) -> None:
    """Print one line per figure."""
    for name, value in figures.items():
        print(f"{name:<64}{value:>10.4g}")
