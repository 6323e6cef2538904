"""Joint covariance of friction and bodies, for random models of the robot.

Bodies have log-Cholesky coordinates y(x), so that every draw is physically possible. With the covariance C of the fit's
coordinates x (docs/estimator-fit.md, "Intervals"), the covariance of y is T C T^T, where T = dy/dx at the solution.
"""

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.estimator.estimate import WholeLogFit
from stribeck.core.estimator.uncertainty.intervals import joint_coordinates
from stribeck.core.result import BODY_COORDINATES, ErrorCorrelation
from stribeck.core.robot.inertial_parameters import SIZE


def shape_errors(fit: WholeLogFit) -> Array:
    """Compute standard errors of the coordinates of each body's shape, shape (L, 6)."""
    places = fit.fit.layout.places("bodies").reshape(-1, SIZE)
    slopes = _slopes(fit)[:, 4:]
    covariance = np.array([fit.fit.covariance[np.ix_(body, body)] for body in places]).reshape(-1, SIZE, SIZE)
    variances = np.einsum("lij,ljk,lik->li", slopes, covariance, slopes)
    return np.asarray(np.sqrt(variances))


def error_correlation(fit: WholeLogFit) -> ErrorCorrelation:
    """Compute the correlation of the errors of all joints and bodies."""
    layout, bodies = fit.fit.layout, fit.fit.layout.bodies
    places, gain, labels = [], [], []
    for joint, name in enumerate(fit.joints):
        coordinates = joint_coordinates(fit, joint)
        places += coordinates.places.tolist()
        gain += coordinates.gain.tolist()
        labels += [f"{name}.{parameter.name}" for parameter in coordinates.parameters]
    friction = len(places)
    places += layout.places("bodies").tolist()
    labels += [f"{body}.{coordinate}" for body in bodies for coordinate in BODY_COORDINATES]
    gain += [0.0] * (len(places) - friction)
    covariance = fit.fit.covariance[np.ix_(places, places)] + np.outer(gain, gain)
    turn = np.eye(len(places))
    for k, slopes in enumerate(_slopes(fit)):
        own_body = slice(friction + SIZE * k, friction + SIZE * (k + 1))
        turn[own_body, own_body] = slopes
    return ErrorCorrelation.of(labels, turn @ covariance @ turn.T)


def _slopes(fit: WholeLogFit) -> Array:
    """Compute the derivatives of the bodies' log-Cholesky coordinates by the fit's coordinates, shape (L, 10, 10)."""
    h, of = 1e-5, fit.fit.model.bodies.log_cholesky  # step in prior standard deviations
    columns = [(of(fit.bodies + step) - of(fit.bodies - step)) / (2 * h) for step in h * np.eye(SIZE)]
    return np.stack(columns, axis=2)
