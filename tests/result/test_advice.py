"""What a user is told to do about a joint."""

from dataclasses import replace

import pytest

from stribeck.identification.judgement.verdict import NOT_FITTED
from stribeck.result import CurvePoint, JointResult, ParameterEstimate, Validation
from stribeck.result.tables import advice, point_text, rounded


def point(velocity: float, value: float, half: float) -> CurvePoint:
    return CurvePoint(
        velocity=velocity,
        value=value,
        standard_error=half / 2,
        interval_95=(max(value - half, 0.0), value + half),
        unit="N m",
    )


SURE = ParameterEstimate(value=1.0, standard_error=0.1, interval_95=(0.8, 1.2), unit="N m", verdict="identified")
JOINT = JointResult(
    parameters={"coulomb": SURE},
    verdict="identified",
    reason="",
    samples=100,
    velocity_range=(-1.0, 1.0),
    reversals=9,
    curve=(point(0.1, 1.0, 0.1), point(0.5, 1.0, 0.1), point(1.0, 1.0, 0.1)),
)


def test_an_identified_joint_is_used_by_its_curve_if_parameters_are_open() -> None:
    assert advice(JOINT) == "use it"
    assert advice(replace(JOINT, parameters={"slope": replace(SURE, verdict="weak")})) == "use its curve"


def test_a_weak_joint_is_logged_where_its_curve_is_least_known() -> None:
    curve = (point(0.1, 1.0, 0.1), point(0.5, 1.0, 0.6), point(1.0, 2.0, 0.7))
    assert advice(replace(JOINT, verdict="weak", curve=curve)) == "log more motion near 0.5 rad/s"


def test_a_weak_joint_whose_law_explains_nothing_has_something_wrong() -> None:
    nothing = Validation(rms=1.0, rms_zero_friction=1.0, rms_coulomb_only=1.0)
    assert advice(replace(JOINT, verdict="weak", validation=nothing)) == "check the model, signs and delays"
    flat = (point(0.1, 0.0, 0.1), point(0.5, 0.0, 0.1), point(1.0, 0.0, 0.1))
    assert advice(replace(JOINT, verdict="weak", curve=flat)) == "check its torque; log it longer"


def test_a_joint_that_the_method_could_not_use_is_moved_longer() -> None:
    silent = replace(JOINT, verdict="not excited", reason=NOT_FITTED)
    assert advice(silent) == "move it longer between contact changes"
    assert advice(replace(silent, reason="?")).startswith("move it ")


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        (1.1832, 0.0058, ("1.183", "0.006")),
        (1.160, 0.011, ("1.160", "0.011")),
        (0.6, 0.22, ("0.6", "0.2")),
        (28.3, 0.39, ("28.3", "0.4")),
        (47.4, 1e-4, ("47.40", "0.01")),
        (-0.0001, 0.3, ("0.0", "0.3")),
        (1234.0, 56.0, ("1234", "56")),
    ],
)
def test_values_have_the_digits_that_their_errors_leave(value: float, error: float, expected: tuple[str, str]) -> None:
    assert rounded(value, error) == expected


def test_friction_that_may_be_none_is_said_as_a_bound() -> None:
    assert point_text(point(0.1, 0.2, 0.3)) == "< 0.5"
    assert point_text(point(0.1, 2.0, 0.3)) == "2.0 ± 0.3"
