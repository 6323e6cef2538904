"""Contract of methods, which estimate the friction of every joint from prepared logs.

To add a method:

1. Write `<name>.py` with a function `find` that is a `Find` and returns a `Fitted`. A method that fits the
   friction torque calls `torque(prepared, robot, settings)`, which is computed once for fit, table and report.
   A method that corrects the robot or the logs returns the corrected ones.
2. Create a `Method`. `uses` is `SHARED`, without settings that the method overrides, plus its own settings, with dots
   as after `--set`. All other settings are refused. `laws` are the laws that it can fit; `defaults` contains the
   default law.
3. Add its own settings to `Settings` in `settings.py`, with a line in docs/settings.md.
4. Declare it in the group `stribeck.methods` of pyproject.toml. Robot file, command line, table, report and provenance
   then support it. No other code depends on which method ran; its particular results are data in `Fitted`.
5. Test in tests/methods/test_methods.py that it recovers a known truth, and describe it in docs/.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from stribeck.core.base.finding import Finding
from stribeck.core.base.spans import Span
from stribeck.core.base.typing import BoolArray
from stribeck.core.dynamics.contact import SupportPhases
from stribeck.core.equations.friction_torque.preparation import Logs, Progress
from stribeck.core.equations.friction_torque.stage import LogsFriction, thinned_samples
from stribeck.core.equations.friction_torque.thinning import join_logs
from stribeck.core.errors import LogError
from stribeck.core.estimator.terms.selection import JointTerms
from stribeck.core.friction import FrictionLaw
from stribeck.core.judgement.joint_fit import JointFit
from stribeck.core.judgement.weakness import USUAL, Criteria
from stribeck.core.log import RobotLog
from stribeck.core.result import Corrections, Validation
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.core.settings import FilterSettings, Settings, SupportSettings

SHARED = frozenset(
    {"law", "method", "tilt", "standing_legs", "filter_torque", "fit_armature", "rest", "block"}
    | {f"filter.{key}" for key in FilterSettings.model_fields}
    | {f"support.{key}" for key in SupportSettings.model_fields}
)
"""Settings that all methods share: support phases, displayed friction torque, and verdicts."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Unseen:
    """Fits with the held-out parts of the logs, for the R² of the torque.

    Attributes
    ----------
    fits
        Fits by joint; only their values are used.
    usable
        Mask of held-out samples of the friction torque, shape (N, n), for a method that holds out samples.
    robot, logs
        Robot with the corrections of the fit, and logs cut to these parts, for a method that holds parts of logs out.
    correct
        Function that corrects one of the logs, given its number; None if the fit does not correct logs. It is applied
        per log, so that only one corrected copy is in memory.
    """

    fits: Mapping[str, JointFit]
    usable: BoolArray | None = None
    robot: Robot | None = None
    logs: Logs = ()
    correct: Callable[[RobotLog, int], RobotLog] | None = None

    def samples(self, friction: LogsFriction, prepared: Logs, robot: Robot) -> list[FrictionSamples]:
        """Compute held-out samples with the original and, if the fit corrects them, with the corrected robot and logs.

        Both use the filter of the friction torque. Samples of standing legs are not usable. None without samples.
        """
        settings = friction.settings.model_copy(update={"standing_legs": False})
        if self.usable is not None:
            return [replace(friction.samples, usable=friction.samples.usable & self.usable)]
        given = [replace(part, support=cut.support) for part, cut in zip(prepared, self.logs, strict=True)]
        versions = [joined_samples(given, robot, settings)]
        if self.robot is not None and self.robot is not robot:
            versions.append(joined_samples(self.logs, self.robot, settings, self.correct))
        return [samples for samples in versions if samples] if all(versions) else []


def joined_samples(
    logs: Logs, robot: Robot, settings: Settings, correct: Callable[[RobotLog, int], RobotLog] | None = None
) -> FrictionSamples | None:
    """Compute the friction torque of parts of logs, corrected if asked; None if no part is longer than the filter."""
    used = ((k, part) for k, part in enumerate(logs) if part.support.phases)
    corrected = (replace(part, log=correct(part.log, k)) if correct else part for k, part in used)
    try:
        return join_logs([thinned_samples(part, len(logs), robot, settings) for part in corrected])
    except LogError:
        return None


def cut(support: SupportPhases, parts: Iterable[slice]) -> SupportPhases:
    """Cut the support phases to some parts of the log."""
    phases = [
        replace(phase, first=max(phase.first, part.start), last=min(phase.last, part.stop))
        for part in parts
        for phase in support.phases
    ]
    return replace(support, phases=tuple(phase for phase in phases if phase.first < phase.last))


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted:
    """Estimates of a method.

    Attributes
    ----------
    fits
        Fits by joint, without joints that move too little.
    validations
        Validation of each fitted joint on held-out data; None where nothing was held out.
    unseen
        Held-out data for the R² of the torque; None where nothing was held out.
    robot, logs
        Corrected robot and logs; the original ones without corrections.
    correct
        Function that corrects the sensor errors in another log of the robot; None without sensor corrections.
    settings
        Settings of the displayed friction torque, if they differ from the user's.
    criteria
        Criteria of weak parameters.
    corrections
        Corrections of model and calibration, if estimated.
    body_corrections
        Largest correction of a body's inertia by joint [prior standard deviations].
    terms
        Terms of the law "auto", by joint.
    couplings
        Names of the estimated couplings of the robot.
    set_aside
        Spans of each log that the method did not use, because something disturbs them; empty if unknown.
    disturbed
        Phrase on the spans in which something disturbs the joints; empty if nothing does.
    rubbing
        Place where a joint rubs, by joint: its curve is valid elsewhere.
    findings, notes
        Findings for the user, and sentences on the processing.
    """

    fits: Mapping[str, JointFit]
    validations: Mapping[str, Validation | None]
    robot: Robot
    logs: Logs
    unseen: Unseen | None = None
    correct: Callable[[RobotLog], RobotLog] | None = None
    settings: Settings | None = None
    criteria: Criteria = USUAL
    corrections: Corrections | None = None
    body_corrections: Mapping[str, float] = field(default_factory=dict)
    terms: Mapping[str, JointTerms] = field(default_factory=dict)
    couplings: Sequence[str] = ()
    set_aside: Sequence[Sequence[Span]] = ()
    disturbed: str = ""
    rubbing: Mapping[str, str] = field(default_factory=dict)
    findings: Sequence[Finding] = ()
    notes: Sequence[str] = ()


FrictionTorque = Callable[[Logs, Robot, Settings], LogsFriction]
"""Function that computes the friction torque of logs: `stage.FrictionTorqueStage`."""


Find = Callable[[Logs, Robot, FrictionLaw, Settings, FrictionTorque, Progress], Fitted]
"""Function that estimates the friction of a robot from its logs.

It raises a LogError or a SettingsError if a log cannot be used, and a NothingIdentifiedError if no joint moves enough.
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Method:
    """Estimation method.

    Attributes
    ----------
    name
        Name in robot file and command line.
    uses
        Names of the settings that it uses.
    laws
        Names of the laws that it can fit.
    defaults
        Function from a robot to defaults of settings, including the law.
    find
        Function that estimates.
    loops
        Whether it supports closed chains; otherwise robots with closed chains are refused.
    wrenches
        Whether it supports measured foot wrenches; otherwise `standing_legs = "measured"` is refused.
    """

    name: str
    uses: frozenset[str]
    laws: Collection[str]
    defaults: Callable[[Robot], Mapping[str, str]]
    find: Find
    loops: bool = False
    wrenches: bool = True
