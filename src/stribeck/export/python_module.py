"""A Python module with the friction of a robot's joints: for NumPy, and for torch as it is."""

from stribeck.export.c_header import FADED
from stribeck.export.numbers import numbers_of
from stribeck.export.python_text import docstring
from stribeck.export.target import Request, Target

MODULE = '''
import numpy

JOINTS = {{
{rows}
}}
"""Joint -> numbers of the function below; `confidence` is the share that is compensated, by the joint's verdict,
`mean_temperature` that of the log [deg C], 0 if none was logged."""


def friction_torque(joint, velocity, load=0.0, temperature=0.0, position=None, xp=numpy):
    """Return the friction torque of a joint [N m], of a prismatic one [N]; offset included.

    Positive for positive velocity. velocity [rad/s], [m/s]; load: torque that the joint carries without friction [N m];
    temperature: above the joint's `mean_temperature` [K]; position [rad], if None the mean over the log's. Arrays of
    NumPy, or, with `xp=torch`, tensors.
    """
    p = JOINTS[joint]
    speed, rise = abs(velocity), xp.tanh(p["slope"] * velocity)
    bell = xp.exp(-((speed / p["stribeck_velocity"]) ** p["exponent"]))
    level = p["coulomb"] * rise + p["coulomb_difference"] * abs(rise)
    more = p["load"] * abs(load) + p["coulomb_per_kelvin"] * temperature
    viscous = p["viscous"] + p["viscous_per_kelvin"] * temperature
    found = level * (1 + p["stribeck_gain"] * bell) + more * rise + viscous * velocity
    found = found + p["viscous_difference"] * speed + p["offset"]
    if position is None:
        return found
    near = xp.clip(position, p["lowest"], p["highest"])  # where the log has been
    turned = p["coulomb_cosine"] * (xp.cos(near) - p["mean_cosine"])
    turned = turned + p["coulomb_sine"] * (xp.sin(near) - p["mean_sine"])
    angle = p["ripple_per_turn"] * position
    return found + turned * rise + p["ripple_cosine"] * xp.cos(angle) + p["ripple_sine"] * xp.sin(angle)


class Compensation:
    """Torque to add to a joint's command, step by step.

    The offset is not compensated: it is the sensor's, or a spring's. At rest the measured velocity is noise, and its
    sign would drive a limit cycle, so that the desired one counts there, with a dead zone and hysteresis.

    gain: below one, what is left of the friction damps [1]; near: measured speed below which the desired velocity
    counts instead; dead_zone: desired speed below which a joint at rest gets nothing; release: the same of a moving
    joint, smaller [rad/s]; fade: time in which it comes and goes [s]; limit: largest torque [N m].
    """

    def __init__(self, joint, gain=0.8, near=0.05, dead_zone=0.02, release=0.01, fade=0.02, limit=numpy.inf):
        self.joint, self.gain, self.near, self.dead_zone = joint, gain, near, dead_zone
        self.release, self.fade, self.limit = release, fade, limit
        self.moving, self.share = False, 0.0

    def torque(self, measured, desired, period, load=0.0, temperature=0.0):
        """Return the torque of one step [N m], from measured and desired velocity [rad/s], every `period` [s]."""
        p = JOINTS[self.joint]
        rest = numpy.exp(-((measured / self.near) ** 2))
        velocity = rest * desired + (1 - rest) * measured
        self.moving = abs(desired) > (self.release if self.moving else self.dead_zone)
        self.share += period / (self.fade + period) * (self.moving - self.share)
        friction = friction_torque(self.joint, velocity, load, temperature) - p["offset"]
        torque = self.gain * p["confidence"] * self.share * friction
        return min(max(torque, -self.limit), self.limit)
'''


def python_text(request: Request) -> str:
    """Return the module."""
    rows = []
    for name in request.joints:
        joint = request.result.joints[name]
        numbers = numbers_of(joint) | {
            "confidence": FADED if joint.verdict == "weak" else 1.0,
            "mean_temperature": joint.mean_temperature or 0.0,
        }
        rows.append(f"    {name!r}: {numbers!r},")
    return docstring(request.lines) + MODULE.format(rows="\n".join(rows))


TARGET = Target(title="a Python module, for NumPy and torch", forms={"all": None}, suffix=".py", text=python_text)
