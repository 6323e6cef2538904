"""Payloads that explain spans which the whole-log fit set aside, as `[[robot.payload]]` states them."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

import pinocchio as pin

from stribeck.base.spans import Span, listed_spans
from stribeck.base.typing import Array
from stribeck.robot import Robot
from stribeck.whole_log.equations.equation_sequence import EquationSequence
from stribeck.whole_log.estimate import WholeLogFit
from stribeck.whole_log.fit_checks.causes import find_payloads
from stribeck.whole_log.model.terms import Columns

TOOLS = ("tool", "tcp", "flange", "hand", "gripper", "end_effector", "ee_")
"""Parts of the names of links that carry payloads."""


@dataclass(frozen=True, eq=False)
class Carried:
    """Payload: link, mass [kg], center of mass in the link's frame [m], shape (3,), and spans."""

    link: str
    mass: float
    com: Array
    spans: Sequence[Span]

    def __str__(self) -> str:
        return f"{self.mass:.3g} kg at {self.link} from {listed_spans(self.spans)}"

    @property
    def table(self) -> str:
        """Inline table of TOML, with spans rounded outward to tenths of a second."""
        rounded = [(floor(10 * a) / 10, ceil(10 * b) / 10, log) for a, b, log in sorted(self.spans)]
        spans = ", ".join(f"[{json.dumps(log) + ', ' if log else ''}{a:g}, {b:g}]" for a, b, log in rounded)
        com = ", ".join(f"{value:.4f}" for value in self.com)
        return f"{{ link = {json.dumps(self.link)}, mass = {self.mass:.4g}, com = [{com}], spans = [{spans}] }}"


def find_carried(
    robot: Robot,
    equations: EquationSequence,
    fit: WholeLogFit,
    aside: Sequence[Sequence[Span]],
    starts: Sequence[float],
) -> list[Carried]:
    """Find the payloads of a tree on a fixed base, given each log's spans that are set aside, and its start [s]."""
    if robot.base != "fixed" or robot.loops:
        return []
    spans = {(k, starts[k] + each.start, starts[k] + each.end): each for k, own in enumerate(aside) for each in own}
    columns = Columns(fit.fit.laws.basis, fit.beside)
    found = []
    for payload in find_payloads(equations.delayed(fit.delay), list(spans), columns, fit.components, fit.fit.values):
        frames = [frame for frame in robot.tree.model.frames if frame.parentJoint == payload.body + 1]
        links = [frame for frame in frames if frame.type == pin.FrameType.BODY]
        link = next((frame for frame in links if any(word in frame.name.lower() for word in TOOLS)), links[0])
        own = [spans[place] for place in payload.spans]
        found.append(Carried(str(link.name), payload.mass, link.placement.actInv(payload.centre), own))
    return found
