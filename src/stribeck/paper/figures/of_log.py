"""All figures of the paper for a log, one section each."""

import numpy as np

from stribeck.core.base.parts import SERVICES
from stribeck.core.base.threads import one_blas_thread
from stribeck.core.dynamics.contact.rolling import with_rolling_feet
from stribeck.core.equations.friction_torque.preparation import Progress, log_path, prepare, quiet
from stribeck.core.equations.friction_torque.stage import thinned_samples, with_filter
from stribeck.core.errors import LogError, errors_about
from stribeck.core.log import LogLike
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings
from stribeck.paper.figures import acceleration, double_support, inertias, power, spectrum
from stribeck.paper.figures.figure import PaperSection


def paper_sections(log: LogLike, robot: Robot, settings: Settings, progress: Progress = quiet) -> list[PaperSection]:
    """Compute the figures of the paper for a log.

    Parameters
    ----------
    log
        Log, its path, or a frame.
    robot
        Robot.
    settings
        Uses `tilt`, `standing_legs`, `support` and `filter`. The torque is averaged like the acceleration.
    progress
        Callback `progress(message, fraction)` with fraction in [0, 1].

    Raises
    ------
    RobotFileError, LogError, SettingsError
        If the input or the settings are wrong, or no sample is usable.
    """
    with one_blas_thread(), errors_about(log_path(log)):
        prepared = prepare(log, robot, settings)
        robot, _ = with_rolling_feet(robot, [(prepared.log, prepared.support.phases, prepared.sampling.period)])
        (prepared,), _, _, robot = SERVICES["find_torques"]([prepared], robot, settings, [])
        settings, _ = with_filter(prepared, robot, settings.model_copy(update={"observer_bandwidth": None}))
        settings = settings.model_copy(update={"averaged_law": settings.filter.kind != "butterworth"})
        progress("estimated acceleration", 0.1)
        samples, estimated = acceleration.estimated_acceleration(prepared, robot, settings)
        changes = inertias.scaled(mass=1.1), inertias.scaled(moments=1.1)
        robots = [robot, *(inertias.with_bodies(robot, change) for change in changes)]
        used, *changed = [thinned_samples(prepared, 1, each, settings) for each in robots]
        taken = np.nansum(power.friction_power(used), axis=0)  # the joint with the most power comes first
        every = np.argsort(-taken)
        order = every[used.usable[:, every].any(axis=0)]
        if not len(order):
            raise LogError("log: contacts leave the friction of all joints open; expected legs that swing")
        progress("double support and spectrum", 0.5)
        return [
            acceleration.acceleration_section(samples, estimated, order),
            double_support.double_support_section(prepared, robot, settings, samples, every),
            spectrum.spectrum_section(prepared, robot, settings, used, order),
            power.power_section(used, order),
            inertias.inertias_section(used, changed, order),
        ]
