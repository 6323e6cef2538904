"""Settings of the robot file and the command line, with their defaults, validated by pydantic."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticKnownError

from stribeck.core.base.checked_table import Cutoff, Finite, NonNegative, Positive, Prior, Relative, Table, rule
from stribeck.core.base.parts import Parts
from stribeck.core.base.spans import spans_of_log
from stribeck.core.base.typing import TorqueSource
from stribeck.core.errors import listed

Acceleration = Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False)]  # [m/s^2]
Gravity = Annotated[tuple[Acceleration, Acceleration, Acceleration], Field(strict=False)]
PerJoint = Finite | list[Finite] | dict[str, Finite]
"""One value for all joints, a list in the log's joint order, or a value by the log's joint name."""


class CouplingTable(Table):
    """`[[robot.couplings]]`: friction that acts on a sum of joint speeds, such as the friction of a shared motor."""

    joints: dict[str, Finite]  # joint -> its coefficient in the sum
    name: str | None = None
    own_friction: bool = True  # whether these joints also have separate friction

    @property
    def label(self) -> str:
        """Name; by default, the names of the joints joined by "+"."""
        return self.name or "+".join(self.joints)

    @model_validator(mode="after")
    def _check_joints(self) -> Self:
        if len(self.joints) < 2 or not all(self.joints.values()):
            problem = "needs at least two joints, each with a nonzero coefficient"
            raise rule(f"[[robot.couplings]] '{self.label}' {problem}")
        return self


class MotorTable(Table):
    """`[robot.motors.<joint>]`: conversion from a motor's signal in the log to the torque of its joint."""

    torque_constant: Positive | None = None  # [N m/A], for a log in amperes
    ratio: Positive = 1.0  # gear ratio [1]; for a prismatic joint [1/m] or matching its torque constant


class LoopTable(Table):
    """`[[robot.loops]]`: two frames of the tree that are joined at their origins (`point`) or rigidly (`weld`)."""

    frames: Annotated[tuple[str, str], Field(strict=False)]
    kind: Literal["point", "weld"] = "point"

    def __str__(self) -> str:
        return " and ".join(f"'{frame}'" for frame in self.frames)

    @property
    def size(self) -> int:
        """Number of constraints."""
        return 3 if self.kind == "point" else 6


Times = (
    Annotated[tuple[NonNegative, NonNegative], Field(strict=False)]
    | Annotated[tuple[str, NonNegative, NonNegative], Field(strict=False)]
)


def _ends_after_start(span: Times) -> Times:
    if span[-2] >= span[-1]:
        raise ValueError(f"the span ends at {span[-1]:g} s, but starts at {span[-2]:g} s")
    return span


Excluded = Annotated[Times, AfterValidator(_ends_after_start)]
"""Start and end [s] after the start of every log, or of the log whose name comes first (see `base.spans.names_log`)."""


class PayloadTable(Table):
    """`[[robot.payload]]`: a mass that a fixed-base robot carries in spans of its logs."""

    link: str
    mass: Positive  # [kg]
    com: Annotated[tuple[Finite, Finite, Finite], Field(strict=False)] = (0.0, 0.0, 0.0)  # [m], in the link's frame
    spans: list[Excluded]

    def present(self, time: float, path: str) -> bool:
        """Whether the robot carries it at a time [s] after the start of a log."""
        return any(start <= time < end for start, end, _ in spans_of_log(self.spans, path))


class RobotTable(Table):
    """`[robot]`: the model and the roles of its joints."""

    model: str
    name: str | None = None
    base: Literal["floating", "fixed"] = "floating"
    base_frame: str | None = None  # frame that base_orientation refers to; default: the model's root link
    torque_source: TorqueSource = "link_side_sensor"
    position_controlled: list[str] = []
    locked: dict[str, Finite] = {}  # joint that the log omits -> its position [rad or m]
    armature: dict[str, NonNegative] = {}  # joint -> reflected rotor inertia [kg m^2]
    couplings: list[CouplingTable] = []
    passive: list[str] = []  # joints without a motor, moved by the loops
    loops: list[LoopTable] = []
    payload: list[PayloadTable] = []
    motors: dict[str, MotorTable] = {}
    kp: NonNegative | dict[str, NonNegative] | None = None  # [N m/rad], drive gain, for torque_source "command"
    kd: NonNegative | dict[str, NonNegative] | None = None  # [N m s/rad], drive gain, for torque_source "command"
    gravity: Gravity = (0.0, 0.0, -9.81)  # [m/s^2], in the frame of the world or of a fixed base
    # [s] from the stamp of a command until it acts; None: find it
    command_delay: Finite | dict[str, Finite] | None = None

    @model_validator(mode="after")
    def _check_roles(self) -> Self:
        source = self.torque_source
        if twice := sorted(set(self.passive) & set(self.position_controlled)):
            raise rule(f"[robot] joint '{twice[0]}' is both passive and position_controlled; expected one of them")
        if bool(self.passive) != bool(self.loops):
            both = "both the joints without a motor and the frames that close the loops"
            raise rule(f"[robot] passive and [[robot.loops]] belong together; expected {both}")
        if self.payload and (self.base == "floating" or self.loops):
            raise rule("[[robot.payload]] requires base = 'fixed' and no loops; exclude its spans with [log] exclude")
        wrong: list[tuple[str, list[str], str]] = []
        if source != "command" and (self.kp is not None or self.kd is not None):
            wrong.append(("[robot] kp and kd are", ["command"], "remove them or change the source"))
        if source != "command" and self.command_delay is not None:
            wrong.append(("[robot] command_delay is", ["command"], "set delay in [log.torque] instead"))
        for name, motor in self.motors.items():
            key = "ratio" if motor.torque_constant is None else "torque_constant"
            sources = ["motor_current", "motor_side_sensor"][: 1 + (key == "ratio")]
            if source not in sources:
                wrong.append((f"[robot.motors.{name}] {key} is", sources, "remove the key or change the source"))
        for key, sources, remedy in wrong:
            raise rule(f"{key} for torque_source {' or '.join(map(repr, sources))}, not '{source}'; {remedy}")
        return self


