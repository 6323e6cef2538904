"""Time and memory of `stribeck trends` on a store of 100,000 logs with 29 joints.

    python -m benchmarks.trends

The store is synthetic and compacted: 500 robots with 200 logs each, and curves at four speeds per joint. The ratio is
relative to reading its curves once with DuckDB.
"""

import resource
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path

from tests.fleet.synthetic import write_store

from stribeck.fleet import connect, find_trends


def main() -> None:
    """Print the figures."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=500)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        write_store(Path(folder), robots=options.robots, logs=200, joints=29)
        before = time.perf_counter()
        with connect(folder) as connection:
            connection.execute("SELECT joint, velocity, avg(friction) FROM curves GROUP BY ALL").fetchall()
        floor, before = time.perf_counter() - before, time.perf_counter()
        found = find_trends(folder)
        seconds = time.perf_counter() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{len(found.fleet.log):,} logs: {seconds:.1f} s, {seconds / floor:.1f} times reading, {peak:.2f} GB")


if __name__ == "__main__":
    main()
