"""Whole-body control: from the robot's state and the plan to joint torques."""

from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.errors import StribeckError
from stribeck.core.robot import Robot
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.walking.balance.qp import BASE, Task, Weights, Wishes, build, solve, wrench_cone
from stribeck.simulation.walking.balance.step_adjustment import StepAdjuster
from stribeck.simulation.walking.balance.swing import Swing, swing_at
from stribeck.simulation.walking.balance.tasks import (
    Gains,
    base_task,
    com_task,
    desired_velocity,
    swing_error,
    swing_task,
)
from stribeck.simulation.walking.balance.terms import Dynamics, FootState, Terms
from stribeck.simulation.walking.plan import BOTH, Plan
from stribeck.simulation.walking.start import Start


class BalanceError(StribeckError):
    """Error: no joint torques keep the feet on the ground."""


@dataclass(eq=False)
class _UnderWay:
    """Present step, start of its swing foot, and integrated tracking error."""

    step: int
    place: Array
    yaw: float
    sample: int
    missed: Array


class WalkingController:
    """Controller that follows a plan.

    Parameters
    ----------
    robot
        Robot with two surface contacts.
    dynamics
        Model of the controller, which may differ from the simulated robot.
    soles
        Soles by contact.
    start
        Initial stance, whose posture and height of the center of mass the controller keeps.
    limit
        Largest joint torques in the tree's order, shape (n,).
    plan
        Plan of the walk.
    gains
        Feedback gains and weights.

    Attributes
    ----------
    swing_error
        Position error of the swing foot [m], shape (3,); zero in double support.
    """

    def __init__(
        self,
        robot: Robot,
        dynamics: Dynamics,
        soles: dict[str, Sole],
        start: Start,
        limit: Array,
        plan: Plan,
        gains: Gains,
    ) -> None:
        self.dynamics, self.plan, self.start, self.limit = dynamics, plan, start, limit
        self.gains = gains
        self.pulsation = sqrt(-dynamics.gravity[2] / start.height)
        self._cones = [wrench_cone(soles[name], gains.friction) for name in robot.contacts]
        held = np.array([name in robot.position_controlled for name in list(robot.tree.model.names)[2:]])
        in_legs = np.isin(np.arange(2, dynamics.model.njoints), dynamics.leg_joints)
        joints = np.where(held, gains.held_weight, np.where(in_legs, gains.leg_weight, gains.posture_weight))
        self._stiffness = np.where(held, gains.held, gains.posture)
        self._damping = 2 * np.sqrt(self._stiffness)
        self._weights = {swings: _weights(gains, joints, swings) for swings in (False, True)}
        self._everyone, self._nobody = np.isfinite(limit), np.zeros(len(limit), dtype=bool)
        self._adjuster = StepAdjuster(plan, [soles[name] for name in robot.contacts], self.pulsation)
        self._under_way: _UnderWay | None = None
        self._torque = np.zeros(len(limit))
        self.swing_error = np.zeros(3)
        self._last: tuple[list[FootState], list[Task]] = [], []

    def torque(self, sample: int, configuration: Array, velocity: Array) -> Array:
        """Compute the joint torques of a control period in the tree's order, shape (n,) [N m].

        Parameters
        ----------
        sample
            Sample of the plan.
        configuration, velocity
            State of Pinocchio's rooted tree.

        Raises
        ------
        BalanceError
            If no torques keep the feet on the ground.
        """
        plan, gains = self.plan, self.gains
        terms = self.dynamics.at(configuration, velocity)
        swing = int(plan.swing[sample])
        stand = [foot for foot in (0, 1) if foot != swing]
        shift = self._adjuster.shift(sample, terms.com[:2] + terms.com_velocity[:2] / self.pulsation)
        dcm, zmp = plan.dcm[sample] + shift.dcm, plan.zmp[sample] + shift.zmp
        tasks = [
            com_task(terms, dcm, zmp, self.start.height, self.pulsation, gains),
            base_task(terms, velocity[3:6], plan.heading[sample], plan.heading_rate[sample], gains),
        ]
        self.swing_error = np.zeros(3)
        if swing != BOTH:
            tasks.append(self._follow(sample, terms.feet[swing], shift.goal))
        self._last = [terms.feet[foot] for foot in stand], tasks
        wishes = self._wishes(sample, stand, configuration, velocity)
        self._torque = self._solve(terms, stand, tasks, wishes)
        return self._torque

    def desired_velocity(self) -> Array:
        """Compute the desired joint velocities of the last period's tasks, shape (n,) [rad/s]."""
        return desired_velocity(*self._last)

    def _solve(self, terms: Terms, stand: list[int], tasks: list[Task], wishes: Wishes) -> Array:
        """Compute torques within the limits; if none exist, torques without limits, which the joints then clip.

        To save time, the first program contains only the limits of joints that were near their limits in the previous
        period. If its solution also satisfies all other limits, it solves the whole program.
        """
        standing, cones = [terms.feet[foot] for foot in stand], [self._cones[foot] for foot in stand]
        # a torque above this share of its limit may reach it in the next period
        near = np.abs(self._torque) > 0.7 * self.limit
        program = build(terms, standing, cones, tasks, wishes, self._weights[len(stand) == 1])
        for watched in (near, self._everyone, self._nobody):
            torque = solve(program, terms, standing, self.limit, watched)
            if torque is None:
                continue
            # tolerance of the limits [N m]
            if watched is self._nobody or not np.any(np.abs(torque) > self.limit + 1e-6):
                return torque
        raise BalanceError("balance: no torques at all keep the feet on the ground")

    def _follow(self, sample: int, foot: FootState, shift: Array) -> Task:
        """Compute the task of the swing foot."""
        under_way = self._step_under_way(sample, foot)
        swing = self._swing(sample, under_way, shift)
        error = swing_error(foot, swing)
        self.swing_error = error[:3]
        under_way.missed += (sample - under_way.sample) * self.plan.period * error
        under_way.sample = sample
        return swing_task(foot, swing, error, under_way.missed, self.gains)

    def _step_under_way(self, sample: int, foot: FootState) -> _UnderWay:
        """Find the current step, which starts at the position where its foot leaves the ground."""
        number = int(self.plan.step[sample])
        step = self.plan.steps[number]
        if self._under_way is None or self._under_way.step != number:
            yaw = float(np.arctan2(foot.rotation[1, 0], foot.rotation[0, 0]))
            turned = (yaw - step.start.yaw + pi) % (2 * pi) - pi
            self._under_way = _UnderWay(number, foot.place, step.start.yaw + turned, sample, np.zeros(BASE))
        return self._under_way

    def _swing(self, sample: int, start: _UnderWay, shift: Array) -> Swing:
        """Compute the desired pose of the swing foot."""
        step, progress = self.plan.steps[start.step], float(self.plan.progress[sample])
        goal = replace(step.goal, x=step.goal.x + shift[0], y=step.goal.y + shift[1])
        return swing_at(start.place, start.yaw, goal, step.kind.height, progress, step.kind.single_support)

    def _wishes(self, sample: int, stand: list[int], configuration: Array, velocity: Array) -> Wishes:
        """Compute targets that keep the posture, and distribute the weight between the feet as planned."""
        joints = self._stiffness * (self.start.posture - configuration[7:]) - self._damping * velocity[6:]
        wrenches = np.zeros((len(stand), BASE))
        wrenches[:, 2] = self.dynamics.weight * self.plan.share[sample, stand]
        return Wishes(joints, wrenches)


def _weights(gains: Gains, joints: Array, swings: bool) -> Weights:
    """Compute the weights while a foot swings, or while both stand; `joints` contains the weights of the posture."""
    wrench = np.repeat([gains.force_weight, gains.moment_weight], 3)
    tasks = np.repeat([gains.com_weight, gains.base_weight, gains.foot_weight], [3, 3, BASE if swings else 0])
    return Weights(np.concatenate([tasks, wrench]), np.concatenate([joints, wrench[: 0 if swings else BASE]]))
