"""Settings of the robot file and the command line, with their defaults, validated by pydantic."""

import tomllib
from collections.abc import Iterator
from difflib import get_close_matches
from math import inf
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stribeck.base.typing import TorqueSource

Positive = Annotated[float, Field(ge=1e-9, le=1e9, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Finite = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False)]  # an offset of time stamps may be that large
Cutoff = Annotated[float, Field(ge=0.5, le=1e5, allow_inf_nan=False)]
"""[Hz]; no robot moves as slowly as a lower one, and its filter would be seconds long."""
Prior = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False)]
"""Standard deviation; squares of smaller or larger ones are lost in rounding."""
Acceleration = Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False)]  # [m/s^2]
Gravity = Annotated[tuple[Acceleration, Acceleration, Acceleration], Field(strict=False)]
PerJoint = Finite | list[Finite] | dict[str, Finite]
"""One value for all joints, a list in the log's joint order, or a value by the log's joint name."""


class Table(BaseModel):
    """A table of a settings file: unknown keys and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class CouplingTable(Table):
    """`[[robot.couplings]]`: a friction of its own that acts on a sum of joint speeds, as of a shared motor."""

    joints: dict[str, Finite]  # joint -> its coefficient in the sum
    name: str | None = None


class MotorTable(Table):
    """`[robot.motors.<joint>]`: from what the log holds of a motor to the torque of its joint."""

    torque_constant: Positive | None = None  # [N m/A], of a log in amperes
    ratio: Positive = 1.0  # [1], of the gear; of a prismatic joint [1/m] or as its torque constant has it


class LoopTable(Table):
    """`[[robot.loops]]`: frames of the tree held together, by their origins (`point`) or rigidly (`weld`)."""

    frames: Annotated[tuple[str, str], Field(strict=False)]
    kind: Literal["point", "weld"] = "point"

    def __str__(self) -> str:
        return " and ".join(f"'{frame}'" for frame in self.frames)

    @property
    def size(self) -> int:
        """Number of constraints."""
        return 3 if self.kind == "point" else 6


class RobotTable(Table):
    """`[robot]`: which model, and the role of its joints."""

    model: str
    name: str | None = None
    base: Literal["floating", "fixed"] = "floating"
    base_frame: str | None = None  # frame whose orientation the log's base_orientation is; the model's root link
    torque_source: TorqueSource = "link_side_sensor"
    position_controlled: list[str] = []
    locked: dict[str, Finite] = {}  # joint -> position [rad or m]; joints that the log leaves out
    armature: dict[str, NonNegative] = {}  # joint -> reflected rotor inertia [kg m^2]
    couplings: list[CouplingTable] = []
    passive: list[str] = []  # joints without a motor, which the loops move
    loops: list[LoopTable] = []
    motors: dict[str, MotorTable] = {}
    kp: NonNegative | dict[str, NonNegative] | None = None  # [N m/rad], of the law that commands torques
    kd: NonNegative | dict[str, NonNegative] | None = None  # [N m s/rad]
    gravity: Gravity = (0.0, 0.0, -9.81)  # world or fixed base


class ContactTable(Table):
    """`[contacts.<foot>]`: a frame that can stand on the ground."""

    frame: str
    kind: Literal["surface", "point"] = "surface"


class ChannelTable(Table):
    """`[log.<channel>]`: how one of the log's channels differs from what stribeck reads by itself.

    The value that stribeck uses is `scale * unit * value + offset`, taken `delay` seconds later: a channel that
    arrives late has a positive delay.
    """

    name: str | list[str] | None = None  # array, column prefix, list of columns, or topic
    unit: str | None = None  # "rad", "deg", "rpm", "deg/s", "Nm", "mNm", "s", "ms", "us", "ns", ...
    scale: PerJoint = 1.0
    offset: PerJoint = 0.0  # in SI units, added after scale and unit
    delay: Finite = 0.0  # [s]
    unwrap: bool = False  # remove jumps of a whole turn
    order: Literal["xyzw", "wxyz"] | None = None  # quaternions only


class LogTable(Table):
    """`[log]`: only where the log's own names, units or signs differ from the contract."""

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
    joint_order: list[str] = []  # names of the columns of arrays that come without names
    foot_names: dict[str, str] = {}  # the log's name (for wrenches in bags: the topic) -> the contact's name
    foot_order: list[str] = []
    columns: list[str] = []  # names of all columns of a CSV file that has no line of names
    rate: Positive | None = None  # [Hz], for logs without a time channel
    max_gap: Positive | None = None  # [s], longest step that is still interpolated; default 1.5 periods, 10 ms at least


