"""Causes of spans that the whole-log fit set aside: payloads for `[[robot.payload]]`, forces and rubbing joints."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from stribeck.core.base.spans import MOST, Span, listed_spans
from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.payload import payload_entry
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.fit_checks.payloads import Payload, find_payloads, residual_in
from stribeck.core.identify.forces import Force, find_force
from stribeck.core.robot import Robot
from stribeck.core.robot.kinematics import link_of

FEW = 0.01
"""Share of windows that are set aside [1] from which a warning is given."""


@dataclass(frozen=True, eq=False)
class Carried:
    """Payload: link, mass [kg], center of mass in its frame [m], shape (3,), its spans, and those set aside for it."""

    link: str
    mass: float
    com: Array
    spans: Sequence[Span]
    aside: Sequence[Span]

    def __str__(self) -> str:
        return f"{self.mass:.3g} kg at {self.link} from {listed_spans(self.spans)}"

    @property
    def table(self) -> dict[str, Any]:
        """Entry of `[[robot.payload]]`."""
        return payload_entry(self.link, self.mass, self.com.tolist(), sorted(self.spans))


@dataclass(frozen=True, eq=False, kw_only=True)
class CausesOfSpans:
    """Causes of the spans that a fit set aside.

    Attributes
    ----------
    carried
        Payloads that explain spans.
    words
        Words on the cause of other spans, if it is clear.
    rubbing, rubbed
        Place where a joint rubs, e.g. "near 0.65 rad", by joint, and the spans in which one does.
    """

    carried: Sequence[Carried] = ()
    words: Mapping[Span, str] = field(default_factory=dict)
    rubbing: Mapping[str, str] = field(default_factory=dict)
    rubbed: Collection[Span] = ()


def find_causes_of_spans(fit: WholeLogFit) -> CausesOfSpans:
    """Find the causes of spans for a tree on a fixed base, if more than a few windows are set aside."""
    robot = fit.robot
    if robot.base != "fixed" or robot.loops or fit.read.set_aside <= FEW:
        return CausesOfSpans()
    starts, aside = [form.log.start for form in fit.read.equations.forms], fit.read.spans(used=False)
    spans = {(k, starts[k] + span.start, starts[k] + span.end): span for k, cuts in enumerate(aside) for span in cuts}
    delayed = fit.read.equations.delayed(fit.delay)
    residuals = {place: residual_in(delayed, place, fit.read, fit.fit.values) for place in spans}
    carried = _carried(robot, find_payloads(residuals), spans, list(chain(*fit.read.spans(used=True))))
    explained = {span for payload in carried for span in payload.aside}
    others = {place: span for place, span in spans.items() if span not in explained}
    causes: dict[Span, str] = {}
    alone: dict[int, dict[Span, Array]] = {}
    for place in sorted(others, key=lambda place: place[1] - place[2])[:MOST]:
        form, residual = delayed.forms[place[0]], residuals[place]
        position = np.column_stack([np.interp(residual.time, form.log.time, signal) for signal in form.log.position.T])
        if force := find_force(robot.tree, form.joints, position, residual):
            rows = (form.log.time > residual.time[0]) & (form.log.time < residual.time[-1])
            column = int(form.joints[force.joint])
            causes[spans[place]], only = _words(robot, column, force, form.log.torque[rows, column])
            if only:
                alone.setdefault(column, {})[spans[place]] = np.percentile(position[:, column], [10, 90])
    rubbing: dict[str, str] = {}
    rubbed: set[Span] = set()
    for column, ranges in alone.items():
        travel = max(float(np.ptp(form.log.position[:, column])) for form in delayed.forms)
        low, high = max(bounds[0] for bounds in ranges.values()), min(bounds[1] for bounds in ranges.values())
        if len(ranges) > 2 and low < high < low + 0.5 * travel:
            name, unit = robot.joint_names[column], "m" if robot.prismatic[column] else "rad"
            rubbing[name] = f"near {(low + high) / 2:.2g} {unit}"
            rubbed |= ranges.keys()
            causes |= dict.fromkeys(ranges, f"{name} rubs {rubbing[name]}")
    return CausesOfSpans(carried=carried, words=causes, rubbing=rubbing, rubbed=rubbed)


def _words(robot: Robot, column: int, force: Force, torque: Array) -> tuple[str, bool]:
    """Name a force and its link, or the joint whose torque is wrong, given the joint's torques in the span [N m].

    The second value states whether only this torque disagrees although it is not clipped.
    """
    if force.size is None:
        name, magnitude = robot.joint_names[column], np.abs(torque)
        clipped = np.mean(magnitude == magnitude.max()) > 0.02  # share of samples exactly at the largest torque
        return f"the torque of {name} is clipped" if clipped else f"only the torque of {name} disagrees", not clipped
    joint = 1 + int(np.argsort(robot.tree.columns)[column])
    return f"a force of about {float(f'{force.size:.2g}'):g} N on {link_of(robot.tree, joint).name}", False


def _carried(
    robot: Robot, payloads: Sequence[Payload], spans: Mapping[tuple[int, float, float], Span], used: Sequence[Span]
) -> list[Carried]:
    """Place payloads in the frames of links; what no robot carries, too heavy or too far away, has another cause.

    `used` are the spans that are not set aside: they carry a payload that `spans` lack.
    """
    carried = []
    model = robot.tree.model
    farthest = max([0.5, *(float(np.linalg.norm(place.translation)) for place in model.jointPlacements)])  # [m]
    for payload in payloads:
        link = link_of(robot.tree, payload.body + 1)
        payload_spans, center = [spans[place] for place in payload.spans], link.placement.actInv(payload.centre)
        if abs(payload.mass) < sum(body.mass for body in model.inertias) and np.linalg.norm(center) < farthest:
            there = payload_spans if payload.mass > 0 else used
            carried.append(Carried(str(link.name), abs(payload.mass), center, there, payload_spans))
    return carried
