"""Compare solvers for the balance program of a walking robot: daqp as in the controller, and qpsolvers' solvers.

    python -m benchmarks.balance

Every solver that qpsolvers finds is timed (`pip install quadprog` adds one more). The program is the complete program
of one control period for TORO on one foot. Times are medians; ratios are relative to the controller's call.
"""

import time
from collections.abc import Callable

import daqp
import numpy as np
import qpsolvers

from benchmarks.report import arguments, report
from stribeck.robot import Robot
from stribeck_simulation.mujoco.model import compile_body
from stribeck_simulation.robots.toro import ROBOT_FILE
from stribeck_simulation.run import POSTURES
from stribeck_simulation.walking.balance.qp import Program, Task, Weights, Wishes, build, wrench_cone
from stribeck_simulation.walking.balance.terms import Dynamics
from stribeck_simulation.walking.start import start_standing


def one_foot() -> Program:
    """Build the program of TORO standing on its left foot, with random desired accelerations."""
    robot = Robot.from_file(ROBOT_FILE)
    soles = compile_body(robot).soles
    dynamics = Dynamics(robot, soles)
    start = start_standing(robot, dynamics, POSTURES["toro"])
    generator = np.random.default_rng(1)
    nv = dynamics.model.nv
    n = nv - 6
    terms = dynamics.at(start.configuration, 0.1 * generator.normal(size=nv))
    tasks = [
        Task(jacobian, generator.normal(size=len(jacobian)), np.zeros(len(jacobian)))
        for jacobian in (terms.com_jacobian, terms.feet[1].jacobian)
    ]
    wishes = Wishes(generator.normal(size=n), np.array([[0.0, 0.0, dynamics.weight, 0.0, 0.0, 0.0]]))
    weights = Weights(np.repeat([1e3, 10.0, 1e-6, 1e-4], [3, 6, 3, 3]), np.full(n, 1e-2))
    cone = wrench_cone(soles[next(iter(robot.contacts))], 0.6)
    return build(terms, terms.feet[:1], [cone], tasks, wishes, weights)


def median(call: Callable[[], object], times: int) -> float:
    """Measure the median time of a call [s]."""
    taken = []
    for _ in range(times):
        begin = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begin)
    return float(np.median(taken))


def main() -> None:
    """Print the figures."""
    options = arguments(__doc__ or "", samples=2000)
    p = one_foot()
    direct = median(lambda: daqp.solve(p.cost, p.gradient, p.rows, p.upper, p.lower, p.sense), options.samples)
    figures = {"daqp, called directly [us]": 1e6 * direct}
    for solver in qpsolvers.available_solvers:
        problem = qpsolvers.Problem(p.cost, p.gradient, p.rows, p.upper)
        spent = median(lambda p=problem, s=solver: qpsolvers.solve_problem(p, s), options.samples)  # type: ignore[misc]
        figures[f"{solver} by qpsolvers, over that"] = spent / direct
    report(figures, options.save, options.compare)


if __name__ == "__main__":
    main()
