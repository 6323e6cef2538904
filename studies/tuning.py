"""How the estimator was tuned: a component is switched off, and accuracy is compared.

    STRIBECK_REAL_LOGS=DATA_FOLDER python -m studies.tuning --save studies/tuning.json

Components are switched off one at a time, from outside: a function of the estimator is replaced by one that does
without. The remaining estimator runs on cases of the accuracy study and on harder conditions
(`studies.harder_cases`), and on logs of real robots, where the error of torques is compared that no fit has seen
(`studies.held_out`).

The table has, per component: how much larger errors of Coulomb friction, of the curve's shape and of the offset are
without it, mean over joints, in the median and the worst of the cases; by how many points fewer of the 95 % intervals
of parameters that are not weak cover the true value, of all and in the worst case; how much larger the held-out torque
error of real robots is; and how much time it takes. Rows of components that are gone from the code stay as measured.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np

from stribeck import Robot, Settings, identify, read_log
from stribeck.base.typing import Array
from stribeck.whole_log import estimate
from stribeck.whole_log.equations import filters
from stribeck.whole_log.equations.filters import JointAcceleration
from stribeck.whole_log.noise import update, variance_components, whitening
from stribeck.whole_log.noise.variance_components import AWAY, VarianceComponents
from stribeck.whole_log.solver import empirical_bayes, pilot_fit
from stribeck.whole_log.uncertainty.heterogeneity import heterogeneity
from stribeck.whole_log.weak_equations import WeakEquations
from studies.accuracy import CURVE_FIT, MEASURES, SETTINGS, coverage, measure
from studies.accuracy_cases import CASES, LAW
from studies.command import Row, command, real_robot, rounded
from studies.harder_cases import CONDITIONS
from studies.held_out import BANDS, parts_of, slowest_speeds, torque_errors
from studies.markdown import markdown_table

FULL, HELD_OUT = "full", "held out"
FULL_SETTINGS = Settings(law=LAW, method="whole-log", corrections="calibration")
FEWEST = 20
"""Smallest number of intervals of a case whose coverage is compared."""
PLACES = (
    *CONDITIONS,
    *("A, wrong model", "B, wrong model", "A", "B", "A, wrong model and calibration"),
    *(name for name, case in CASES.items() if case.differing),
)
"""Cases of the simulated robots."""
Substitute = tuple[ModuleType | type, str, Callable[..., Any]]
"""Where a function is looked up, its name, and its stand-in."""

between_groups, components_at = whitening._between_groups, VarianceComponents.at
update_components = update.update_components


def joints_apart(fades: Array, rows: int) -> Array:
    """Make errors of different joints independent."""
    lags = len(fades) - 1
    return between_groups(fades, rows) * np.tile(np.eye(rows), (lags, lags))


def windows_apart(fades: Array, rows: int) -> Array:
    """Make errors of different windows independent."""
    return between_groups(fades * (np.arange(len(fades)) == 0), rows)


def swinging_only(self: VarianceComponents, equations: WeakEquations) -> Array:
    """Make the errors of standing legs so large that they are ignored."""
    found = components_at(self, equations)
    found[:, : len(equations.standing)][:, equations.standing] = 1e3  # N m
    return found


def always_away(equations: WeakEquations) -> Any:
    """Put every window far from any contact change."""
    return np.full(len(equations.time), AWAY)


def encoders_alone(before: VarianceComponents, residual: Any) -> VarianceComponents:
    """Take accelerations to be as good as their encoders."""
    return replace(update_components(before, residual), encoder_scale=np.ones_like(before.encoder_scale))


def plain_acceleration(_: Any, noise: Array, __: Any, ___: Any, window: Any, kernel: Array) -> JointAcceleration:
    """Use one window for all joints, as short as the velocities'."""
    return JointAcceleration(np.tile(np.convolve(window.taps, kernel), (len(noise), 1)), window)


COMPONENTS: dict[str, tuple[Substitute, ...]] = {
    FULL: (),
    CURVE_FIT: (),
    "contact scale": ((variance_components, "bin_of", always_away), (update, "bin_of", always_away)),
    "encoder scale": ((pilot_fit, "update_components", encoders_alone),),
    "covariance between joints": ((whitening, "_between_groups", joints_apart),),
    "covariance over time": ((whitening, "_between_groups", windows_apart),),
    "standing leg": ((VarianceComponents, "at", swinging_only),),
    "variance components": ((pilot_fit, "update_components", lambda before, _: before),),
    "learned prior of the model": ((empirical_bayes, "_learn_prior_std", lambda model, _: model),),
    "group prior": (
        (
            empirical_bayes,
            "learn_group_prior",
            lambda curves, found: replace(curves, group_prior=np.full((2, found.internal.shape[1]), np.nan)),
        ),
    ),
    "joint acceleration windows": ((filters, "joint_acceleration", plain_acceleration),),
    "overdispersion": ((estimate, "heterogeneity", lambda *given: (1.0, heterogeneity(*given)[1])),),
    "heterogeneity of a joint": (
        (estimate, "heterogeneity", lambda *given: (heterogeneity(*given)[0], np.ones_like(heterogeneity(*given)[1]))),
    ),
    "random effects": (
        (
            estimate,
            "random_effect_covariance",
            lambda _, __, curves, ___, found, turns: (
                np.zeros(len(curves.top_speed) + len(turns)),
                np.zeros_like(found.covariance),
            ),
        ),
    ),
    "covariance of group means": (
        (estimate, "group_mean_covariance", lambda _, found: np.zeros_like(found.covariance)),
    ),
    "multistart": tuple(
        (place, "with_other_starts", lambda _, __, ___, found: found) for place in (estimate, empirical_bayes)
    ),
}
"""By name, in the order of the table; "full" is the whole estimator, "curve-fit" another one."""


