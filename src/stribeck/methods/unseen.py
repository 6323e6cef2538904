"""Parts of the logs that a fit has not seen: what its R^2 of the torque is taken from."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stribeck.contact import SupportPhases
from stribeck.errors import LogError
from stribeck.friction_torque.stage import FrictionSamples, thinned_samples
from stribeck.friction_torque.thinning import join_logs
from stribeck.identification.joint_fit import JointFit
from stribeck.preparation import PreparedLog
from stribeck.robot import Robot
from stribeck.samples import Samples


@dataclass(frozen=True, eq=False, kw_only=True)
class Unseen:
    """A fit, and the parts of the logs that it has not seen.

    Attributes
    ----------
    fits
        By joint; of their numbers the values alone count.
    usable
        Which of the friction torque's samples are of these parts, shape (N, n), for a method that holds samples out.
    robot, logs
        For one that holds parts of logs out: without the errors that the fit has found, and cut to these parts.
    """

    fits: Mapping[str, JointFit]
    usable: NDArray[np.bool_] | None = None
    robot: Robot | None = None
    logs: Sequence[PreparedLog] = ()

    def samples(self, friction: FrictionSamples, prepared: Sequence[PreparedLog], robot: Robot) -> list[Samples]:
        """Return samples of these parts by robot and logs as given and, where the fit corrects them, as it does.

        Both pass the filter of the friction torque; those of standing legs are not usable. None if there are none.
        """
        settings = friction.settings.model_copy(update={"standing_legs": False})
        if self.usable is not None:
            return [replace(friction.samples, usable=friction.samples.usable & self.usable)]
        given = [replace(part, support=cut.support) for part, cut in zip(prepared, self.logs, strict=True)]
        versions = [(given, robot)]
        if self.robot is not None and self.robot is not robot:
            versions.append((list(self.logs), self.robot))
        try:
            return [
                join_logs([thinned_samples(log, len(logs), machine, settings) for log in logs if log.support.phases])
                for logs, machine in versions
            ]
        except LogError:  # no part is longer than what the filter takes
            return []


def cut(support: SupportPhases, parts: Iterable[slice]) -> SupportPhases:
    """Return the support phases with what of them lies in some parts of the log."""
    found = [
        replace(phase, first=max(phase.first, part.start), last=min(phase.last, part.stop))
        for part in parts
        for phase in support.phases
    ]
    return replace(support, phases=tuple(phase for phase in found if phase.first < phase.last))
