"""What a method is: from prepared logs to the friction of every joint.

To add a method:

1. Write `methods/<name>.py` with a function `find` that is called as `Find` says and returns a `Fitted`. A method that
   fits the friction torque asks `friction_torque(prepared, robot, settings)` for it: that is worked out once, for the
   fit, the table and the report. A method that corrects the robot or the logs returns the corrected ones.
2. Make a `Method` of it. `uses` is `SHARED` and the settings of its own, dotted as they are typed after `--set`; leave
   out of `SHARED` what the method overrides. All others are refused by name where they are set. `laws` are those that
   it can fit; `defaults` names the one that it fits by default.
3. Settings of its own go into `Settings` in `settings.py`, with a line in docs/robot-file.md.
4. Add it to `METHODS` in `methods/__init__.py`. Robot file, command line, table, report and provenance know it then,
   and nothing else asks which method ran: what is particular to a method is data in its `Fitted`.
5. Let it recover a known truth in tests/methods/test_methods.py, and describe it in docs/.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stribeck.base.finding import Finding
from stribeck.contact import SupportPhases
from stribeck.errors import LogError
from stribeck.friction import FrictionLaw
from stribeck.friction_torque.preparation import PreparedLog, Progress
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.friction_torque.stage import LogsFriction, thinned_samples
from stribeck.friction_torque.thinning import join_logs
from stribeck.judgement.joint_fit import JointFit
from stribeck.judgement.weakness import USUAL, Criteria
from stribeck.log import RobotLog
from stribeck.result import Corrections, Validation
from stribeck.robot import Robot
from stribeck.settings import FilterSettings, Settings, SupportSettings
from stribeck.whole_log.terms.selection import JointTerms

SHARED = frozenset(
    {"law", "method", "tilt", "standing_legs", "filter_torque", "fit_armature", "rest", "block"}
    | {f"filter.{key}" for key in FilterSettings.model_fields}
    | {f"support.{key}" for key in SupportSettings.model_fields}
)
"""Settings of what all methods share: support phases, the friction torque that is shown, and the verdicts on it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Unseen:
    """A fit, and the parts of the logs that it has not seen, from which the R^2 of the torque is taken.

    Attributes
    ----------
    fits
        Fits by joint; only their values are used.
    usable
        Samples of the friction torque in these parts, shape (N, n), for a method that holds samples out.
    robot, logs
        Robot with the corrections of the fit, and logs cut to these parts, for a method that holds parts of logs out.
    correct
        Correction of one of the logs, given with its number; None if the fit does not correct logs. It is applied log
        by log, so that memory holds one corrected copy.
    """

    fits: Mapping[str, JointFit]
    usable: NDArray[np.bool_] | None = None
    robot: Robot | None = None
    logs: Sequence[PreparedLog] = ()
    correct: Callable[[RobotLog, int], RobotLog] | None = None

    def samples(self, friction: LogsFriction, prepared: Sequence[PreparedLog], robot: Robot) -> list[FrictionSamples]:
        """Return samples of these parts by robot and logs as given and, where the fit corrects them, as it does.

        Both pass the filter of the friction torque; those of standing legs are not usable. None if there are none.
        """
        settings = friction.settings.model_copy(update={"standing_legs": False})
        if self.usable is not None:
            return [replace(friction.samples, usable=friction.samples.usable & self.usable)]
        given = [replace(part, support=cut.support) for part, cut in zip(prepared, self.logs, strict=True)]
        found = [joined_samples(given, robot, settings)]
        if self.robot is not None and self.robot is not robot:
            found.append(joined_samples(self.logs, self.robot, settings, self.correct))
        return [samples for samples in found if samples] if all(found) else []


def joined_samples(
    logs: Sequence[PreparedLog],
    robot: Robot,
    settings: Settings,
    correct: Callable[[RobotLog, int], RobotLog] | None = None,
) -> FrictionSamples | None:
    """Compute the friction torque of parts of logs, corrected if asked; None if no part is longer than the filter."""
    used = ((k, part) for k, part in enumerate(logs) if part.support.phases)
    corrected = (replace(part, log=correct(part.log, k)) if correct else part for k, part in used)
    try:
        return join_logs([thinned_samples(part, len(logs), robot, settings) for part in corrected])
    except LogError:
        return None


def cut(support: SupportPhases, parts: Iterable[slice]) -> SupportPhases:
    """Return the support phases with what of them lies in some parts of the log."""
    found = [
        replace(phase, first=max(phase.first, part.start), last=min(phase.last, part.stop))
        for part in parts
        for phase in support.phases
    ]
    return replace(support, phases=tuple(phase for phase in found if phase.first < phase.last))


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted:
    """What a method found.

    Attributes
    ----------
    fits
        By joint; those that do not move enough have none.
    validations
        Of each joint that has a fit, on what the fit did not see; None where nothing was held out.
    unseen
        What the R^2 of the torque is taken from; None where nothing was held out.
    robot, logs
        Without the errors that were found; as they were given where none was.
    correct
        Takes the errors of sensors that were found out of another log of the robot; None where none was looked for.
    settings
        Those of the friction torque that is shown, where they are not as the user gave them.
    criteria
        From when on its parameters are weak.
    corrections
        What was found of model and calibration, if that was looked for.
    terms
        Terms of the law "auto", by joint.
    couplings
        Names of the robot's that were looked for.
    findings, notes
        What a user should act on, and a sentence each on what was done.
    """

    fits: Mapping[str, JointFit]
    validations: Mapping[str, Validation | None]
    robot: Robot
    logs: Sequence[PreparedLog]
    unseen: Unseen | None = None
    correct: Callable[[RobotLog], RobotLog] | None = None
    settings: Settings | None = None
    criteria: Criteria = USUAL
    corrections: Corrections | None = None
    terms: Mapping[str, JointTerms] = field(default_factory=dict)
    couplings: Sequence[str] = ()
    findings: Sequence[Finding] = ()
    notes: Sequence[str] = ()


FrictionTorque = Callable[[Sequence[PreparedLog], Robot, Settings], LogsFriction]
"""Works the friction torque of logs out by a robot; `stribeck.friction_torque.stage.FrictionTorqueStage`."""


class Find(Protocol):
    """How a method is called."""

    def __call__(
        self,
        prepared: Sequence[PreparedLog],
        robot: Robot,
        law: FrictionLaw,
        settings: Settings,
        friction_torque: FrictionTorque,
        progress: Progress,
    ) -> Fitted:
        """Return what logs of a robot say about its friction.

        Raises
        ------
        LogError, SettingsError
            If a log cannot be used.
        NothingIdentifiedError
            If no joint moves enough.
        """
        ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Method:
    """A method.

    Attributes
    ----------
    name
        For robot file and command line.
    uses
        Settings that it uses.
    laws
        Names of the laws that it can fit.
    defaults
        Of a robot: what takes the place of settings that are left open, the law among them.
    find
        What it does.
    loops
        Whether it takes the forces of closed chains out; others refuse robots that have some.
    wrenches
        Whether it can use measured wrenches on feet; others refuse `standing_legs = "measured"`.
    """

    name: str
    uses: frozenset[str]
    laws: Collection[str]
    defaults: Callable[[Robot], Mapping[str, str]]
    find: Find
    loops: bool = False
    wrenches: bool = True
