"""Text files: a C header and a Python module with all friction terms, modules for other libraries, YAML and CSV.

C and Python evaluate one function that covers all laws:

    R = (Fc rise + Fc' |rise|) (1 + S exp(-(|v| / vs)^delta)) + Fv v + Fv' |v| + terms,   rise = tanh(a v)

with the terms of `stribeck.core.friction.terms` that depend on load, temperature and position. Above the top speed of a
slow joint, v is clipped to that speed, and R grows linearly with the slope of `beyond`. The offset is stored, but not
part of R.
"""

import json
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache

import numpy as np
from jinja2 import Environment

from stribeck.app.exporters.beyond import Beyond, top_speed
from stribeck.app.exporters.targets import Request
from stribeck.app.templates import environment
from stribeck.core.errors import SettingsError
from stribeck.core.friction.auto import JUMP
from stribeck.core.friction.terms import LADDER
from stribeck.core.result import JointResult

FORMULAS = ("asymmetric", "auto", "coulomb-viscous", "lugre", "stribeck", "stribeck-exponent")
"""Laws that the function covers; for LuGre, the friction of steady sliding."""

SOLREFFRICTION = (0.001, 1.0)
"""MuJoCo's time constant [s] and damping ratio [1] of dry friction: two simulation steps, as these are longer."""

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
    values = joint.values
    numbers = NUMBERS | dict(zip(("lowest", "highest"), joint.position_range or (), strict=False))
    if joint.verdict == "no friction":
        return numbers | {"offset": values.get("offset", 0.0)}
    if joint.law not in FORMULAS:
        raise SettingsError(f"export: no formula for law '{joint.law}'; expected one of {', '.join(FORMULAS)}")
    numbers |= {name: value for name, value in values.items() if name in NUMBERS}
    if "viscous_asymmetry" in values:
        numbers["viscous_difference"] = values["viscous"] * values["viscous_asymmetry"]
    if "viscous_positive" in values:
        for name in ("viscous", "coulomb"):
            forward, backward = values[f"{name}_positive"], values[f"{name}_negative"]
            numbers |= {name: (forward + backward) / 2, f"{name}_difference": (forward - backward) / 2}
    if joint.mean_direction:
        numbers |= {"mean_cosine": joint.mean_direction[0], "mean_sine": joint.mean_direction[1]}
    if beyond:
        numbers |= {"top_speed": beyond.top, "viscous_beyond": beyond.slope}
    return numbers | {name: getattr(joint, name) or 0.0 for term in OF_TERMS for name in term.settings}


def _code_of(parameter: str, function: str, absolute: str) -> dict[str, str]:
    """Format the friction of the terms over position, and of all others, for templates of C and Python.

    `parameter` and `function` are patterns of the language; `absolute` is its function for absolute values.
    """
    sums = {"steady": "", "over_position": ""}
    for term in OF_TERMS:
        known = "|".join(("mean_cosine", "mean_sine", *term.settings))
        for name, column in zip(term.names, term.columns, strict=True):
            code = re.sub(
                rf"\b({known})\b", lambda word: parameter.format(word[1]), column.replace("velocity", "within")
            )
            code = re.sub(r"\b(?!abs)([a-z]+)\(", lambda word: function.format(word[1]), code).replace("abs(", absolute)
            sums["over_position" if term.over == "position" else "steady"] += (
                f"\n        + {parameter.format(name)} * {code}"
            )
    return sums


def file_text(template: str, request: Request) -> str:
    """Format the file of a target from its template."""

    def compensated(name: str) -> dict[str, float]:
        """Collect a joint's values, the compensated share of its friction, and the log's mean temperature [°C].

        Half of weak friction is compensated, because overcompensation would drive the joint.
        """
        joint = request.result.joints[name]
        share = 0.5 if joint.verdict == "weak" else 1.0
        more = {"confidence": share, "mean_temperature": joint.mean_temperature or 0.0}
        return numbers_of(joint, request.joints[name].beyond) | more

    def actuators(effort: str) -> dict[str, dict[str, float]]:
        """Collect the values, gains, delay [s] and effort limit, named `effort`, of each joint with a motor.

        A joint has what the result states, the robot file's gains, and the model's limit, where known. Delays are those
        of interpolated commands; held ones, as in simulators, act half a period of the log earlier.
        """
        robot, motors = request.robot, {}
        empty = np.full(len(robot.joint_names), np.nan)
        kp, kd = robot.command_gains or (empty, empty)
        known_delays = empty if robot.command_delay is None else robot.command_delay
        delays = dict(zip(robot.joint_names, known_delays, strict=True))
        if request.result.corrections:
            delays |= {name: delay for name, (delay, _) in request.result.corrections.command_delay.items()}
        for k, name in enumerate(robot.joint_names):
            drive = {"stiffness": kp[k], "damping": kd[k]} if kp[k] > 0 else {}
            delay = np.round(np.maximum(delays[name] - 0.5 / request.result.log.rate, 0.0), 5)
            known = drive | {"delay": delay, effort: robot.effort_limits[k]}
            if name not in robot.passive:
                numbers = {word: float(value) for word, value in known.items() if np.isfinite(value)}
                motors[name] = request.numbers(name) | numbers
        return motors

    return rendered(template, **vars(request), compensated=compensated, actuators=actuators)


