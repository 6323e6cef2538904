"""Payloads that a fixed-base robot carries in spans of its logs: their joint torques, and entries of a robot file."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from stribeck.core.base.finding import rounded
from stribeck.core.base.spans import Span, outward, spans_of_log
from stribeck.core.dynamics.rooted import rooted_inverse_dynamics
from stribeck.core.log import RobotLog
from stribeck.core.log.sampling import Sampling
from stribeck.core.robot import Robot
from stribeck.core.robot.rooting import RootedModel
from stribeck.core.settings import PayloadTable

MARGIN = 0.25
"""Time that is excluded before and after a disturbance or a change of a payload [s]; spans are known to about 0.1 s."""


def payload_entry(link: str, mass: float, com: Sequence[float], spans: Sequence[Span]) -> dict[str, Any]:
    """Make an entry of `[[robot.payload]]` from mass [kg], center of mass [m] and spans, rounded outward."""
    ends = [(*([span.log] if span.log else []), *outward(span)) for span in spans]
    return {"link": link, "mass": rounded(mass, 4), "com": [round(x, 4) + 0.0 for x in com], "spans": ends}


def changes_of_payload(robot: Robot, path: str) -> list[Span]:
    """List the times around the changes of the payloads in a log."""
    spans = [span for payload in robot.payloads for span in spans_of_log(payload.spans, path)]
    return [Span(max(0.0, time - MARGIN), time + MARGIN) for span in spans for time in span[:2]]


def with_payloads(log: RobotLog, robot: Robot, sampling: Sampling) -> RobotLog:
    """Add the torques of the payloads to the external torques: minus the inverse dynamics of the payloads.

    The segments of `sampling` must not extend over a change of payload.
    """
    if not robot.payloads:
        return log
    from scipy.signal import savgol_filter  # slow to import

    duration = 0.1  # length of the filter for accelerations [s]: shorter than a motion, long against encoder noise
    external = np.zeros_like(log.torque) if log.external_torque is None else log.external_torque.copy()
    for payload in robot.payloads:
        tree = _payload_tree(robot, payload)
        for part in sampling.segments:
            if payload.present(float(log.time[(part.start + part.stop) // 2]) - log.start, log.path):
                window = min(round(duration / sampling.period), part.stop - part.start - 1) // 2 * 2 + 1
                order = min(4, window - 1)
                position, velocity, acceleration = (
                    savgol_filter(log.position[part], window, order, deriv=k, delta=sampling.period, axis=0)
                    for k in range(3)
                )
                external[part] -= rooted_inverse_dynamics(tree, position, velocity, acceleration)[1]
    return replace(log, external_torque=external)


def _payload_tree(robot: Robot, payload: PayloadTable) -> RootedModel:
    """Build a tree without other masses than the payload."""
    model = pin.Model(robot.tree.model)
    frame = model.frames[model.getFrameId(payload.link)]
    for joint in range(model.njoints):
        model.inertias[joint] = pin.Inertia.Zero()
    point = pin.Inertia(payload.mass, np.array(payload.com), np.zeros((3, 3)))
    model.inertias[frame.parentJoint] = frame.placement.act(point)
    model.armature = np.zeros(model.nv)
    return replace(robot.tree, model=model)