@contextmanager
def without(component: str) -> Iterator[None]:
    """Switch a component off."""
    with ExitStack() as off:
        for place, name, stand_in in COMPONENTS[component]:
            off.enter_context(patch.object(place, name, stand_in))
        yield


def runs() -> Iterator[Row]:
    """Yield the keys of all runs."""
    for case in PLACES:
        for robot in ("TORO-like", "G1"):
            yield from ({"robot": robot, "case": case, "method": name, "seed": 0} for name in COMPONENTS)
    for robot in BANDS:
        yield from ({"robot": robot, "case": HELD_OUT, "method": name, "seed": 0} for name in COMPONENTS)


def run(robot: str, case: str, method: str, seed: int) -> Row:
    """Compare the estimator without a component with the ground truth, or with torques that it has not seen."""
    with without(method):
        if case == HELD_OUT:
            return {"errors": held_out(robot, method)}
        settings = SETTINGS[CURVE_FIT] if method == CURVE_FIT else FULL_SETTINGS
        return measure(robot, case, seed, partial(identify, settings=settings))


def held_out(name: str, component: str) -> dict[str, float]:
    """Compute the held-out torque error of each joint of a real robot, root mean square [N m]."""
    folder = real_robot(name)
    robot = Robot.from_file(folder / ("curve-fit.toml" if component == CURVE_FIT else "robot.toml"))
    parts = parts_of([read_log(path, robot) for path in sorted(folder.glob("log*.npz"))])
    slowest, errors = slowest_speeds(parts), []
    for part in parts:
        result = identify([other for other in parts if other is not part], robot)
        errors.append(torque_errors(part, robot, result, BANDS[name], slowest))
    columns = zip(robot.joint_names, (np.concatenate(errors) ** 2).T, strict=True)
    return {joint: rounded(float(np.sqrt(np.nanmean(x))), 4) for joint, x in columns if not np.isnan(x).all()}


RATIOS: dict[str, Callable[[Row], float]] = {
    "Coulomb": lambda row: float(np.mean(MEASURES["coulomb"](row))),
    "worst joint": lambda row: float(np.max(MEASURES["coulomb"](row))),
    "shape": lambda row: float(np.mean(MEASURES["shape"](row))),
    "offset": lambda row: float(np.mean(MEASURES["offset"](row))),
}
HEAD = ("without", "cases", *RATIOS, "coverage", "worst case", *BANDS, "time")


def tables(rows: list[Row]) -> list[str]:
    """Format the table: a row per component that has runs."""
    full = {(row["robot"], row["case"], row["seed"]): row for row in rows if row["method"] == FULL}
    cells = []
    for name in dict.fromkeys([*COMPONENTS, *(row["method"] for row in rows)]):
        own = [row for row in rows if row["method"] == name]
        both = [(row, whole) for row in own if (whole := full.get((row["robot"], row["case"], row["seed"])))]
        if any(row["case"] != HELD_OUT for row, _ in both):
            cells.append([name, *_cells(both)])
    return [markdown_table(HEAD, cells)]


def _cells(both: list[tuple[Row, Row]]) -> list[str]:
    pairs = [pair for pair in both if pair[0]["case"] != HELD_OUT]
    cells = [str(len(pairs))]
    for measured in RATIOS.values():
        ratios = [measured(row) / measured(whole) for row, whole in pairs]
        cells.append(f"{np.median(ratios):.2f} / {max(ratios):.2f} ({_named(pairs[int(np.argmax(ratios))][0])})")
    lost = [100 * (coverage([row]) - coverage([whole])) if _many(row, whole) else np.nan for row, whole in pairs]
    share, of_full = (100 * coverage(each) for each in zip(*pairs, strict=True))
    worst = int(np.nanargmin(lost)) if np.isfinite(lost).any() else 0
    cells += [f"{share:.1f} % ({share - of_full:+.1f})", f"{lost[worst]:+.0f} ({_named(pairs[worst][0])})"]
    held = {row["robot"]: (row["errors"], whole["errors"]) for row, whole in both if row["case"] == HELD_OUT}
    cells += [_ratio(*held[robot]) if robot in held else "" for robot in BANDS]
    return [*cells, f"{np.median([row['seconds'] / whole['seconds'] for row, whole in pairs]):.2f}"]


def _many(*rows: Row) -> bool:
    """Check that enough parameters of each run are not weak for a coverage to mean anything."""
    return all(sum(1 - weak for each in row["weak"].values() for weak in each) >= FEWEST for row in rows)


def _named(row: Row) -> str:
    return f"{row['robot']}, {row['case']}"


def _ratio(found: dict[str, float], full: dict[str, float]) -> str:
    """Format how much larger held-out errors are, geometric mean over the joints."""
    joints = found.keys() & full.keys()
    return f"{np.exp(np.mean([np.log(found[joint] / full[joint]) for joint in joints])):.3f}" if joints else "none left"


if __name__ == "__main__":
    command(__doc__, runs(), run, tables)