class ContactTable(Table):
    """`[contacts.<foot>]`: a frame that can stand on the ground."""

    frame: str
    kind: Literal["surface", "point", "wheel"] = "surface"
    radius: NonNegative | None = None  # [m], of a wheel or a ball foot; None: the model's ball, 0: a sharp point


class ChannelTable(Table):
    """`[log.<channel>]`: name, unit, sign and delay of a channel of the log, where they differ from the standard.

    stribeck uses `scale * unit * value + offset`, evaluated `delay` seconds later: a channel that arrives late has a
    positive delay.
    """

    name: str | list[str] | None = None  # array, column prefix, list of columns, or topic
    unit: str | None = None  # "rad", "deg", "rpm", "deg/s", "Nm", "mNm", "s", "ms", "us", "ns", ...
    scale: PerJoint = 1.0
    offset: PerJoint = 0.0  # in SI units, added after scale and unit
    delay: Finite = 0.0  # [s]
    unwrap: bool = False  # remove jumps by full turns, or by the range of unsigned integers (velocity, torque)
    order: Literal["xyzw", "wxyz"] | None = None  # quaternions only
    mount: Annotated[tuple[Finite, Finite, Finite], Field(strict=False)] | None = None  # [rad], rpy of the IMU


class LogTable(Table):
    """`[log]`: names, units and signs of the log, where they differ from stribeck's standard."""

    time: ChannelTable = ChannelTable()
    position: ChannelTable = ChannelTable()
    torque: ChannelTable = ChannelTable()
    velocity: ChannelTable = ChannelTable()
    acceleration: ChannelTable = ChannelTable()
    temperature: ChannelTable = ChannelTable()
    external_torque: ChannelTable = ChannelTable()
    desired_position: ChannelTable = ChannelTable()
    desired_velocity: ChannelTable = ChannelTable()
    desired_torque: ChannelTable = ChannelTable()
    base_orientation: ChannelTable = ChannelTable()
    angular_velocity: ChannelTable = ChannelTable()
    linear_acceleration: ChannelTable = ChannelTable()
    contact: ChannelTable = ChannelTable()
    foot_wrench: ChannelTable = ChannelTable()
    foot_force: ChannelTable = ChannelTable()
    joint_names: dict[str, str] = {}  # the log's name -> the model's name
    joint_order: list[str] = []  # names of the columns of unnamed arrays
    foot_names: dict[str, str] = {}  # the log's name (topic, for wrenches in bags) -> the contact's name
    foot_order: list[str] = []
    columns: list[str] = []  # names of all columns of a CSV file without a header line
    rate: Positive | None = None  # [Hz], instead of a time channel
    max_gap: Positive | None = None  # [s], longest interpolated step; default 1.5 periods, at least 10 ms
    exclude: list[Excluded] = []  # spans that are not used


class FilterSettings(Table):
    """Zero-phase filter that computes velocity and acceleration from positions."""

    kind: Literal["auto", "savitzky-golay", "butterworth", "log"] = "auto"
    window: int | None = Field(default=None, ge=3, le=99_999)  # samples, odd (savitzky-golay)
    order: int = Field(default=4, ge=1, le=12)  # polynomial or Butterworth order
    cutoff: Cutoff | None = None  # [Hz] (butterworth; savitzky-golay if no window is given)


class SupportSettings(Table):
    """Detection and trimming of support phases."""

    trim_start: NonNegative = 0.10  # [s] removed at the start of each phase
    trim_end: NonNegative = 0.05  # [s] removed at the end of each phase
    source: Literal["auto", "flags", "forces", "kinematics"] = "auto"
    force_on: Positive = 0.15  # share of the weight above which a foot lands
    force_off: Positive = 0.05  # share of the weight below which a foot lifts
    min_duration: NonNegative = 0.05  # [s]; shorter phases are ignored


