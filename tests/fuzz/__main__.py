"""Give the command line inputs that are wrong at random, and count the outcomes; exit code 1 if one of them broke it.

`python -m tests.fuzz --seed 1 --inputs 10000` prints one line per kind of input: how many inputs had each outcome,
and the peak memory. Each input gets its own process, with 20 s of processor time and 4 GiB. It may be accepted, or
refused in one sentence with exit code 2 or 3. All other outcomes are faults: refused in another way or with an output
left behind (untidy), accepted although wrong (misread), ended with a traceback or a NumPy warning, unfinished (hang),
killed (crash). Each fault is listed with the options that repeat it. To add a kind of input, add a function to
`kinds.py` and an entry to its table.
"""

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

from tests.fuzz.attempt import OUTCOMES, attempt
from tests.fuzz.kinds import KINDS, import_all, make_seeds


def main():
    """Try inputs of every kind, in as many processes as there are cores, and print what became of them."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="of the inputs; the same one makes the same inputs")
    parser.add_argument("--inputs", type=int, default=10_000, help="of all kinds together")
    parser.add_argument("--kind", choices=KINDS, action="append", help="only this kind; may be repeated")
    parser.add_argument("--only", type=int, help="only the input of this number, of each kind")
    parser.add_argument("--keep", type=Path, help="folder in which inputs that broke something are kept")
    options = parser.parse_args()
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)

    kinds = options.kind or list(KINDS)
    total = sum(KINDS[kind].share for kind in kinds)
    numbers = {kind: range(max(1, round(options.inputs * KINDS[kind].share / total))) for kind in kinds}
    if options.only is not None:
        numbers = {kind: range(options.only, options.only + 1) for kind in kinds}
    inputs = [(kind, options.seed, number) for kind in kinds for number in numbers[kind]]

    start, fork = time.monotonic(), multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory(prefix="fuzz.") as folder:
        apart = fork.Process(target=make_seeds, args=(Path(folder),))  # this process must stay without threads
        apart.start()
        apart.join()
        if apart.exitcode:
            return 1
        import_all()
        with ProcessPoolExecutor(os.cpu_count(), mp_context=fork) as processes:
            try_one = partial(attempt, seeds=Path(folder), keep=options.keep)
            attempts = list(processes.map(try_one, *zip(*inputs, strict=True), chunksize=1))
    broken = [found for found in attempts if found.outcome not in ("accepted", "refused")]
    for found in broken:
        print(f"{found.outcome}: --seed {options.seed} --kind {found.kind} --only {found.number}: {found.said}")
    print(f"{'kind':<20}{'inputs':>8}" + "".join(f"{outcome:>11}" for outcome in OUTCOMES) + f"{'peak [MB]':>11}")
    for kind in kinds:
        own = [one for one in attempts if one.kind == kind]
        counts = [sum(one.outcome == outcome for one in own) for outcome in OUTCOMES]
        peak = max(one.memory for one in own) / 1e6
        print(f"{kind:<20}{len(own):>8}" + "".join(f"{count:>11}" for count in counts) + f"{peak:>11.0f}")
    print(f"seed {options.seed}, {len(attempts)} inputs in {time.monotonic() - start:.0f} s")
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main())
