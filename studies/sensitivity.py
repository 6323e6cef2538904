"""What each tuned constant of the joint estimator matters: it is halved and doubled, and results are compared.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.sensitivity --save studies/sensitivity.json

One constant is changed at a time, and logs of real robots and a short simulated walk are fitted again. The table of
docs/constants.md says: the largest change of a friction parameter in standard errors, and on which log; the largest
changes of a standard error and of chi^2, as factors; and for how many joints of all logs a verdict, or the terms of
the law `auto`, change.

Runs that the file holds already are not repeated: move it away when the estimator has changed.
"""

import argparse
import ast
import json
import os
import re
import runpy
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import pairwise, product
from pathlib import Path
from types import FrameType
from typing import Any
from unittest.mock import patch

import numpy as np

from stribeck import Robot, Settings, identify
from stribeck.equations import constants as equations_constants
from stribeck.identification.whole_log import constants as whole_log_constants
from stribeck.outputs import whole_or_not_at_all
from stribeck.result import Result
from stribeck_simulation.scenario import read_scenario
from studies.accuracy_cases import CASES, measured
from studies.held_out import ROOT
from studies.kept_walks import kept_walk

MODULES = (whole_log_constants, equations_constants)
FACTORS = {"half": 0.5, "double": 2.0}
LOGS: dict[str, tuple[str, dict[str, object]]] = {
    "kinova-gen3": ("log_1.npz", {"corrections": "calibration"}),
    "double-pendulum": ("log_1.npz", {"law": "auto"}),
    "go2": ("log.npz", {}),
    "tx40": ("log.npz", {}),
}
"""Log of each real robot, and settings beside those of its robot file."""
LONGEST = 6.0
"""Of the walk that is fitted [s]."""

Fit = Callable[[], Result]
Runs = dict[str, dict[str, Any]]
"""What has changed, or the error, by "constant factor" and log."""


