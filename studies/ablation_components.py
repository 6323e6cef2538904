"""The joint estimator's components, each with what stands in for a function of the estimator where it is left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from stribeck.equations import build
from stribeck.equations.calm import CalmAcceleration
from stribeck.equations.window import Window
from stribeck.identification.whole_log import believed, errors, estimate, levels, listening, whitening
from stribeck.identification.whole_log.curves import Curves
from stribeck.identification.whole_log.disagreement import disagreement
from stribeck.identification.whole_log.levels import CALM, ErrorLevels
from stribeck.identification.whole_log.model import ModelCorrections
from stribeck.identification.whole_log.solve import Solution
from stribeck.identification.whole_log.statistic import Statistic
from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations

UNKNOWN = 1e3
"""Standard deviation of what is as good as not looked at [N m]."""

Substitute = tuple[ModuleType | type, str, Callable[..., Any]]
"""Where a function is looked up, its name, and what stands in for it."""

between_groups, response_levels, update_levels = whitening._between_groups, ErrorLevels.at, errors.update_levels
"""As they are, for what stands in for them to begin with."""


def always_calm(equations: WeakEquations) -> NDArray[np.int64]:
    """Return that every window is far from any contact change."""
    return np.full(len(equations.time), CALM)


def no_shake(before: ErrorLevels, left_over: Any) -> ErrorLevels:
    """Return measured levels, accelerations being as good as their encoders."""
    return replace(update_levels(before, left_over), shake=np.ones_like(before.shake))


def joints_apart(fades: Array, rows: int) -> Array:
    """Return the factors between windows as if errors of different joints were independent."""
    lags = len(fades) - 1
    return between_groups(fades, rows) * np.tile(np.eye(rows), (lags, lags))


def windows_apart(fades: Array, rows: int) -> Array:
    """Return the factors between windows as if errors of different windows were independent."""
    return between_groups(fades * (np.arange(len(fades)) == 0), rows)


def swinging_only(self: ErrorLevels, equations: WeakEquations) -> Array:
    """Return levels under which a standing leg says nothing."""
    found = response_levels(self, equations)
    found[:, : len(equations.standing)][:, equations.standing] = UNKNOWN
    return found


def as_before(before: ErrorLevels, _: Any) -> ErrorLevels:
    """Return the levels that were there before the log was heard."""
    return before


def usual_spread(model: ModelCorrections, _: Solution) -> ModelCorrections:
    """Return the model as wrong as models usually are."""
    return model


def not_alike(curves: Curves, solution: Solution) -> Curves:
    """Return curves of joints that have nothing in common."""
    return replace(curves, alike=np.full((2, solution.internal.shape[1]), np.nan))


def plain_acceleration(_: Array, noise: Array, __: Any, ___: float, window: Window, kernel: Array) -> CalmAcceleration:
    """Return one window for all joints, as short as the velocities'."""
    return CalmAcceleration(np.tile(np.convolve(window.taps, kernel), (len(noise), 1)), window)


def no_doubt(*given: Any) -> tuple[float, Array]:
    """Return that the parts agree about the model."""
    return 1.0, disagreement(*given)[1]


def joints_agree(*given: Any) -> tuple[float, Array]:
    """Return that the parts agree about every joint's friction."""
    of_model, of_friction = disagreement(*given)
    return of_model, np.ones_like(of_friction)


def nothing_repeated(
    _: Statistic, __: int, curves: Curves, ___: ModelCorrections, solution: Solution, rocking: Array
) -> tuple[Array, Array]:
    """Return that no error comes back with every step."""
    return np.zeros(len(curves.top_speed) + len(rocking)), solution.covariance


def known_for_certain(_: Curves, solution: Solution) -> Array:
    """Return that what joints have in common adds nothing."""
    return np.zeros_like(solution.covariance)


COMPONENTS: dict[str, Sequence[Substitute]] = {
    "full": (),
    "bins of unrest": ((levels, "bin_of", always_calm), (errors, "bin_of", always_calm)),
    "shake": ((listening, "update_levels", no_shake),),
    "curve-fit": (),
    "bar": (),
    "covariance between joints": ((whitening, "_between_groups", joints_apart),),
    "covariance over time": ((whitening, "_between_groups", windows_apart),),
    "standing leg": ((ErrorLevels, "at", swinging_only),),
    "measured levels": ((listening, "update_levels", as_before),),
    "learned spread of the model": ((believed, "_learn_spread", usual_spread),),
    "joints that are alike": ((believed, "_learn_alike", not_alike),),
    "calm accelerations": ((build, "calm_acceleration", plain_acceleration),),
    "doubt of the model": ((estimate, "disagreement", no_doubt),),
    "doubt of a joint": ((estimate, "disagreement", joints_agree),),
    "repeated errors": ((estimate, "spread_of_repeated", nothing_repeated),),
    "uncertainty of what is common": ((estimate, "by_what_is_common", known_for_certain),),
}
"""By name, in the order of the table; "full" is the whole estimator; "curve-fit" and "bar" are others."""


@contextmanager
def without(component: str) -> Iterator[None]:
    """Switch a component off."""
    with ExitStack() as off:
        for place, name, stand_in in COMPONENTS.get(component, ()):
            off.enter_context(patch.object(place, name, stand_in))
        yield
