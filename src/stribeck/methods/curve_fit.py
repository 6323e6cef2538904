"""Curve fit: the law through each joint's friction torque over its velocity, (6.4)."""

from __future__ import annotations

from collections.abc import Sequence

from stribeck.friction import LAWS, FrictionLaw
from stribeck.identification.curve_fit.fit import fit_law
from stribeck.identification.curve_fit.validation import validate
from stribeck.methods.contract import SHARED, Finding, FrictionTorque, Method
from stribeck.preparation import PreparedLog, Progress
from stribeck.robot import Robot
from stribeck.settings import Settings

LEFT_OUT = "the curve fit takes the friction of couplings for that of their joints (the method whole-log does not)"


def find(
    prepared: Sequence[PreparedLog],
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    friction_torque: FrictionTorque,
    progress: Progress,
) -> Finding:
    """Fit the law to every joint that moves enough; every n-th block is held out."""
    samples = friction_torque(prepared, robot, settings).samples
    progress("fitting", 0.0)
    fits = fit_law(samples, law, settings)
    return Finding(
        fits=fits,
        validations=validate(fits, samples, law, settings),
        robot=robot,
        logs=prepared,
        warnings=[f"{LEFT_OUT}: {', '.join(robot.couplings)}"] if robot.couplings else [],
    )


CURVE_FIT = Method(
    name="curve-fit",
    uses=SHARED | {"loss", "averaged_law", "holdout"},
    laws=LAWS,
    defaults=lambda _: {"law": "stribeck"},
    find=find,
)