class Priors(Table):
    """`[identify.priors]`: prior standard deviations of model errors, sensor errors and friction (whole-log).

    They describe how wrong models and sensors usually are; `identify` refines them from the log. The defaults are
    assumptions, as large as the errors in the models and sensors of the accuracy study.
    """

    mass: Relative = 0.05  # [1] relative to a body's mass: drawings omit cables, screws and paint
    centre_of_mass: Prior = 7.5e-3  # [m] along each axis
    moments: Relative = 0.12  # [1] principal second moments; uniform errors of 20 % have this standard deviation
    torque_gain: Relative = 0.01  # [1] gain error of a joint's torque sensor, calibrated once
    encoder_zero: Prior = 2e-3  # [rad] zero error of an encoder aligned at a stop or in a jig, 0.1 degrees
    imu_tilt: Prior = 5e-3  # [rad] mounting error of a screwed-on IMU, 0.3 degrees
    torque_delay: Prior = 1e-3  # [s] between torques and encoders: one cycle of a 1 kHz bus
    base_delay: Prior = 2e-3  # [s] between base orientation and encoders: IMUs filter
    wrench_force: Prior = 20.0  # [N] zero error of foot sensors: a few percent of a humanoid's weight
    wrench_moment: Prior = 2.0  # [N m] zero error of the moments of foot sensors
    wrench_gain: Relative = 0.02  # [1] gain error of foot sensors
    rotor: Prior = 1.0  # [kg m^2] rotor inertia that the model omits; larger than any real one
    rotor_share: Relative = 0.2  # [1] relative error of a rotor inertia in the robot file, from data sheets
    log_offset: Prior = 0.1  # [1] offset of one log minus the mean offset, relative to the torques that move the joints
    friction: Prior = 100.0  # [1] friction relative to the joint's torque: practically no prior
    scale: Prior = 1.0  # [1] logarithm of Stribeck velocity and slope relative to their starts: a factor of three
    pure_number: Prior = 1.0  # [1] dimensionless parameters, such as the Stribeck gain


def _part(*groups: str, also: tuple[str, ...] = ()) -> AfterValidator:
    """Make a validator of the names of parts that this and other packages declare, or register."""

    def check(name: str) -> str:
        names = sorted({*also, *(name for group in groups for name in Parts[object](group))})
        if name not in names:
            raise PydanticKnownError("literal_error", {"expected": listed(names, len(names))})
        return name

    return AfterValidator(check)


class Settings(Table):
    """`[identify]`: all settings of `identify`, explained in docs/settings.md.

    Raises
    ------
    SettingsError
        If a name is unknown or a value is not valid.

    Examples
    --------
    >>> settings = Settings(law="coulomb-viscous", filter=FilterSettings(kind="butterworth", cutoff=20.0))
    >>> settings.model_copy(update={"method": "whole-log"}).method
    'whole-log'
    """

    # default of the law depends on the method: "auto" (whole-log), "stribeck" (curve-fit)
    law: Annotated[str, _part("stribeck.laws", "stribeck.laws_with_state", also=("auto",))] | None = None
    method: Annotated[str, _part("stribeck.methods")] = "whole-log"
    corrections: Literal["auto", "none", "inertia", "calibration"] = "auto"  # model errors to estimate (whole-log)
    regression: Literal["ordinary", "weighted", "robust"] = "weighted"  # weights of the equations (direct)
    filter: FilterSettings = FilterSettings()
    support: SupportSettings = SupportSettings()
    priors: Priors = Priors()  # (whole-log)
    tilt: Literal["auto", "imu", "flat"] = "auto"
    double_support: Literal["skip", "fit"] = "skip"
    standing_legs: bool | Literal["measured"] = False  # fit standing legs too, by model or wrenches
    loss: Literal["linear", "soft_l1", "huber", "cauchy"] = "linear"
    fit_armature: Literal["auto"] | bool | list[str] = "auto"  # auto: joints with rotors, except in curve-fit
    filter_torque: bool = False
    averaged_law: bool = False  # filter torque and law like the acceleration
    # [Hz] (observer, where the default is "auto": the cutoff found for the log)
    observer_bandwidth: Literal["auto"] | Cutoff | None = None
    rest: Annotated[float, Field(ge=0, le=0.99)] = 0.005  # share of top speed that counts as rest, for laws with a jump
    block: Positive = 1.0  # [s], longest block
    holdout: int = Field(default=5, ge=2, le=1_000_000)  # every n-th block is used only for validation


class RobotFile(Table):
    """Contents of a robot file."""

    robot: RobotTable
    contacts: dict[str, ContactTable] = {}
    log: LogTable = LogTable()
    identify: Settings = Settings()

    @model_validator(mode="after")
    def _check_contacts(self) -> Self:
        if self.robot.base == "fixed" and self.contacts:
            raise rule("[contacts] are for a floating base; remove them or set [robot] base = 'floating'")
        by_frame: dict[str, str] = {}
        for name, contact in self.contacts.items():
            if (other := by_frame.setdefault(contact.frame, name)) != name:
                both = f"[contacts.{name}] and [contacts.{other}] have the frame '{contact.frame}'"
                raise rule(f"{both}; expected a different frame for each contact")
            if contact.radius and contact.kind == "surface":
                raise rule(f"[contacts.{name}] radius is for kinds 'point' and 'wheel'; remove it")
        return self
