"""The friction observer: the law through the friction torque that a momentum observer gives of the logs.

It takes no accelerations. What differs from the curve fit is data: with an `observer_bandwidth` the friction torque is
the observer's, and velocity and law are low-passed as it is (`friction_torque.log_observer`), so that they all lag
as much and no parameter is biased by it.
"""

from __future__ import annotations

from stribeck.friction import LAWS
from stribeck.methods.contract import SHARED, Method
from stribeck.methods.curve_fit import find

OBSERVER = Method(
    name="observer",
    uses=(SHARED - {"filter_torque", "double_support"}) | {"observer_bandwidth", "loss", "holdout"},
    laws=LAWS,
    defaults=lambda _: {"law": "stribeck", "observer_bandwidth": "auto"},
    find=find,
)