class FilterSettings(Table):
    """Which zero-phase filter gives velocity and acceleration from positions."""

    kind: Literal["auto", "savitzky-golay", "butterworth", "log"] = "auto"
    window: int | None = Field(default=None, ge=3, le=99_999)  # samples, odd (savitzky-golay)
    order: int = Field(default=4, ge=1, le=12)  # polynomial or Butterworth order
    cutoff: Cutoff | None = None  # [Hz] (butterworth; savitzky-golay if no window is given)


class SupportSettings(Table):
    """How support phases are found and trimmed."""

    trim_start: NonNegative = 0.10  # [s] left out at the beginning of each phase
    trim_end: NonNegative = 0.05  # [s] left out at its end
    source: Literal["auto", "flags", "forces", "kinematics"] = "auto"
    force_on: Positive = 0.15  # a foot lands when it carries more than this share of the weight
    force_off: Positive = 0.05  # and lifts when it carries less than this
    min_duration: NonNegative = 0.05  # [s] shorter phases are left out


class Priors(Table):
    """`[identify.priors]`: standard deviations of what the whole log corrects or fits, before the log speaks.

    They say how wrong models and sensors usually are; how wrong the given ones are, the log itself tells from there.
    The defaults are assumptions, of the size of the errors that the accuracy study gives its models and sensors.
    """

    mass: Prior = 0.05  # [1] of a body's mass: drawings lack cables, screws and paint
    centre_of_mass: Prior = 7.5e-3  # [m] along each axis
    moments: Prior = 0.12  # [1] principal second moments; uniform errors of 20 % have this standard deviation
    torque_gain: Prior = 0.01  # [1] of a joint's torque sensor, calibrated once
    encoder_zero: Prior = 2e-3  # [rad] of an encoder that was zeroed against a stop or a jig, 0.1 degrees
    imu_tilt: Prior = 5e-3  # [rad] of an IMU screwed to its place, 0.3 degrees
    torque_delay: Prior = 1e-3  # [s] of the torques against the encoders: a cycle of a 1 kHz bus
    base_delay: Prior = 2e-3  # [s] of the base orientation against the encoders: IMUs filter
    wrench_force: Prior = 20.0  # [N] zeros of foot wrench sensors: a few per cent of a humanoid's weight
    wrench_moment: Prior = 2.0  # [N m] the same of moments
    wrench_gain: Prior = 0.02  # [1] of foot wrench sensors
    rotor: Prior = 1.0  # [kg m^2] where the model has none; wider than any joint's, as nothing is known
    rotor_share: Prior = 0.2  # [1] of a rotor inertia that the model has: data sheets and gears are that wrong
    log_offset: Prior = 0.1  # [1] of offsets in one log against those in all, over torques that move the joints
    friction: Prior = 100.0  # [1] sizes of friction over the joint's torque: as good as no prior
    scale: Prior = 1.0  # [1] logarithms of Stribeck velocity and slope around their starts: a factor of three
    pure_number: Prior = 1.0  # [1] parameters without a unit, such as the Stribeck gain


class Settings(Table):
    """`[identify]`: all settings of `identify`; docs/robot-file.md says what each setting means.

    Raises
    ------
    ValidationError
        pydantic's, if a name is unknown or a value is not valid.

    Examples
    --------
    >>> settings = Settings(law="coulomb-viscous", filter=FilterSettings(kind="butterworth", cutoff=20.0))
    >>> settings.model_copy(update={"method": "whole-log"}).method
    'whole-log'
    """

    law: str | None = None  # the method's own: "auto" (whole-log), "stribeck" (curve-fit)
    method: str = "whole-log"
    corrections: Literal["auto", "none", "inertia", "calibration"] = "auto"  # of the model, beside friction (whole-log)
    regression: Literal["ordinary", "weighted", "robust"] = "weighted"  # how rows of all joints are weighed (direct)
    filter: FilterSettings = FilterSettings()
    support: SupportSettings = SupportSettings()
    priors: Priors = Priors()  # of friction, model and sensors (whole-log)
    tilt: Literal["auto", "imu", "flat"] = "auto"
    double_support: Literal["skip", "fit"] = "skip"
    standing_legs: bool | Literal["measured"] = False  # let them into the fits, by the model or by measured wrenches
    loss: Literal["linear", "soft_l1", "huber", "cauchy"] = "linear"
    fit_armature: Literal["auto"] | bool | list[str] = "auto"  # auto: where rotors turn, but not curve-fit
    filter_torque: bool = False
    averaged_law: bool = False  # torque and law are averaged over time as the filter averages the acceleration
    observer_bandwidth: Literal["auto"] | Cutoff | None = (
        None  # [Hz] (observer, which fills in "auto": the log's cutoff)
    )
    rest: Annotated[float, Field(ge=0, le=0.99)] = 0.005  # share of top speed, slower is at rest: for laws with a jump
    block: Positive = 1.0  # [s], length of a block where no step limits it
    holdout: int = Field(default=5, ge=2, le=1_000_000)  # every n-th block is used only for validation


