"""`python -m fuzz`: a table of what the command line did with wrong inputs; exit code 1 if one of them broke it."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy comes: a process that forks has no threads

import argparse
import multiprocessing
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from fuzz.apart import apart
from fuzz.attempt import OUTCOMES, Attempt, attempt
from fuzz.kinds import KINDS
from fuzz.runs import make_outputs
from fuzz.seeds import import_all, make_seeds


def main() -> int:
    """Try inputs of every kind, in as many processes as there are cores, and print what became of them."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="of the inputs; the same one makes the same inputs")
    parser.add_argument("--inputs", type=int, default=10_000, help="of all kinds together")
    parser.add_argument("--kind", choices=KINDS, action="append", help="this kind alone; may be repeated")
    parser.add_argument("--only", type=int, help="the input of this number alone, of each kind")
    parser.add_argument("--keep", type=Path, help="folder in which inputs that broke something are kept")
    options = parser.parse_args()

    kinds = options.kind or list(KINDS)
    total = sum(KINDS[kind].share for kind in kinds)
    numbers = {kind: range(max(1, round(options.inputs * KINDS[kind].share / total))) for kind in kinds}
    if options.only is not None:
        numbers = {kind: range(options.only, options.only + 1) for kind in kinds}
    inputs = [(kind, options.seed, number) for kind in kinds for number in numbers[kind]]

    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="fuzz.") as folder:
        fork = multiprocessing.get_context("fork")
        seeds = Path(folder)
        apart(partial(make_seeds, seeds))  # this process must have no threads, as of OpenMP
        import_all()
        apart(partial(make_outputs, seeds / "runs", seeds))
        with ProcessPoolExecutor(os.cpu_count(), mp_context=fork) as processes:
            try_one = partial(attempt, seeds=seeds, keep=options.keep)
            attempts = list(processes.map(try_one, *zip(*inputs, strict=True), chunksize=1))
    broken = [found for found in attempts if found.outcome not in ("accepted", "refused")]
    for found in broken:
        print(f"{found.outcome}: --seed {options.seed} --kind {found.kind} --only {found.number}: {found.said}")
    _print_table(attempts, kinds)
    for kind in kinds:
        accepted = [found for found in attempts if found.kind == kind and found.outcome == "accepted"]
        other = sum(found.differs for found in accepted)
        if other:
            print(f"of {len(accepted)} {kind} that were accepted, {other} had other samples than were written")
    print(f"seed {options.seed}, {len(attempts)} inputs in {time.monotonic() - start:.0f} s")
    return bool(broken)


def _print_table(attempts: list[Attempt], kinds: list[str]) -> None:
    print(f"{'kind':<20}{'inputs':>8}" + "".join(f"{outcome:>11}" for outcome in OUTCOMES) + f"{'peak [MB]':>11}")
    for kind in kinds:
        found = [one for one in attempts if one.kind == kind]
        counts = [sum(one.outcome == outcome for one in found) for outcome in OUTCOMES]
        peak = max(one.memory for one in found) / 1e6
        print(f"{kind:<20}{len(found):>8}" + "".join(f"{count:>11}" for count in counts) + f"{peak:>11.0f}")


if __name__ == "__main__":
    sys.exit(main())
