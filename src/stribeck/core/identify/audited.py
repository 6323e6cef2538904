"""Findings of the audit: joints that they exclude, and their combination with the findings of the fit."""

from collections.abc import Sequence
from dataclasses import replace

from stribeck.core.base.finding import Finding
from stribeck.core.result import Result
from stribeck.core.robot import Robot


def without_dead_joints(robot: Robot, audited: Sequence[Finding]) -> Robot:
    """Leave out the joints whose torque is dead or has no sign: their torque counts as unknown."""
    dead = [joint for f in audited if f.check in ("channel-dead", "torque-unsigned") for joint in f.joints]
    return replace(robot, position_controlled=(*robot.position_controlled, *dead)) if dead else robot


def reconciled(audited: Sequence[Finding], result: Result, logs: int) -> list[Finding]:
    """Combine the findings of the audit and of the fit.

    Causes that the fit finds beside wrong gains or a fault that distorts all corrections follow from it. The fit finds
    the spans that are set aside and the torque delay of one log more precisely than the audit.
    """
    refined = {"set-aside"} if {"set-aside", "payload"} & {finding.check for finding in result.findings} else set()
    delay = result.corrections.torque_delay if result.corrections and logs == 1 else None
    enough = 0.02  # smallest delay of the fit [s] that replaces a long one of the audit
    kept = [finding for finding in audited if finding.check not in refined]
    if delay:
        kept = [each for each in kept if each.check != "torque-delay" or (each.doubt and abs(delay[0]) < enough)]
    gains = any(finding.gains for finding in audited)
    left_out = {"torque-gain", "torque-scale", "several-causes", "bodies-differ", "bodies-implausible"} if gains else ()
    distorted = any(finding.has("distorts") for finding in audited)
    fitted = [each for each in result.findings if not distorted or (each.has("symptom") and not each.doubt)]
    return [*kept, *(finding for finding in fitted if finding.check not in left_out)]


def model_findings(robot: Robot) -> list[Finding]:
    """Report unusual properties of the robot's model, independent of the log."""
    return [Finding.of("robot-model", text=text) for text in robot.warnings]