def constants() -> dict[str, tuple[Any, str]]:
    """Return value and units of every constant; the units stand in brackets in the first part of its docstring."""
    found = {}
    for module in MODULES:
        for line, below in pairwise(ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8")).body):
            if isinstance(line, ast.Assign) and isinstance(below, ast.Expr) and isinstance(line.targets[0], ast.Name):
                units = re.findall(r"\[(.*?)\]", ast.literal_eval(below.value).split("\n\n")[0])
                found[line.targets[0].id] = getattr(module, line.targets[0].id), ", ".join(dict.fromkeys(units))
    return found


def scaled(value: Any, factor: float) -> Any:
    """Return a constant times a factor: a count is rounded and at least one, of several values all are changed."""
    if isinstance(value, tuple):
        return tuple(scaled(each, factor) for each in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


@contextmanager
def changed(name: str, value: Any) -> Iterator[None]:
    """Give a constant another value in its own module and in every module below that package that holds it."""
    (home,) = (module for module in MODULES if name in vars(module))
    package = home.__name__.rpartition(".")[0]
    with ExitStack() as back:
        for module in [each for key, each in sys.modules.items() if key.startswith(package) and name in vars(each)]:
            back.enter_context(patch.object(module, name, value))
        yield


def observed(fit: Fit) -> tuple[Result, set[str]]:
    """Return a result, and the names in all code that ran for it: a constant that is not among them is not reached."""
    names: set[str] = set()

    def note(frame: FrameType, *_: object) -> None:
        names.update(frame.f_code.co_names)

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        return fit(), names
    finally:
        sys.setprofile(None)
        threading.setprofile(None)


def fits(folder: Path, scratch: Path, wanted: Collection[str]) -> dict[str, Fit]:
    """Return what fits each log that is wanted; `folder` holds the published logs of the real robots."""
    walk = kept_walk("sensitivity", read_scenario(ROOT / "examples/scenarios/quadruped-trot.toml"))
    seen = measured(walk.log.take(walk.log.time < walk.log.time[0] + LONGEST), CASES["A"], 0, 0)
    found: dict[str, Fit] = {
        "walk": partial(identify, [seen], walk.robot, Settings(law="stribeck", method="whole-log"))
    }
    convert = runpy.run_path(str(ROOT / "examples/real_robots/convert.py"))["convert"]
    for name, (log, own) in LOGS.items():
        robot = Robot.from_file(convert(name, folder, scratch) / "robot.toml")
        update = {"corrections": "inertia", **own}
        found[name] = partial(identify, [scratch / name / log], robot, robot.settings.model_copy(update=update))
    return {name: fit for name, fit in found.items() if name in wanted}


def compared(before: Result, after: Result) -> dict[str, Any]:
    """Return what has changed: parameters in standard errors, chi^2 as a ratio, verdicts and terms of joints."""
    pairs = [(old, after.joints[joint]) for joint, old in before.joints.items()]
    both = {
        f"{joint} {name}": (known, after.joints[joint].parameters[name])
        for joint, old in before.joints.items()
        for name, known in old.parameters.items()
        if name in after.joints[joint].parameters and known.standard_error > 0
    }
    moved = {name: abs(now.value - known.value) / known.standard_error for name, (known, now) in both.items()}
    which = max(moved, key=lambda name: moved[name], default="")
    width = farthest(now.standard_error / known.standard_error for known, now in both.values())
    assert before.corrections is not None
    assert after.corrections is not None
    return {
        "shift": float(f"{moved.get(which, 0.0):.3g}"),
        "of": which,
        "width": float(f"{width:.3g}"),
        "chi^2": float(f"{after.corrections.chi_square / before.corrections.chi_square:.3g}"),
        "verdicts": sum(old.verdict != new.verdict for old, new in pairs),
        "terms": sum(old.parameters.keys() != new.parameters.keys() for old, new in pairs),
    }


def farthest(ratios: Iterable[float]) -> float:
    """Return the ratio that is farthest from one."""
    return max(ratios, key=lambda ratio: abs(np.log(max(ratio, 1e-9))), default=1.0)


def run(fit: Fit, name: str, factor: float, before: Result) -> dict[str, Any]:
    """Return what another value of a constant changes, or the error that it ends in."""
    try:
        with changed(name, scaled(constants()[name][0], factor)):
            return compared(before, fit())
    except Exception as error:  # also NumPy's: what a value out of all reason does is a finding
        return {"error": type(error).__name__}


HEAD = "| constant | value | unit | half | double |\n|---|---|---|---|---|"


def table(runs: Runs) -> list[str]:
    """Return a row for each constant that there are runs of."""
    rows = []
    for name in dict.fromkeys(key.split()[0] for key in runs):
        of = [runs[f"{name} {factor}"] for factor in FACTORS]
        cells = [f"`{name}`", *of[0]["constant"], *map(cell, of)]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def cell(logs: dict[str, Any]) -> str:
    """Return in words what has changed on all logs."""
    if errors := [f"{found['error']} ({log})" for log, found in logs.items() if "error" in found]:
        return ", ".join(errors)
    done = {log: found for log, found in logs.items() if "shift" in found}
    if not done:
        return "not reached"
    worst = max(done, key=lambda log: done[log]["shift"])
    said = [f"{done[worst]['shift']:.2g} s.e. ({worst})"] if done[worst]["shift"] >= NOTHING else []
    for kind, words in {"width": "s.e.", "chi^2": "chi^2"}.items():
        ratio = farthest(found.get(kind, 1.0) for found in done.values())
        said += [f"{words} x{ratio:.2f}"] if abs(ratio - 1) >= NOTHING else []
    for kind in ("verdicts", "terms"):
        count = sum(found[kind] for found in done.values())
        said += [f"{kind} of {count}"] if count else []
    return ", ".join(said) or "nothing"


NOTHING = 0.005
"""Change in standard errors, of standard errors and of chi^2, that is none [1]."""


def write(path: Path, runs: Runs) -> None:
    """Write the runs, a constant's a line, whole or not at all."""
    lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(each)}" for key, each in runs.items())
    with whole_or_not_at_all(path) as temporary:
        temporary.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, required=True, help="JSON that is read at first, and written as runs end")
    parser.add_argument("--logs", nargs="+", default=["walk", *LOGS], help="only these")
    parser.add_argument("--constants", nargs="+", default=list(constants()), help="only these")
    arguments = parser.parse_args()
    path, known = arguments.save, constants()
    runs: Runs = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    warnings.simplefilter("ignore")  # NumPy's, of values out of all reason
    with tempfile.TemporaryDirectory() as scratch:
        for log, fit in fits(Path(os.environ["STRIBECK_REAL_LOGS"]), Path(scratch), arguments.logs).items():
            before, names = observed(fit)
            for name, factor in product(arguments.constants, FACTORS):
                value, unit = known[name]
                done = runs.setdefault(f"{name} {factor}", {"constant": [f"{value}", unit]})
                if name in names and log not in done:
                    done[log] = run(fit, name, FACTORS[factor], before)
                    print(log, name, factor, done[log], flush=True)
                    write(path, runs)
    print(HEAD, *table(runs), sep="\n")


if __name__ == "__main__":
    main()
