"""A lookup table: the friction of a robot's joints over velocity, as CSV."""

import numpy as np

from stribeck.export.forms import top_speed
from stribeck.export.target import Request, Target

HALF, DENSER = 100, 3.0
"""Speeds in each direction [1], and by how many powers of e they lie denser at standstill than at the top speed."""


def table_text(request: Request) -> str:
    """Return the table: joint, velocity, friction torque without the offset at the log's mean load."""
    lines = [f"# {' '.join(line.split())}" for line in request.lines]
    lines += ["# friction [N m] or [N] without the offset, at the log's mean load; velocity [rad/s] or [m/s]"]
    lines += ["joint,velocity,friction"]
    shape = np.expm1(DENSER * np.arange(HALF + 1) / HALF) / np.expm1(DENSER)
    for name in request.joints:
        joint = request.result.joints[name]
        velocity = top_speed(joint) * np.concatenate([-shape[:0:-1], shape])
        offset = joint.parameters["offset"].value if "offset" in joint.parameters else 0.0
        quoted = '"' + name.replace('"', '""') + '"' if set(name) & set(',"\n') else name
        rows = zip(velocity.tolist(), (joint.friction(velocity) - offset).tolist(), strict=True)
        lines += [f"{quoted},{v:.9g},{friction:.9g}" for v, friction in rows]
    return "\n".join(lines) + "\n"


TARGET = Target(title="a lookup table over velocity, as CSV", forms={"all": None}, suffix=".csv", text=table_text)
