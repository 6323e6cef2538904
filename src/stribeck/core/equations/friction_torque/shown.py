"""Samples and phases that a report shows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.spans import Span
from stribeck.core.equations.friction_torque.preparation import Logs
from stribeck.core.equations.friction_torque.stage import LogsFriction, thinned_samples
from stribeck.core.equations.friction_torque.thinning import join_logs, take
from stribeck.core.log import RobotLog
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot


def before_and_after(friction: LogsFriction, prepared: Logs, robot: Robot) -> tuple[FrictionSamples, FrictionSamples]:
    """Select samples of free and swinging limbs, with robot and logs as given and as corrected.

    These limbs show best how a model affects friction.
    """
    settings, samples = friction.settings.model_copy(update={"standing_legs": False}), friction.samples
    before = join_logs([thinned_samples(log, len(prepared), robot, settings, most=10_000) for log in prepared])
    return before, swinging(take(samples, np.isin(samples.time, before.time)), robot)


def swinging(samples: FrictionSamples, robot: Robot) -> FrictionSamples:
    """Mark only samples of free and swinging limbs as usable."""
    standing = np.array([robot.standing(tuple(name.split("+"))) for name in samples.support_names])
    return replace(samples, usable=samples.usable & ~standing[:, robot.torque_controlled][samples.support])


def in_channel_units(samples: FrictionSamples, log: RobotLog) -> FrictionSamples:
    """Divide the friction torque of joints by their rough gains."""
    names, unscaled = samples.joint_names, log.unscaled
    return replace(
        samples,
        friction_torque=samples.friction_torque / [unscaled.get(name, 1.0) for name in names],
        units=tuple(log.channel_unit(samples.slides(k)) * (name in unscaled) for k, name in enumerate(names)),
    )


def timeline(
    friction: LogsFriction, prepared: Logs, set_aside: Sequence[Sequence[Span]]
) -> list[tuple[float, float, str, bool]]:
    """List the phases of all logs, as in `Evidence`: contact modes, and spans that are excluded or set aside."""
    phases: list[tuple[float, float, str, bool]] = []
    for k, (part, log) in enumerate(zip(friction.logs, (source.log for source in prepared), strict=True)):
        kinds = {"set aside": set_aside[k] if set_aside else (), "excluded": log.excluded}
        spans = [(log.start + a, log.start + b, kind, False) for kind, cuts in kinds.items() for a, b, _ in cuts]
        phases += sorted([*part.phases, *spans], key=lambda phase: phase[0])
    return phases
