"""Text files: a C header and a Python module with all friction terms, modules for other libraries, YAML and CSV.

C and Python evaluate one function that covers all laws:

    R = (Fc rise + Fc' |rise|) (1 + S exp(-(|v| / vs)^delta)) + Fv v + Fv' |v| + terms,   rise = tanh(a v)

with the terms of `stribeck.friction.terms` that depend on load, temperature and position. Above the top speed of a slow
joint, v is clipped to that speed, and R grows linearly with the slope of `beyond`. The offset is stored, but not part
of R.
"""

import json
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from stribeck.errors import SettingsError
from stribeck.exporters.beyond import Beyond, top_speed
from stribeck.exporters.samples import JointRanges
from stribeck.exporters.target import Request
from stribeck.friction.auto import JUMP
from stribeck.friction.terms import LADDER
from stribeck.result import JointResult

FORMULAS = ("asymmetric", "auto", "coulomb-viscous", "lugre", "stribeck", "stribeck-exponent")
"""Laws that the function covers; for LuGre, the friction of steady sliding."""

OF_TERMS = [term for term in LADDER if term.over in ("load", "temperature", "position")]
NUMBERS = {
    **dict.fromkeys(("viscous", "viscous_difference", "coulomb", "coulomb_difference", "stribeck_gain"), 0.0),
    "stribeck_velocity": 1.0,
    "exponent": 2.0,
    "slope": JUMP,
    **dict.fromkeys(("offset", "mean_cosine", "mean_sine"), 0.0),
    **dict.fromkeys([name for term in OF_TERMS for name in (*term.names, *term.settings)], 0.0),
    "lowest": -1e9,
    "highest": 1e9,
    "top_speed": 1e9,
    "viscous_beyond": 0.0,
}
"""Values for a joint without friction: Fv, Fv', Fc, Fc', S, vs, delta, a, offset, means of cosine and sine of the
position, parameters and settings of the terms, the position range of the log, that clips positions, and top speed and
slope of R above it."""


def numbers_of(joint: JointResult, beyond: Beyond | None = None) -> dict[str, float]:
    """Compute the values of `NUMBERS` for a joint's friction, without drift, which is zero in the middle of a log.

    Raises
    ------
    SettingsError
        If the law is not in `FORMULAS`.
    """
    found = joint.values
    numbers = NUMBERS | dict(zip(("lowest", "highest"), joint.position_range or (), strict=False))
    if joint.verdict == "no friction":
        return numbers | {"offset": found.get("offset", 0.0)}
    if joint.law not in FORMULAS:
        raise SettingsError(f"export: no formula for law '{joint.law}'; expected one of {', '.join(FORMULAS)}")
    numbers |= {name: value for name, value in found.items() if name in NUMBERS}
    if "viscous_asymmetry" in found:
        numbers["viscous_difference"] = found["viscous"] * found["viscous_asymmetry"]
    if "viscous_positive" in found:
        for name in ("viscous", "coulomb"):
            forward, backward = found[f"{name}_positive"], found[f"{name}_negative"]
            numbers |= {name: (forward + backward) / 2, f"{name}_difference": (forward - backward) / 2}
    if joint.mean_direction:
        numbers |= {"mean_cosine": joint.mean_direction[0], "mean_sine": joint.mean_direction[1]}
    if beyond:
        numbers |= {"top_speed": beyond.top, "viscous_beyond": beyond.slope}
    return numbers | {name: getattr(joint, name) or 0.0 for term in OF_TERMS for name in term.settings}


def _code(parameter: str, function: str, absolute: str) -> dict[str, str]:
    """Format the friction of the terms over position, and of all others, for templates of C and Python.

    `parameter` and `function` are patterns of the language; `absolute` is its function for absolute values.
    """
    found = {"steady": "", "over_position": ""}
    for term in OF_TERMS:
        known = "|".join(("mean_cosine", "mean_sine", *term.settings))
        for name, column in zip(term.names, term.columns, strict=True):
            code = re.sub(
                rf"\b({known})\b", lambda word: parameter.format(word[1]), column.replace("velocity", "within")
            )
            code = re.sub(r"\b(?!abs)([a-z]+)\(", lambda word: function.format(word[1]), code).replace("abs(", absolute)
            found["over_position" if term.over == "position" else "steady"] += (
                f"\n        + {parameter.format(name)} * {code}"
            )
    return found


