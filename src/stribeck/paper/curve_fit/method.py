"""Curve fit of the law to each joint's friction torque (Equation 6.4 of the term paper), also for a momentum observer.

The observer needs no accelerations. With an `observer_bandwidth`, friction torque, velocity and law pass the same
low-pass (`friction_torque.log_observer`). All have the same lag, so that no parameter is biased.
"""

from collections import ChainMap

from stribeck.core.base.finding import Finding
from stribeck.core.equations.friction_torque.preparation import Logs, Progress
from stribeck.core.errors import SettingsError
from stribeck.core.friction import LAWS, LAWS_WITH_STATE, FrictionLaw, LawWithState
from stribeck.core.identify.contract import SHARED, Fitted, FrictionTorque, Method, Unseen
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.fit import fit_law, validate


def find(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings, torque: FrictionTorque, progress: Progress
) -> Fitted:
    """Fit the law to every joint that moves enough; every n-th block is held out.

    A law with state is always averaged like the friction torque, because its response to a reversal is as short as the
    filter's window.
    """
    with_state = isinstance(law, LawWithState)
    if with_state:
        if settings.filter.kind == "butterworth":
            raise SettingsError(
                "[identify.filter] kind is 'butterworth', which has no window to average the law "
                f"'{law.name}' over; set it to 'auto' or 'savitzky-golay'"
            )
        settings = settings.model_copy(update={"averaged_law": True})
    samples = torque(prepared, robot, settings).samples
    progress("fitting", 0.0)
    fits = fit_law(samples, law, settings)
    validations, unseen = validate(fits, samples, law, settings)
    names = [joint for coupling in robot.couplings.values() for joint in coupling]
    couplings = Finding.of("couplings-left-out", names, couplings=", ".join(robot.couplings))
    return Fitted(
        fits=fits,
        validations=validations,
        unseen=Unseen(fits=fits, usable=unseen),
        robot=robot,
        logs=prepared,
        settings=settings if with_state else None,
        findings=[couplings] if robot.couplings else [],
    )


CURVE_FIT = Method(
    name="curve-fit",
    uses=SHARED | {"loss", "averaged_law", "holdout"},
    laws=ChainMap(LAWS, LAWS_WITH_STATE),
    defaults=lambda _: {"law": "stribeck"},
    find=find,
    loops=True,
)

OBSERVER = Method(
    name="observer",
    uses=(SHARED - {"filter_torque"}) | {"observer_bandwidth", "loss", "holdout"},
    laws=LAWS,
    defaults=lambda _: {"law": "stribeck", "observer_bandwidth": "auto"},
    find=find,
    loops=True,
    wrenches=False,
)
