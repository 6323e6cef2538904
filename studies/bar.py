"""The least that a joint estimator can be: the bar that every component of a larger one has to beat.

The equations of motion of all single supports pass a smooth window on both sides (the weak form), the friction of all
joints that move and the bodies' inertias are found together by Gauss and Newton's method, errors are those of a vector
autoregression of what was left over, and how wrong the model is and how alike joints bend is learned from the
estimates (MacKay 1992). Nothing is calibrated, no foot may be a point, and the intervals believe all of that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from stribeck import Robot, Settings
from stribeck.dynamics.root_motion import standing_root
from stribeck.dynamics.rooted import rooted_inverse_dynamics
from stribeck.dynamics.state import Orientation, State
from stribeck.equations.regressors import inertia_regressors
from stribeck.equations.window import Window, smooth_window
from stribeck.friction import get_law
from stribeck.log import RobotLog
from stribeck.motion.filters import make_filter
from stribeck.preparation import PreparedLog, prepare
from stribeck.result import Corrections, JointResult, LogSummary, ParameterEstimate, Result
from stribeck.settings import FilterSettings
from stribeck.typing import Array

LAW, LOGS = get_law("stribeck"), np.array([each.logarithmic for each in get_law("stribeck").parameters])
SMOOTH, SHARP = (FilterSettings(kind="savitzky-golay", window=window) for window in (31, 11))
LAGS, STEPS, TRIM, MOVES = 3, 12, 0.06, 0.1  # windows, 1, s, rad/s
MASS, LEVER, MOMENT, BEND, LINEAR, WEAK = 0.05, 0.0075, 0.12, 1.5, 10.0, 0.33  # 1, m, 1, 1, 1, 1
Noise = dict[str, tuple[Array, Array]]  # by foot: what is predicted from the last windows, and how well (Cholesky)
Stretch = tuple[str, Array, Array, Array]  # foot, velocity (T, n), torque less dynamics (K, n), columns (K, n, c)


def bar(logs: Sequence[RobotLog], robot: Robot) -> tuple[Result, Robot]:
    """Return the friction of all joints that move, and the robot with the inertias that were found."""
    parts = [prepare(log, robot, Settings(filter=SMOOTH)) for log in logs]
    speeds = np.concatenate([np.gradient(part.log.position, part.log.time, axis=0) for part in parts])
    speed = np.percentile(np.abs(speeds), 98, axis=0)
    joints = robot.torque_controlled[speed[robot.torque_controlled] > MOVES]
    stretches = [each for part in parts for each in _stretches(part, robot, joints)]
    bodies = robot.tree.model.inertias.tolist()[1:]
    scales = np.concatenate([_wrong_by(body) for body in bodies])
    x, deviation, chi_square = _solve(stretches, smooth_window(parts[0].sampling.period), speed[joints], scales)
    shape = len(joints), len(LAW.parameters)
    friction = dict(zip(joints.tolist(), _described(x[: np.prod(shape)].reshape(shape), deviation), strict=True))
    none = JointResult(parameters={}, verdict="not excited", reason="", samples=0, velocity_range=(0, 0), reversals=0)
    seconds = sum(float(np.ptp(log.time)) for log in logs)
    result = Result(
        robot=robot.name,
        log=LogSummary(path="", sha256="", duration=seconds, rate=0.0, samples_used=0),
        law=LAW.name,
        method="bar",
        joints={name: replace(none, parameters=friction.get(k, {})) for k, name in enumerate(robot.joint_names)},
        warnings=[],
        stribeck="",
        corrections=Corrections(chi_square=chi_square),
    )
    model = pin.Model(robot.tree.model)
    for k, (body, change) in enumerate(zip(bodies, (scales * x[-len(scales) :]).reshape(-1, 10), strict=True)):
        model.inertias[k + 1] = pin.Inertia.FromDynamicParameters(body.toDynamicParameters() + change)
    return result, replace(robot, tree=replace(robot.tree, model=model))


def _solve(stretches: list[Stretch], window: Window, speed: Array, scales: Array) -> tuple[Array, Array, float]:
    """Return all coordinates, standard deviations of friction's, shape (n, p), and chi^2 a degree of freedom."""
    torque = float(np.sqrt(np.mean(np.concatenate([right for _, _, right, _ in stretches]) ** 2)))
    joints, count, logs = len(speed), len(speed) * len(LAW.parameters), np.tile(LOGS, len(speed))
    centre, width = (each.ravel() for each in np.stack([_believed(v, torque) for v in speed], axis=1))
    centre, width = np.append(centre, np.zeros(len(scales))), np.append(width, np.ones(len(scales)))
    first, x = centre.copy(), np.append(np.where(logs, centre[:count], 0.01 * width[:count]), np.zeros(len(scales)))
    noise = {foot: (np.zeros((LAGS * joints, joints)), np.eye(joints)) for foot, *_ in stretches}
    ends = np.array([(-np.inf if p.logarithmic else p.lower, p.upper) for p in LAW.parameters]).T
    for step in range(STEPS):
        hessian, gradient, square, number, left = _normal_equations(stretches, window, x, scales, noise)
        noise = {foot: _autoregression(residuals) for foot, residuals in left.items()}
        if step == 0:
            continue  # the first noise is what a model that is trusted leaves over
        covariance = np.linalg.inv(hessian + np.diag(width**-2))
        change = covariance @ (gradient - (x - centre) / width**2)
        change[:count] = np.where(logs, change[:count].clip(-1, 1), change[:count])
        x = x + change
        x[:count] = np.clip(x[:count].reshape(joints, -1), *ends).ravel()
        if step > STEPS // 3:
            _learn(x, first, centre, width, np.diag(covariance), count)
    deviation = np.sqrt(np.diag(covariance)[:count] * max(square / number, 1.0))
    return x, deviation.reshape(joints, -1), square / number