def c_text(request: Request) -> str:
    """Format a C99 header, also valid C++, with the friction of the joints and its compensation."""
    rows: dict[str, str] = {}
    names: dict[str, str] = {}
    for name in request.joints:
        own = _identifier(name)
        if (other := names.setdefault(own, name)) != name:
            raise SettingsError(f"export: joints '{other}' and '{name}' have the same identifier {own}; rename one")
        numbers = _with_confidence(request, name).values()
        rows[own] = f"{{{', '.join(f'(friction_real){number!r}' for number in numbers)}}}"
    lines = [re.sub(r"\*/|/\*", "", line).encode("ascii", "replace").decode() for line in request.lines]
    lines = [" ".join(line.split()).replace("??", "?") for line in lines]  # no end of comment, no trigraphs
    robot = _identifier(request.result.robot)
    code = _code("p->{}", "FRICTION_F({})(", "FRICTION_F(fabs)(")
    return _template("friction.h.j2").render(lines=lines, robot=robot, joints=rows, names=list(NUMBERS), **code)


def python_text(request: Request) -> str:
    """Format a Python module with the friction of the joints and its compensation, for NumPy and torch."""
    joints = {name: _with_confidence(request, name) for name in request.joints}
    return _module("python", request.lines, joints=joints, **_code('p["{}"]', "xp.{}(", "abs("))


def pinocchio_text(request: Request) -> str:
    """Format a Python module that sets friction and rotor inertias of a Pinocchio model."""
    return _module("pinocchio", request.lines, joints=_stated(request))


def usd_text(request: Request) -> str:
    """Format a Python module that sets friction and rotor inertias of an OpenUSD stage."""
    return _module("usd", request.lines, joints=_stated(request))


def _stated(request: Request) -> dict[str, dict[str, float]]:
    return {name: {word: value for word, (value, _) in own.stated.items()} for name, own in request.joints.items()}


def isaaclab_text(request: Request) -> str:
    """Format a Python module with actuators for Isaac Lab.

    Isaac Lab uses zero for joints that are missing in a dictionary of their group, so all joints of a group have the
    same keys. Since Isaac Sim 5.0 (PhysX 5.6), `friction` and `dynamic_friction` are efforts [N m], [N], and
    `viscous_friction` is in [N m s/rad], [N s/m]; before, `friction` was a coefficient without a unit.
    """
    groups: dict[tuple[str, ...], dict[str, dict[str, float]]] = defaultdict(dict)
    for name, values in _actuators(request, "effort_limit_sim").items():
        groups[tuple(sorted(values))][re.escape(name)] = values
    actuators: list[dict[str, object]] = [
        {"joint_names_expr": [*joints]} | {word: {name: own[word] for name, own in joints.items()} for word in words}
        for words, joints in groups.items()
    ]
    return _module("isaaclab", request.lines, groups=actuators)


def mjlab_text(request: Request) -> str:
    """Format a Python module with actuators for mjlab, one per joint, because an actuator has one value per setting."""
    return _module("mjlab", request.lines, joints=_actuators(request, "effort_limit"))


def _actuators(request: Request, effort: str) -> dict[str, dict[str, float]]:
    """Collect each joint's stated values, and the model's effort limit [N m], [N] under the name `effort`."""
    limits = dict(zip(request.robot.joint_names, request.robot.effort_limits.tolist(), strict=True))
    stated = _stated(request)
    return {name: own | ({effort: limits[name]} if np.isfinite(limits[name]) else {}) for name, own in stated.items()}


def isaaclab_ranges(lines: list[str], joints: Mapping[str, JointRanges]) -> str:
    """Format a Python module with Isaac Lab events that draw from the ranges."""
    return _module(
        "isaaclab_ranges",
        lines,
        ranges={name: own.numbers for name, own in joints.items()},
        scales={name: own.friction for name, own in joints.items() if own.friction},
        patterns={name: re.escape(name) for name in joints},
    )


def mujoco_ranges(lines: list[str], joints: Mapping[str, JointRanges]) -> str:
    """Format a Python module with ranges by degree of freedom, for MuJoCo, MJX and Playground."""
    fields = {name: {f"dof_{word}": ends for word, ends in own.numbers.items()} for name, own in joints.items()}
    return _module("mujoco_ranges", lines, ranges=fields)


def bam_text(request: Request) -> str:
    """Format parameters of BAM's model M4 as JSON, by joint.

    Its friction is (friction_base + friction_stribeck exp(-(|v| / dtheta_stribeck)^alpha) + load_friction_base |tau_e -
    tau_m|) sign(v) + friction_viscous v; external and motor torque are opposite without acceleration.
    """
    none = dict.fromkeys(("friction_base", "friction_viscous", "friction_stribeck", "load_friction_base"), 0.0)
    fixed = {"model": "m4", "alpha": 2.0, "load_friction_stribeck": 0.0, "dtheta_stribeck": 1.0}
    joints = {name: fixed | none | own for name, own in _stated(request).items()}
    return json.dumps({"written": request.lines, "joints": joints}, indent=2) + "\n"


