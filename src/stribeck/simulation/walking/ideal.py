"""Walks in the ideal simulator with rigid feet: the same plan and controller, with the true state and without noise."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from stribeck.core.base.threads import one_blas_thread
from stribeck.core.base.typing import Array
from stribeck.core.robot import Robot
from stribeck.simulation.friction import FrictionTruth
from stribeck.simulation.mujoco.model import compile_body
from stribeck.simulation.rigid.constrained import BodyState, Support, simulate_constrained
from stribeck.simulation.robots.sole import Sole
from stribeck.simulation.walking.balance.controller import WalkingController
from stribeck.simulation.walking.balance.tasks import Gains
from stribeck.simulation.walking.balance.terms import Dynamics
from stribeck.simulation.walking.footsteps import Steps
from stribeck.simulation.walking.plan import Plan, plan_walk
from stribeck.simulation.walking.simulate import PERIOD, Walk
from stribeck.simulation.walking.start import start_standing


def simulate_ideal_walk(
    robot: Robot,
    walk: Sequence[Steps],
    posture: Mapping[str, float],
    friction: FrictionTruth,
    *,
    soles: Mapping[str, Sole] | None = None,
    paper_literal: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> Walk:
    """Simulate a walk in the paper's ideal simulator (6.1), where the plan determines the standing feet.

    Parameters
    ----------
    robot
        Robot with two flat feet, from a robot file.
    walk, posture
        See `simulate_walk`.
    friction
        Friction of the joints in the tree's order; used for one run.
    soles
        Soles of feet without a simple shape in the model.
    paper_literal
        See `simulate_constrained`.
    progress
        Callback `progress(fraction)`.

    Raises
    ------
    StribeckError
        If the simulation diverges.
    BalanceError
        If no torques keep the feet on the ground.
    """
    body = compile_body(robot, soles or {}, PERIOD)
    dynamics = Dynamics(robot, body.soles)
    start = start_standing(robot, dynamics, posture)
    plan = plan_walk(walk, start.feet, np.sqrt(-dynamics.gravity[2] / start.height), PERIOD)
    controller = WalkingController(robot, dynamics, body.soles, start, body.torque_limit, plan, Gains())

    def control(time: float, state: BodyState) -> Array:
        sample = min(round(time / plan.period), plan.samples - 1)
        if sample % 100 == 0:
            progress(sample / plan.samples)
        return controller.torque(sample, state.configuration, state.velocity)

    with one_blas_thread():
        log, truth = simulate_constrained(
            robot,
            control,
            _supports(plan, tuple(robot.contacts)),
            friction,
            configuration=start.configuration,
            duration=plan.samples * plan.period,
            paper_literal=paper_literal,
        )
    return Walk(log, truth, plan)


def _supports(plan: Plan, feet: tuple[str, ...]) -> list[Support]:
    """List the supports of the plan."""
    changes = np.flatnonzero(np.diff(plan.swing, prepend=plan.swing[0] - 1))
    return [
        Support(float(k * plan.period), tuple(foot for i, foot in enumerate(feet) if i != plan.swing[k]))
        for k in changes
    ]
