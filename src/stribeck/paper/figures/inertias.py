"""Effect of wrong inertias on the friction curves (Fig. 7.5 and 7.6)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin

from stribeck.core.base.typing import Array, IntArray
from stribeck.core.result.samples import FrictionSamples
from stribeck.core.robot import Robot
from stribeck.paper.figures.figure import PaperChart, PaperSection, rms

Change = Callable[[pin.Inertia], pin.Inertia]
"""Function that changes a body's inertia."""


def scaled(mass: float = 1.0, moments: float = 1.0) -> Change:
    """Make a change that scales a body's mass and principal moments, eigenvalues of its 6x6 inertia matrix.

    The matrix refers to the center of mass. About any other point, translation and rotation share eigenvectors, and a
    matrix with scaled eigenvalues belongs to no rigid body.
    """
    return lambda body: pin.Inertia(mass * body.mass, body.lever, moments * body.inertia)


def with_bodies(robot: Robot, change: Change) -> Robot:
    """Change the inertia of all bodies."""
    model = pin.Model(robot.tree.model)
    for k in range(1, model.njoints):
        model.inertias[k] = change(model.inertias[k])
    return replace(robot, tree=replace(robot.tree, model=model))


def branches(velocity: Array, acceleration: Array, torque: Array) -> tuple[Array, Array, Array]:
    """Compute mean torques in velocity bins, for rising and for falling velocity.

    Parameters
    ----------
    velocity, acceleration, torque
        Samples of a joint [rad/s], [rad/s^2], [N m], shape (N,).

    Returns
    -------
    centers
        Velocities [rad/s], shape (B,).
    means
        Mean torques of both branches [N m], shape (2, B); NaN in bins with few samples.
    counts
        Number of samples, shape (2, B).
    """
    bins, fewest = 30, 5  # number of bins, and of samples of a branch in a bin
    edges = np.linspace(velocity.min(), velocity.max(), bins + 1)
    place = np.clip(np.digitize(velocity, edges) - 1, 0, bins - 1)
    means, counts = np.zeros((2, 2, bins))
    for k, branch in enumerate((acceleration > 0, acceleration <= 0)):
        counts[k] = np.bincount(place[branch], minlength=bins)
        means[k] = np.bincount(place[branch], torque[branch], minlength=bins) / np.maximum(counts[k], 1)
    return (edges[1:] + edges[:-1]) / 2, np.where(counts >= fewest, means, np.nan), counts


def split(velocity: Array, acceleration: Array, torque: Array) -> float:
    """Compute the distance between the branches of rising and falling velocity [N m].

    It is the RMS difference of the branches' mean torques over velocity bins that both branches pass; 0 without any.
    """
    _, means, counts = branches(velocity, acceleration, torque)
    apart, weights = means[0] - means[1], np.where(np.isfinite(means), counts, 0).min(axis=0)
    return float(np.sqrt(weights @ np.nan_to_num(apart) ** 2 / max(weights.sum(), 1)))


def inertias_section(samples: FrictionSamples, changed: list[FrictionSamples], order: IntArray) -> PaperSection:
    """Draw each joint's friction curve as modeled, and as `changed` by masses and by moments of inertia."""
    charts = []
    for column in order:
        rows = samples.usable[:, column]
        motion = samples.velocity[rows, column], samples.acceleration[rows, column]
        torques = [each.friction_torque[rows, column] for each in (samples, *changed)]
        errors = [torque - torques[0] for torque in torques[1:]]
        numbers = *map(rms, errors), *(split(*motion, error) for error in errors)
        velocities, curves, _ = zip(*(branches(*motion, torque) for torque in torques), strict=True)
        charts.append(PaperChart(samples, column, velocities[0], np.concatenate(np.swapaxes(curves, 0, 1)), numbers))
    return PaperSection("inertias", charts)
