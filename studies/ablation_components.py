"""The joint estimator's components, each with what stands in for a function of the estimator where it is left out."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from stribeck.equations import build
from stribeck.equations.joint_acceleration import JointAcceleration
from stribeck.equations.window import Window
from stribeck.identification.whole_log import estimate
from stribeck.identification.whole_log.model.friction_curves import Curves
from stribeck.identification.whole_log.model.model_corrections import ModelCorrections
from stribeck.identification.whole_log.noise import update, variance_components, whitening
from stribeck.identification.whole_log.noise.variance_components import AWAY, VarianceComponents
from stribeck.identification.whole_log.solver import empirical_bayes, pilot_fit
from stribeck.identification.whole_log.solver.normal_equations import NormalEquations
from stribeck.identification.whole_log.solver.solve import Solution
from stribeck.identification.whole_log.uncertainty.heterogeneity import heterogeneity
from stribeck.typing import Array
from stribeck.weak_equations import WeakEquations

UNKNOWN = 1e3
"""Standard deviation of what is as good as not looked at [N m]."""

Substitute = tuple[ModuleType | type, str, Callable[..., Any]]
"""Where a function is looked up, its name, and what stands in for it."""

between_groups, components_at = whitening._between_groups, VarianceComponents.at
update_components = update.update_components
"""As they are, for what stands in for them to begin with."""


def always_away(equations: WeakEquations) -> NDArray[np.int64]:
    """Return that every window is far from any contact change."""
    return np.full(len(equations.time), AWAY)


def encoders_alone(before: VarianceComponents, left_over: Any) -> VarianceComponents:
    """Return variance components, accelerations being as good as their encoders."""
    return replace(update_components(before, left_over), encoder_scale=np.ones_like(before.encoder_scale))


def joints_apart(fades: Array, rows: int) -> Array:
    """Return the factors between windows as if errors of different joints were independent."""
    lags = len(fades) - 1
    return between_groups(fades, rows) * np.tile(np.eye(rows), (lags, lags))


def windows_apart(fades: Array, rows: int) -> Array:
    """Return the factors between windows as if errors of different windows were independent."""
    return between_groups(fades * (np.arange(len(fades)) == 0), rows)


def swinging_only(self: VarianceComponents, equations: WeakEquations) -> Array:
    """Return variance components under which a standing leg says nothing."""
    found = components_at(self, equations)
    found[:, : len(equations.standing)][:, equations.standing] = UNKNOWN
    return found


def as_before(before: VarianceComponents, _: Any) -> VarianceComponents:
    """Return the variance components that were there before the log was heard."""
    return before


def usual_prior(model: ModelCorrections, _: Solution) -> ModelCorrections:
    """Return the model as wrong as models usually are."""
    return model


def not_alike(curves: Curves, solution: Solution) -> Curves:
    """Return curves of joints that have nothing in common."""
    return replace(curves, group_prior=np.full((2, solution.internal.shape[1]), np.nan))


def plain_acceleration(_: Array, noise: Array, __: Any, ___: float, window: Window, kernel: Array) -> JointAcceleration:
    """Return one window for all joints, as short as the velocities'."""
    return JointAcceleration(np.tile(np.convolve(window.taps, kernel), (len(noise), 1)), window)


def no_overdispersion(*given: Any) -> tuple[float, Array]:
    """Return that the parts agree about the model."""
    return 1.0, heterogeneity(*given)[1]


def joints_agree(*given: Any) -> tuple[float, Array]:
    """Return that the parts agree about every joint's friction."""
    of_model, of_friction = heterogeneity(*given)
    return of_model, np.ones_like(of_friction)


def nothing_repeated(
    _: NormalEquations, __: int, curves: Curves, ___: ModelCorrections, solution: Solution, root_turns: Array
) -> tuple[Array, Array]:
    """Return that no error comes back with every step."""
    return np.zeros(len(curves.top_speed) + len(root_turns)), np.zeros_like(solution.covariance)


def as_it_is(_: NormalEquations, __: Curves, ___: ModelCorrections, solution: Solution) -> Solution:
    """Return the solution of the first descent."""
    return solution


def known_for_certain(_: Curves, solution: Solution) -> Array:
    """Return that what joints have in common adds nothing."""
    return np.zeros_like(solution.covariance)


COMPONENTS: dict[str, Sequence[Substitute]] = {
    "full": (),
    "contact scale": ((variance_components, "bin_of", always_away), (update, "bin_of", always_away)),
    "encoder scale": ((pilot_fit, "update_components", encoders_alone),),
    "curve-fit": (),
    "bar": (),
    "default": (),
    "covariance between joints": ((whitening, "_between_groups", joints_apart),),
    "covariance over time": ((whitening, "_between_groups", windows_apart),),
    "standing leg": ((VarianceComponents, "at", swinging_only),),
    "variance components": ((pilot_fit, "update_components", as_before),),
    "learned prior of the model": ((empirical_bayes, "_learn_prior_std", usual_prior),),
    "group prior": ((empirical_bayes, "learn_group_prior", not_alike),),
    "joint acceleration windows": ((build, "joint_acceleration", plain_acceleration),),
    "overdispersion": ((estimate, "heterogeneity", no_overdispersion),),
    "heterogeneity of a joint": ((estimate, "heterogeneity", joints_agree),),
    "random effects": ((estimate, "random_effect_covariance", nothing_repeated),),
    "covariance of group means": ((estimate, "group_mean_covariance", known_for_certain),),
    "multistart": ((estimate, "with_other_starts", as_it_is), (empirical_bayes, "with_other_starts", as_it_is)),
}
"""By name, in the order of the table; "full" is the whole estimator; "curve-fit" and "bar" are others."""


@contextmanager
def without(component: str) -> Iterator[None]:
    """Switch a component off."""
    with ExitStack() as off:
        for place, name, stand_in in COMPONENTS.get(component, ()):
            off.enter_context(patch.object(place, name, stand_in))
        yield