def rendered(template: str, **values: object) -> str:
    """Render a template of this package."""
    return _environment().get_template(f"{template}.j2").render(**values)


@cache
def _environment() -> Environment:
    formats = (_docstring, _comments, _c_comment, _identifier, _yaml, _quoted, _cell)
    filters = {"repr": repr, "json": json.dumps, "pattern": re.escape} | {f.__name__[1:]: f for f in formats}
    files = environment("stribeck.app.exporters", filters, keep_trailing_newline=True)
    functions = (_code_of, _curve_of, _groups_of, _identifiers)
    files.globals |= {function.__name__[1:]: function for function in functions}
    files.globals |= {"numbers_of": numbers_of, "NUMBERS": NUMBERS, "SOLREFFRICTION": SOLREFFRICTION}
    return files


def _groups_of(actuators: Mapping[str, Mapping[str, float]]) -> list[dict[str, object]]:
    """Group actuators by their keys and delay, because Isaac Lab uses zero for joints missing in a dictionary.

    Since Isaac Sim 5.0 (PhysX 5.6), `friction` and `dynamic_friction` are efforts [N m], [N], and `viscous_friction` is
    in [N m s/rad], [N s/m]; before, `friction` was a coefficient without a unit.
    """
    groups: dict[tuple[object, ...], dict[str, Mapping[str, float]]] = defaultdict(dict)
    for name, values in actuators.items():
        groups[(*sorted(values), values.get("delay"))][re.escape(name)] = values
    entries: list[dict[str, object]] = []
    for joints in groups.values():
        first, *_ = joints.values()
        words = {word: {name: numbers[word] for name, numbers in joints.items()} for word in sorted(first)}
        delay = {"delay": first["delay"]} if "delay" in first else {}
        entries.append({"joint_names_expr": [*joints], **words, **delay})
    return entries


def _curve_of(joint: JointResult) -> Iterator[tuple[float, float]]:
    """Evaluate the friction up to the top speed in both directions; speeds are denser near standstill."""
    denser = 3.0  # exponent of the spacing
    shape = np.expm1(denser * np.arange(101) / 100) / np.expm1(denser)
    velocity = top_speed(joint) * np.concatenate([-shape[:0:-1], shape])
    return zip(velocity.tolist(), joint.friction(velocity).tolist(), strict=True)


def _identifiers(names: Iterable[str]) -> dict[str, str]:
    """List names by their identifiers in C."""
    identifiers: dict[str, str] = {}
    for name in names:
        word = _identifier(name)
        if (other := identifiers.setdefault(word, name)) != name:
            raise SettingsError(f"export: joints '{other}' and '{name}' have the same identifier {word}; rename one")
    return identifiers


def _identifier(name: str) -> str:
    """Convert a name to a capitalized ASCII identifier."""
    return re.sub(r"[^0-9A-Z]+", "_", name.upper()).strip("_") or "ROBOT"


def _docstring(lines: Iterable[str]) -> str:
    """Format lines of a Python docstring."""
    return "\n".join(" ".join(line.split()).replace("\\", "/").replace('"', "'") for line in lines)


def _comments(lines: Iterable[str]) -> str:
    """Format lines as comments of YAML or CSV, without characters that YAML forbids."""
    plain = ("".join(letter if letter.isprintable() else " " for letter in line) for line in lines)
    return "\n".join(f"# {' '.join(line.split())}" for line in plain)


def _c_comment(line: str) -> str:
    """Format a line of a C comment, without comment marks and trigraphs."""
    plain = re.sub(r"\*/|/\*", "", line).encode("ascii", "replace").decode()
    return " ".join(plain.split()).replace("??", "?")


def _yaml(value: object) -> str:
    """Format a number or numbers as YAML 1.1, whose numbers with an exponent need a point."""
    return re.sub(r"(?<![.0-9])([0-9]+)e", r"\1.0e", json.dumps(value))


def _quoted(text: str) -> str:
    """Quote a name for YAML; JSON's pairs of surrogates would be read as two characters."""
    plain = (letter if letter.isascii() and letter.isprintable() else f"\\U{ord(letter):08x}" for letter in text)
    return '"' + "".join("\\" * (letter in '"\\') + letter for letter in plain) + '"'


def _cell(name: str) -> str:
    """Quote a name for CSV where needed, and mark names that spreadsheets would evaluate as formulas."""
    shown = f"'{name}" if name.startswith(("=", "+", "-", "@")) else name
    return '"' + shown.replace('"', '""') + '"' if set(shown) & set(',"\r\n') else shown