def flat(table: Table, prefix: str = "") -> dict[str, object]:
    """Return settings with dotted keys, as they are typed after `--set`."""
    found: dict[str, object] = {}
    for key, value in table:
        found |= flat(value, f"{prefix}{key}.") if isinstance(value, Table) else {prefix + key: value}
    return found


class RobotFile(Table):
    """The whole robot file."""

    robot: RobotTable
    contacts: dict[str, ContactTable] = {}
    log: LogTable = LogTable()
    identify: Settings = Settings()


def describe(error: ValidationError, table: type[BaseModel] | None = None) -> str:
    """Return pydantic's first complaint as one sentence: which key, what was found, what would be valid.

    `table` is what was validated; its nearest key is named where one is unknown. An unknown key comes first: another
    one may be missing because it is misspelt.
    """
    first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
    key = ".".join(str(part) for part in first["loc"])
    message = str(first["msg"])
    if first["type"] == "extra_forbidden":
        return f"unknown key '{key}'" + (_nearest([str(part) for part in first["loc"]], table) if table else "")
    if first["type"] == "missing":
        return f"key '{key}' is missing"
    if first["type"].startswith(("greater_than", "less_than", "finite_number")) and table:
        return f"key '{key}' is {_shown(first['input'])}; expected {_range(list(first['loc']), table)}"
    if not key:  # of the document as a whole
        return message.removeprefix("Value error, ")
    return f"key '{key}' is {_shown(first['input'])}: {message[0].lower()}{message[1:]}"


def _nearest(loc: list[str], table: type[BaseModel]) -> str:
    """Return the key that an unknown one may mean: beside it, or of this name elsewhere; else all keys beside it."""
    *tables, last = loc
    beside = table
    for part in tables:
        if part in beside.model_fields:
            beside = _table_of(beside, part) or beside
    if near := get_close_matches(last, beside.model_fields, n=1):
        return f"; did you mean '{'.'.join([*tables, *near])}'?"
    elsewhere = [key for key in _dotted(table) if key.rpartition(".")[2] == last]
    return f"; did you mean '{elsewhere[0]}'?" if elsewhere else f"; expected one of {', '.join(beside.model_fields)}"


def _range(loc: list[object], table: type[BaseModel]) -> str:
    """Return the range of the number that a location leads to."""
    inner: type[BaseModel] | None = table
    notes: list[Any] = []
    for part in loc:
        if inner is not None and part in inner.model_fields:
            field = inner.model_fields[part]
            notes, inner = [*field.metadata, field.annotation], _table_of(inner, part)
    bounds: dict[str, float] = {}
    while notes:
        note = notes.pop()
        notes += [*get_args(note), *getattr(note, "metadata", ())]
        for name in ("ge", "gt", "le", "lt"):
            if getattr(note, name, None) is not None:
                bounds[name[0]] = getattr(note, name)
    return f"a number from {bounds.get('g', -inf):g} to {bounds.get('l', inf):g}"


def _table_of(table: type[BaseModel], key: str) -> type[BaseModel] | None:
    """Return the table that a key of a table is, or holds by name; None of other keys."""
    annotation = table.model_fields[key].annotation
    inner = [annotation, *get_args(annotation)]
    return next((one for one in inner if isinstance(one, type) and issubclass(one, BaseModel)), None)


def _dotted(table: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """Yield the keys of a table and of the tables in it, as they are typed after `--set`."""
    for key in table.model_fields:
        inner = table.model_fields[key].annotation
        yield prefix + key
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from _dotted(inner, f"{prefix}{key}.")


def _shown(value: object) -> str:
    try:
        found = repr(value)
    except (RecursionError, ValueError):  # deep tables, and integers beyond the digits that Python prints
        return f"a value of type {type(value).__name__} too large to show"
    return found if len(found) < 80 else found[:77] + "..."


def parse_toml(text: str) -> dict[str, Any]:
    """Return a TOML document.

    Raises
    ------
    ValueError
        If it is none (as its subclass TOMLDecodeError), has an integer of too many digits, or is nested too deeply.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
