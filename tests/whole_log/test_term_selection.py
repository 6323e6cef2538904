"""Terms that a fit makes sense of are not objected to, others are."""

import numpy as np
import pytest

from stribeck.friction import get_law
from stribeck.settings import Priors
from stribeck.whole_log.model.basis import make_basis
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.varying_curves import rising, varying_curves
from stribeck.whole_log.terms.profile_likelihood import JointFold, Quadratic
from stribeck.whole_log.terms.term_selection import JointTrial

KEPT = frozenset({"viscous", "viscous_drift", "coulomb_drift"})


@pytest.mark.parametrize(
    ("changed", "negative"),
    [
        ({}, ""),
        ({"viscous_drift": -0.7}, "viscous"),
        ({"viscous_drift": 0.7}, "viscous"),
        ({"coulomb_drift": 3}, "coulomb"),
    ],
)
def test_friction_is_never_negative_within_the_log(changed: dict[str, float], negative: str) -> None:
    """It would be in a fit that takes friction which grows less than speed, as motion grows, for a drift."""
    law, speed = get_law("auto"), np.ones(1)
    plain = Curves(law, make_basis(law, speed), speed, np.ones(1), Priors())
    curves = varying_curves(plain, rising(plain.basis), "drift")
    values = {"viscous": 0.3, "coulomb": 1.2, "offset": 0.1, "viscous_drift": 0.2, "coulomb_drift": 0.5} | changed
    internal = np.nan_to_num(curves.neutral)
    for k, parameter in enumerate(curves.parameters):
        internal[k] = values.get(parameter.name, internal[k])
    coefficients = curves.coefficients(internal[None])
    shown = Quadratic(1e4 * np.eye(len(coefficients)), 1e4 * coefficients)
    objection = JointTrial(curves, shown, (JointFold(shown, shown),), 1.0).candidate(KEPT).objection
    if negative:
        assert objection == (
            "refused",
            f"{negative} friction would be negative at the beginning of the log or at its end",
        )
    else:
        assert objection is None
