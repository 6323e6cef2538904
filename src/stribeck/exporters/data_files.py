"""Numbers as data: YAML, and a lookup table as CSV."""

import json
from collections.abc import Iterable, Mapping

import numpy as np

from stribeck.exporters.beyond import top_speed
from stribeck.exporters.code_files import numbers_of
from stribeck.exporters.ranges import JointRanges
from stribeck.exporters.target import Request


def yaml_text(request: Request) -> str:
    """Format the values of each joint as YAML: of the function in `code_files`, or of the form "plain"."""
    lines = [f"robot: {json.dumps(request.result.robot)}", "joints:"]
    for name, terms in request.joints.items():
        joint = request.result.joints[name]
        lines += [f"  {json.dumps(name)}:", f"    verdict: {joint.verdict}"]
        lines += [f"    torque_unit: {joint.torque_unit}"] * (joint.torque_unit is not None)
        lines += [f"    mean_temperature: {joint.mean_temperature}"] * (joint.mean_temperature is not None)
        plain = {word: value for word, (value, _) in terms.stated.items()}
        lines += _entries(plain if request.form == "plain" else numbers_of(joint, terms.beyond))
    return _text(request.lines, lines)


def yaml_ranges(lines: list[str], joints: Mapping[str, JointRanges]) -> str:
    """Format the lowest and highest values of the form "plain" as YAML."""
    body = ["joints:"]
    for name, own in joints.items():
        body += [f"  {json.dumps(name)}:", *_entries(own.numbers)]
    return _text(lines, body)


def table_text(request: Request) -> str:
    """Format a CSV table: joint, velocity, friction torque without the offset at the log's mean load."""
    lines = ["# friction [N m] or [N] without the offset, at the log's mean load; velocity [rad/s] or [m/s]"]
    lines += ["joint,velocity,friction"]
    denser = 3.0  # exponent of the spacing: speeds are denser near standstill
    shape = np.expm1(denser * np.arange(101) / 100) / np.expm1(denser)
    for name in request.joints:
        joint = request.result.joints[name]
        velocity = top_speed(joint) * np.concatenate([-shape[:0:-1], shape])
        quoted = '"' + name.replace('"', '""') + '"' if set(name) & set(',"\n') else name
        rows = zip(velocity.tolist(), joint.friction(velocity).tolist(), strict=True)
        lines += [f"{quoted},{v:.9g},{friction:.9g}" for v, friction in rows]
    return _text(request.lines, lines)


def _entries(numbers: Mapping[str, object]) -> list[str]:
    return [f"    {key}: {json.dumps(value)}" for key, value in numbers.items()]


def _text(head: Iterable[str], lines: list[str]) -> str:
    """Format lines below a head of comments."""
    return "\n".join([*(f"# {' '.join(line.split())}" for line in head), *lines]) + "\n"