def yaml_text(request: Request) -> str:
    """Format the values of each joint as YAML: of the function above, or of the form "plain"."""
    lines = [f"robot: {_quoted(request.result.robot)}", "joints:"]
    for name, terms in request.joints.items():
        joint = request.result.joints[name]
        lines += [f"  {_quoted(name)}:", f"    verdict: {joint.verdict}"]
        lines += [f"    torque_unit: {joint.torque_unit}"] * (joint.torque_unit is not None)
        lines += _entries({"mean_temperature": joint.mean_temperature}) * (joint.mean_temperature is not None)
        plain = {word: value for word, (value, _) in terms.stated.items()}
        lines += _entries(plain if request.forms[name] == "plain" else numbers_of(joint, terms.beyond))
    return _below_comments(request.lines, lines)


def yaml_ranges(lines: list[str], joints: Mapping[str, JointRanges]) -> str:
    """Format the lowest and highest values of the form "plain" as YAML."""
    body = ["joints:"]
    for name, own in joints.items():
        body += [f"  {_quoted(name)}:", *_entries(own.numbers)]
    return _below_comments(lines, body)


def table_text(request: Request) -> str:
    """Format a CSV table: joint, velocity, friction torque without the offset at the log's mean load."""
    lines = ["# friction [N m] or [N] without the offset, at the log's mean load; velocity [rad/s] or [m/s]"]
    lines += ["joint,velocity,friction"]
    denser = 3.0  # exponent of the spacing: speeds are denser near standstill
    shape = np.expm1(denser * np.arange(101) / 100) / np.expm1(denser)
    for name in request.joints:
        joint = request.result.joints[name]
        velocity = top_speed(joint) * np.concatenate([-shape[:0:-1], shape])
        shown = f"'{name}" if name.startswith(("=", "+", "-", "@")) else name  # spreadsheets would evaluate it
        quoted = '"' + shown.replace('"', '""') + '"' if set(shown) & set(',"\r\n') else shown
        rows = zip(velocity.tolist(), joint.friction(velocity).tolist(), strict=True)
        lines += [f"{quoted},{v:.9g},{friction:.9g}" for v, friction in rows]
    return _below_comments(request.lines, lines)


def _with_confidence(request: Request, name: str) -> dict[str, float]:
    """Collect a joint's values, the compensated share of its friction, and the log's mean temperature [°C].

    Half of weak friction is compensated, because overcompensation would drive the joint.
    """
    joint = request.result.joints[name]
    share = 0.5 if joint.verdict == "weak" else 1.0
    numbers = numbers_of(joint, request.joints[name].beyond)
    return numbers | {"confidence": share, "mean_temperature": joint.mean_temperature or 0.0}


def _identifier(name: str) -> str:
    """Convert a name to a capitalized ASCII identifier."""
    return re.sub(r"[^0-9A-Z]+", "_", name.upper()).strip("_") or "ROBOT"


def _module(template: str, lines: Iterable[str], **values: object) -> str:
    """Format a Python module from a template; its docstring contains the lines, escaped."""
    head = [" ".join(line.split()).replace("\\", "/").replace('"', "'") for line in lines]
    return _template(f"{template}.py.j2").render(lines=head, dictionary=_dictionary, **values)


def _dictionary(name: str, entries: Mapping[str, object]) -> str:
    """Format a Python dictionary with one line per entry."""
    return "\n".join([f"{name} = {{", *(f"    {key!r}: {own!r}," for key, own in entries.items()), "}"])


@cache
def _template(name: str) -> Template:
    loader = FileSystemLoader(Path(__file__).parent / "templates")
    environment = Environment(  # source code, not HTML  # nosec B701
        loader=loader, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    return environment.get_template(name)


def _entries(numbers: Mapping[str, object]) -> list[str]:
    """Format numbers and lists of numbers as YAML 1.1, whose numbers with an exponent need a point."""
    texts = {key: re.sub(r"(?<![.0-9])([0-9]+)e", r"\1.0e", json.dumps(value)) for key, value in numbers.items()}
    return [f"    {key}: {text}" for key, text in texts.items()]


def _quoted(text: str) -> str:
    """Quote a name for YAML; JSON's pairs of surrogates would be read as two characters."""
    plain = (letter if letter.isascii() and letter.isprintable() else f"\\U{ord(letter):08x}" for letter in text)
    return '"' + "".join("\\" * (letter in '"\\') + letter for letter in plain) + '"'


def _below_comments(head: Iterable[str], lines: list[str]) -> str:
    """Format lines below a head of comments, without characters that YAML forbids."""
    plain = ("".join(letter if letter.isprintable() else " " for letter in line) for line in head)
    return "\n".join([*(f"# {' '.join(line.split())}" for line in plain), *lines]) + "\n"
