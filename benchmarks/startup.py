"""Measure the startup of the command line: processor time from start to end, medians of several runs.

python -m benchmarks.startup
"""

import os
import statistics
import subprocess
import sys

from benchmarks.report import arguments, report

STARTS = {
    "python alone [s]": ["-c", ""],
    "import stribeck [s]": ["-c", "import stribeck"],
    "stribeck --version [s]": ["-m", "stribeck", "--version"],
    "stribeck --help [s]": ["-m", "stribeck", "--help"],
}


def processor_time(command: list[str]) -> float:
    """Measure user and system time of a process and its children [s]."""
    before = os.times()
    subprocess.run([sys.executable, *command], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=7)
    figures = {
        name: statistics.median(processor_time(command) for _ in range(options.samples))
        for name, command in STARTS.items()
    }
    report(figures, options.save, options.compare)


if __name__ == "__main__":
    main()
