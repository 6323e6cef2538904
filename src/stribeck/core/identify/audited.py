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
    delay, long = result.corrections and result.corrections.torque_delay, 0.02  # delay that only a long one leaves [s]
    kept = [finding for finding in audited if finding.check not in refined]
    if logs == 1 and delay:
        kept = [f for f in kept if f.check != "torque-delay" or (f.doubt and abs(delay[0]) < long)]
    left_out = set()
    if any(finding.gains for finding in audited):
        left_out = {"torque-gain", "torque-scale", "several-causes", "bodies-differ", "bodies-implausible"}
    distorted = any(finding.has("distorts") for finding in audited)
    fitted = [f for f in result.findings if not distorted or (f.has("symptom") and not f.doubt)]
    return [*kept, *(finding for finding in fitted if finding.check not in left_out)]


def model_findings(robot: Robot) -> list[Finding]:
    """Report unusual properties of the robot's model, independent of the log."""
    return [Finding.of("robot-model", text=text) for text in robot.warnings]
