"""Exact logs at 1 kHz give all six parameters of the law (3.5), for every joint and kind of robot."""

from dataclasses import replace

import numpy as np
import pytest
from tests.models import STRIBECK, example_log, example_robot

from stribeck import Settings, identify
from stribeck.core.base.typing import Array
from stribeck.core.friction import Parameter, Stribeck, get_law
from stribeck.core.settings import FilterSettings
from stribeck.simulation.prescribed.exact import exact_log

CASES = {
    "fixed-base arm": ("ur5", 24.0, "walk"),
    "humanoid": ("talos", 14.0, "walk"),
    "quadruped, one leg at a time": ("go2", 32.0, "walk"),
    "quadruped, trot": ("go2", 10.0, "trot"),
}


QUICK = {("fixed-base arm", "log"), ("fixed-base arm", "auto"), ("fixed-base arm", "observer"), ("humanoid", "log")}
RUNS = [*((name, kind) for name in CASES for kind in ("log", "auto")), ("fixed-base arm", "observer")]
"""Robots with filters of the curve fit, or the observer without measured accelerations."""


@pytest.mark.parametrize(
    ("name", "kind"), [pytest.param(*own, marks=[pytest.mark.long] * (own not in QUICK)) for own in RUNS]
)
def test_every_parameter_of_every_joint_comes_back(name: str, kind: str) -> None:
    robot, (log, truth) = example_robot(CASES[name][0]), example_log(*CASES[name], seed=3)
    settings = Settings(method="curve-fit", filter=FilterSettings(kind="auto" if kind == "auto" else "log"))
    if kind == "observer":
        log = replace(log, acceleration=None)
        settings = settings.model_copy(update={"law": "stribeck", "method": kind, "observer_bandwidth": 40.0})
    result = identify(log, robot, settings)
    assert result.joints.keys() == truth.parameters.keys()
    for name, joint in result.joints.items():
        assert joint.verdict == "identified", f"{name}: {joint.reason}"
        for parameter, value in STRIBECK.items():
            assert joint.parameters[parameter].value == pytest.approx(value, rel=1e-3 if kind == "log" else 1e-2), name


class Drag(Stribeck):
    """Law outside the family: arctangent instead of the sign, square-root growth, and drag quadratic in the speed."""

    name, title = "drag", "Drag"
    parameters = (Parameter(name="level", symbol="F", unit="N m"),)

    def torque(self, velocity: Array, values: Array) -> Array:
        growth = 1 + 0.3 * np.sqrt(np.abs(velocity)) + 0.05 * velocity**2
        return np.asarray(values[0] * 2 / np.pi * np.arctan(50 * velocity) * growth)


def test_a_law_outside_the_family_is_found_sample_by_sample_and_its_misfit_shows() -> None:
    robot = example_robot("ur5")
    log, truth = exact_log(robot, Drag(), {joint: {"level": 1.0} for joint in robot.joint_names}, duration=30, seed=5)
    settings = Settings(method="curve-fit", filter=FilterSettings(kind="log"))
    result = identify(log, robot, settings)
    samples = result.evidence.samples
    np.testing.assert_allclose(samples.friction_torque, truth.friction_torque, atol=1e-9)
    law = get_law("stribeck")
    for column, (name, joint) in enumerate(result.joints.items()):
        values = np.array([parameter.value for parameter in joint.parameters.values()])
        found = law.torque(samples.velocity[:, column], values)
        error = np.sqrt(np.mean((found - truth.friction_torque[:, column]) ** 2))
        assert error < 0.03, name  # 3 % of its level: six parameters bend to another law's shape
        assert 0.001 < joint.validation.rms < 0.03  # where a law of the family leaves 1e-14
        assert joint.validation.rms < 0.5 * joint.validation.rms_coulomb_only