def _believed(speed: float, torque: float) -> Array:
    """Return mean and standard deviation of a joint's coordinates before the log speaks, shape (2, p)."""
    units = {"N m": LINEAR * torque, "N m s/rad": LINEAR * torque / speed, "1": 1.0}
    bends = [
        np.mean(np.log(p.starts)) + p.start_speed_power * np.log(speed) if p.starts else 0.0 for p in LAW.parameters
    ]
    return np.array([bends, [BEND if p.logarithmic else units[p.unit] for p in LAW.parameters]])


def _wrong_by(body: pin.Inertia) -> Array:
    """Return how wrong the ten inertial parameters of a body may be."""
    moments = np.sqrt(np.diag(body.inertia) + 1e-9)
    pairs = [moments[i] * moments[j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.array([MASS * body.mass + 1e-9, *3 * [LEVER * body.mass + 1e-9], *(MOMENT * each for each in pairs)])


def _stretches(part: PreparedLog, robot: Robot, joints: NDArray[np.int64]) -> Iterator[Stretch]:
    period = part.sampling.period
    window, smooth, sharp = smooth_window(period), make_filter(SMOOTH, period), make_filter(SHARP, period)
    for phase in (phase for phase in part.support.phases if phase.kind in ("single", "fixed")):
        rows = slice(phase.start + round(TRIM / period), phase.stop - round(TRIM / period))
        position, velocity, _ = smooth.apply(part.log.position[rows])
        if len(position) < len(window.taps) + 10 * window.step:
            continue
        inside = slice(rows.start + smooth.half_width, rows.stop - smooth.half_width)
        off = smooth.half_width - sharp.half_width
        acceleration = sharp.apply(part.log.position[rows])[2][off : len(position) + off]
        turn = part.log.base_orientation
        still = np.zeros((len(position), 3))
        state = State(
            position, velocity, acceleration, None if turn is None else Orientation(turn[inside], still, still)
        )
        foot, tree = phase.feet[0], robot.rooted_at(phase.feet[0]) if robot.contacts else robot.tree
        root = standing_root(robot, foot, state) if robot.contacts else None
        needed = rooted_inverse_dynamics(tree, position, velocity, acceleration, root)[1]
        middle = state.take(len(window.taps) // 2 + window.step * np.arange(window.count(len(position))))
        calm = window.apply(smooth.apply(part.log.position[rows])[2])
        middle = replace(middle, acceleration=calm)
        root = standing_root(robot, foot, middle) if robot.contacts else None
        columns = inertia_regressors(robot, tree, tree.root_size + joints, middle, root)
        yield foot, velocity[:, joints], window.apply((part.log.torque[inside] - needed)[:, joints]), columns


def _normal_equations(
    stretches: list[Stretch], window: Window, x: Array, scales: Array, noise: Noise
) -> tuple[Array, Array, float, int, dict[str, list[Array]]]:
    """Return curvature and descent of half of chi^2, chi^2, its number of squares, and what is left over by foot."""
    hessian, gradient, square, number = np.zeros((len(x), len(x))), np.zeros(len(x)), 0.0, 0
    left: dict[str, list[Array]] = {}
    values = np.where(LOGS, np.exp(np.where(LOGS, v := x[: -len(scales)].reshape(-1, len(LOGS)), 0)), v)
    for foot, velocity, right, columns in stretches:
        residual, design = right - columns @ (scales * x[-len(scales) :]), np.zeros((*right.shape, len(x) + 1))
        for k, each in enumerate(values):
            own = slice(k * len(each), (k + 1) * len(each))
            design[:, k, own] = window.apply(LAW.jacobian(velocity[:, k], each) * np.where(LOGS, each, 1.0))
            residual[:, k] -= window.apply(LAW.torque(velocity[:, k], each)[:, None])[:, 0]
        design[:, :, -1 - len(scales) : -1], design[:, :, -1] = columns * scales, residual
        past = np.concatenate([design[LAGS - k : len(design) - k] for k in range(1, LAGS + 1)], axis=1)
        predicted, factor = noise[foot]
        innovation = design[LAGS:] - np.einsum("ij,kic->kjc", predicted, past)
        white = solve_triangular(factor, innovation.transpose(1, 0, 2).reshape(len(factor), -1), lower=True)
        flat = white.reshape(-1, len(x) + 1)
        product = flat.T @ flat
        hessian, gradient = hessian + product[:-1, :-1], gradient + product[:-1, -1]
        square, number = square + float(product[-1, -1]), number + len(flat)
        left.setdefault(foot, []).append(residual)
    return hessian, gradient, square, number, left


def _autoregression(residuals: list[Array]) -> tuple[Array, Array]:
    """Return the coefficients of a residual's last windows, shape (lags n, n), and the factor of what they leave."""
    past = np.concatenate([np.hstack([r[LAGS - k : len(r) - k] for k in range(1, LAGS + 1)]) for r in residuals])
    now = np.concatenate([r[LAGS:] for r in residuals])
    predicted = np.linalg.lstsq(past, now, rcond=None)[0]
    errors = now - past @ predicted
    freedom = max(len(now) - len(predicted), 1)
    return predicted, np.linalg.cholesky(errors.T @ errors / freedom + 1e-12 * np.eye(now.shape[1]))


def _learn(x: Array, first: Array, centre: Array, width: Array, variance: Array, count: int) -> None:
    """Measure from estimates how wrong masses, centres and moments are, and how alike joints are where they bend."""
    part = (np.arange(len(x)) - count) % 10
    known = (1 - variance / width**2).clip(0, 1)
    for low, high in ((0, 1), (1, 4), (4, 10)):
        own = np.flatnonzero((np.arange(len(x)) >= count) & (part >= low) & (part < high))
        width[own] = min(np.sqrt((np.sum(x[own] ** 2) + 1e-3) / (known[own].sum() + 1e-3)), 1.0)
    for k in (k for k, p in enumerate(LAW.parameters) if p.logarithmic or p.unit == "1"):
        own = np.arange(k, count, len(LOGS))
        off, total = x[own] - first[own], known[own].sum() + 0.03
        middle = known[own] @ off / total
        centre[own] = first[own] + middle
        squares = known[own] @ (off - middle) ** 2 + 0.03 * 0.25
        width[own] = np.sqrt(squares / (max(known[own].sum() - 1, 0.0) + 0.03))


def _described(x: Array, deviation: Array) -> list[dict[str, ParameterEstimate]]:
    ends = [np.where(LOGS, np.exp(np.where(LOGS, y, 0)), y) for y in (x, x - 1.96 * deviation, x + 1.96 * deviation)]
    errors, found = deviation * np.where(LOGS, ends[0], 1.0), []
    for value, low, high, error in zip(*ends, errors, strict=True):
        size = dict(zip([p.name for p in LAW.parameters], np.abs(value), strict=True))
        size["offset"] = max(size["offset"], size["coulomb"])
        weak = [high[k] - low[k] > WEAK * size[p.name] for k, p in enumerate(LAW.parameters)]
        found.append({
            p.name: ParameterEstimate(
                value=float(value[k]),
                standard_error=float(error[k]),
                interval_95=(float(low[k]), float(high[k])),
                unit=p.unit,
                verdict="weak" if weak[k] else "identified",
            )
            for k, p in enumerate(LAW.parameters)
        })  # fmt: skip
    return found
