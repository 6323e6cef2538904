"""YAML with all that was found of a robot's joints: for programs of one's own."""

import json

from stribeck.export.numbers import numbers_of
from stribeck.export.target import Request, Target


def yaml_text(request: Request) -> str:
    """Return the file: the lines of its head as comments, then the numbers of each joint."""
    lines = [f"# {' '.join(line.split())}" for line in request.lines]
    lines += [f"robot: {json.dumps(request.result.robot)}", "joints:"]
    for name in request.joints:
        joint = request.result.joints[name]
        lines += [f"  {json.dumps(name)}:", f"    verdict: {joint.verdict}"]
        lines += [f"    mean_temperature: {joint.mean_temperature}"] * (joint.mean_temperature is not None)
        lines += [f"    {key}: {json.dumps(value)}" for key, value in numbers_of(joint).items()]
    return "\n".join(lines) + "\n"


TARGET = Target(title="YAML, for programs of one's own", forms={"all": None}, suffix=".yaml", text=yaml_text)
