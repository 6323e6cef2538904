"""The friction observer: the law through the friction torque that a momentum observer gives of the logs.

It takes no accelerations. What differs from the curve fit is data: with an `observer_bandwidth` the friction torque is
the observer's, and velocity and law are low-passed as it is (`friction_torque.log_observer`), so that they all lag
as much and no parameter is biased by it.
"""

from collections.abc import Sequence

from stribeck.errors import SettingsError
from stribeck.friction import LAWS, FrictionLaw
from stribeck.methods import curve_fit
from stribeck.methods.contract import SHARED, Fitted, FrictionTorque, Method
from stribeck.preparation import PreparedLog, Progress
from stribeck.robot import Robot
from stribeck.settings import Settings


def find(
    prepared: Sequence[PreparedLog],
    robot: Robot,
    law: FrictionLaw,
    settings: Settings,
    friction_torque: FrictionTorque,
    progress: Progress,
) -> Fitted:
    """Fit the law to what the observer sees of every joint that moves enough; every n-th block is held out."""
    if settings.standing_legs == "measured":
        raise SettingsError(
            "[identify] standing_legs is 'measured', and a momentum observer takes no foot wrenches; "
            "expected true or false"
        )
    return curve_fit.find(prepared, robot, law, settings, friction_torque, progress)


OBSERVER = Method(
    name="observer",
    uses=(SHARED - {"filter_torque", "double_support"}) | {"observer_bandwidth", "loss", "holdout"},
    laws=LAWS,
    defaults=lambda _: {"law": "stribeck", "observer_bandwidth": "auto"},
    find=find,
    loops=True,
)
