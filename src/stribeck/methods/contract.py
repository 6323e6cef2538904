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

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from stribeck.finding import Finding
from stribeck.friction import FrictionLaw
from stribeck.friction_torque.stage import FrictionSamples
from stribeck.identification.joint_fit import JointFit
from stribeck.identification.judgement.weakness import USUAL, Criteria
from stribeck.log import RobotLog
from stribeck.methods.unseen import Unseen
from stribeck.preparation import PreparedLog, Progress
from stribeck.result import Corrections, TermVerdict, Validation
from stribeck.robot import Robot
from stribeck.settings import FilterSettings, Settings, SupportSettings

SHARED = frozenset(
    {"law", "method", "tilt", "double_support", "standing_legs", "filter_torque", "fit_armature", "rest", "block"}
    | {f"filter.{key}" for key in FilterSettings.model_fields}
    | {f"support.{key}" for key in SupportSettings.model_fields}
)
"""Settings of what all methods share: support phases, the friction torque that is shown, and the verdicts on it."""


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
        By joint, of the law "auto": which terms it has, the torque that it carries and its deviation [N m], the means
        of cosine and sine of its position, None of a prismatic joint, the periods of its torque ripple a turn, the
        travel of its presliding [rad], and its mean temperature [deg C], None where none is logged.
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
    terms: Mapping[
        str, tuple[dict[str, TermVerdict], float, float, tuple[float, ...] | None, float, float, float | None]
    ] = field(default_factory=dict)
    couplings: Sequence[str] = ()
    findings: Sequence[Finding] = ()
    notes: Sequence[str] = ()


FrictionTorque = Callable[[Sequence[PreparedLog], Robot, Settings], FrictionSamples]
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
    """

    name: str
    uses: frozenset[str]
    laws: Collection[str]
    defaults: Callable[[Robot], Mapping[str, str]]
    find: Find
    loops: bool = False
