"""Step adjustment: after a push that would tip the robot over its standing foot, the swing foot steps farther.

While a foot swings, an error e of the DCM grows as exp(w t). The center of pressure reduces the error by moving up to d
from the middle of the sole; the error at touchdown, after a time t, is `e exp(w t) - d (exp(w t) - 1)`. If the next
sole cannot compensate for this error, the step becomes longer, and all later steps shift with it. The DCM for the new
step is computed backward in time, as in the plan.
"""

from dataclasses import dataclass
from math import copysign, exp

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.walking.plan import BOTH, Plan, Stretch, plan_dcm

LEFT = 0.3
"""Share of the next sole that compensates for a remaining error [1]."""
REACH = (0.25, 0.2)
"""Largest change of a step, forward and sideways [m]."""
GAP = 0.03
"""Minimum gap between feet side by side [m]."""
LAST = 0.8
"""Share of the swing after which the foot's goal is fixed [1]."""
SPEED = 1.0
"""Speed of a moving goal [m/s]."""


@dataclass(frozen=True, eq=False)
class Shift:
    """Shift of the plan at one instant: ZMP, DCM and goal of the swing foot, shape (2,) each [m]."""

    zmp: Array
    dcm: Array
    goal: Array


class StepAdjuster:
    """Shift a plan, sample by sample, so that the robot does not fall.

    Parameters
    ----------
    plan
        Plan of the walk.
    soles
        Soles of the feet, in the robot's order of contacts.
    pulsation
        sqrt(g / z) of the center of mass [1/s].
    """

    def __init__(self, plan: Plan, soles: list[Sole], pulsation: float) -> None:
        self.plan, self.soles, self.pulsation = plan, soles, pulsation
        self._done, self._more = np.zeros(2), np.zeros(2)  # shift before the last step, and shift by it
        self._step, self._sample = 0, 0
        self._lead: dict[float, tuple[Array, Array]] = {}

    def shift(self, sample: int, dcm: Array) -> Shift:
        """Compute the shift of the plan for a DCM, shape (2,) [m].

        If a step changes by x, the DCM must be ahead of the plan during the swing, by the share of x that grows to x
        until the foot carries the weight. The ZMP moves to the new foothold as planned.
        """
        plan = self.plan
        elapsed, self._sample = (sample - self._sample) * plan.period, sample
        number, swings = int(plan.step[sample]), plan.swing[sample] != BOTH
        if not swings:
            zmp, lead = self._in_double_support(number, float(plan.progress[sample]))
            return Shift(self._done + zmp * self._more, self._done + lead * self._more, self._done)
        if number != self._step:
            self._done, self._more, self._step = self._done + self._more, np.zeros(2), number
        remainder = (1 - float(plan.progress[sample])) * plan.steps[number].kind.single_support
        if plan.progress[sample] < LAST and self._goes_on(number):
            change = self._wanted(number, dcm - plan.dcm[sample] - self._done, remainder) - self._more
            self._more = self._more + np.clip(change, -SPEED * elapsed, SPEED * elapsed)
        _, lead = self._in_double_support(number + 1, 0.0)
        ahead = lead * exp(-self.pulsation * remainder)
        return Shift(self._done, self._done + ahead * self._more, self._done + self._more)

    def _goes_on(self, number: int) -> bool:
        """Check whether the next step belongs to the same group and uses the same foothold."""
        steps = self.plan.steps
        return number + 1 < len(steps) and steps[number + 1].kind is steps[number].kind

    def _in_double_support(self, number: int, progress: float) -> tuple[float, float]:
        """Compute the shares of the last step's shift in ZMP and DCM while the weight moves to that foot."""
        if not 0 < number < len(self.plan.steps) or number - 1 != self._step:
            return 1.0, 1.0
        duration = self.plan.steps[number].kind.double_support
        if duration not in self._lead:
            unit = Stretch(duration, np.zeros(2), np.ones(2))
            self._lead[duration] = plan_dcm([unit], self.pulsation, duration / 100)
        zmp, lead = self._lead[duration]
        row = round(100 * progress)
        return float(zmp[row, 0]), float(lead[row, 0])

    def _wanted(self, number: int, error: Array, remainder: float) -> Array:
        """Compute the extension of the step for an error of the DCM and the time until touchdown."""
        step, sole = self.plan.steps[number], self.soles[1 - self.plan.steps[number].foot]
        if np.abs(error).max() < LEFT * min(sole.half_length, sole.half_width):
            return np.zeros(2)
        cosine, sine = np.cos(step.stance.yaw), np.sin(step.stance.yaw)
        turn = np.array([[cosine, sine], [-sine, cosine]])  # into the standing foot's coordinates
        growth = exp(self.pulsation * remainder)
        _, lead = self._in_double_support(number + 1, 0.0)
        reach = [(-REACH[0], REACH[0]), self._aside((turn @ (step.goal.place - step.stance.place))[1], sole)]
        wanted = np.zeros(2)
        sizes = (sole.half_length, sole.half_width)
        for k, (off, half, (low, high)) in enumerate(zip(turn @ error, sizes, reach, strict=True)):
            # share of the sole that is used before the step changes
            over = abs(off) * growth - 0.7 * half * (growth - 1) - LEFT * half
            wanted[k] = min(max(copysign(max(over, 0.0), off) / lead, low), high)
        return np.asarray(wanted @ turn)

    def _aside(self, apart: float, sole: Sole) -> tuple[float, float]:
        """Compute the range of the step to the right and to the left, for a goal's position to the left."""
        inwards = max(abs(apart) - 2 * sole.half_width - GAP, 0.0)
        return (-inwards, REACH[1]) if apart > 0 else (-REACH[1], inwards)
