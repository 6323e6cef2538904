"""Posterior of a result: all parameters of friction and bodies with their joint covariance.

Other values of some coordinates are inserted by conditioning (Rasmussen and Williams 2006, equation A.6).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its linalg is slow to import: loaded at its first use

from stribeck.core.base.typing import Array
from stribeck.core.result.joint import JointResult
from stribeck.core.result.parts import BODY_COORDINATES, BodyCorrection, Corrections
from stribeck.core.robot.inertial_parameters import pseudo_inertia, shape_coordinates


@dataclass(frozen=True, eq=False)
class Posterior:
    """Normal distribution of m coordinates, which the logs and the priors of a fit imply.

    Attributes
    ----------
    names, units
        Names, "joint.parameter" and "body.coordinate" (`BODY_COORDINATES`), and units, m each.
    mean, covariance
        Mean, shape (m,), and covariance, shape (m, m).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: Array
    covariance: Array

    @cached_property
    def root(self) -> Array:
        """Matrix with root root^T = covariance, shape (m, m)."""
        values, vectors = np.linalg.eigh(self.covariance)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    def shifts(self, given: Mapping[str, float]) -> dict[str, float]:
        """Compute by how much the most probable coordinates move if some of them have given values.

        With the coordinates a that have values, the others move by C_ba C_aa^-1 (value - mean_a).
        """
        places = [self.names.index(name) for name in given]
        change = np.array(list(given.values())) - self.mean[places]
        across = self.covariance[:, places]
        solved = np.linalg.lstsq(across[places], change, rcond=1e-9)[0]
        return dict(zip(self.names, (across @ solved).tolist(), strict=True))


def posterior_of(joints: Mapping[str, JointResult], corrections: Corrections | None) -> Posterior:
    """Build the posterior of joints and couplings, and of bodies.

    Joints and bodies are independent in results of methods and versions that do not know their correlations.
    """
    names, units, mean, errors, blocks = [], [], [], [], []
    for joint_name, joint in joints.items():
        names += [f"{joint_name}.{parameter}" for parameter in joint.parameters]
        units += [parameter.unit for parameter in joint.parameters.values()]
        mean += [parameter.value for parameter in joint.parameters.values()]
        errors += [parameter.standard_error for parameter in joint.parameters.values()]
        matrix = joint.correlation_matrix()
        blocks.append(np.eye(len(joint.parameters)) if matrix is None or not len(matrix) else np.nan_to_num(matrix))
    for body_name, body in (corrections.bodies if corrections else {}).items():
        names += [f"{body_name}.{coordinate}" for coordinate in BODY_COORDINATES]
        units += ["1", "m", "m", "m", "1", "1", "1", "m", "m", "m"]
        mean += coordinates_of(body)
        share = body.mass_error / body.mass[1] if body.mass[1] > 0 else 0.0
        errors += [share, *body.centre_of_mass_error, *(body.shape_error or [0.0] * 6)]
        blocks.append(np.eye(len(BODY_COORDINATES)))
    correlation = scipy.linalg.block_diag(*blocks)
    told = corrections.correlation if corrections else None
    if told is not None:
        place = {name: k for k, name in enumerate(names)}
        known = [k for k, name in enumerate(told.names) if name in place]
        places = [place[told.names[k]] for k in known]
        correlation[np.ix_(places, places)] = told.matrix[np.ix_(known, known)]
    size = np.minimum(np.nan_to_num(np.array(errors), posinf=0.0), 1e150)  # squares stay finite
    return Posterior(tuple(names), tuple(units), np.array(mean), correlation * np.outer(size, size))


def coordinates_of(body: BodyCorrection) -> list[float]:
    """Compute the coordinates of an estimated body; zero for those of an impossible shape."""
    mass = max(body.mass[1], 1e-300)
    with np.errstate(all="ignore"):
        shape = np.nan_to_num(shape_coordinates(pseudo_inertia(np.array([mass, 0.0, 0.0, 0.0, *body.inertia[1]]))))
    return [float(np.log(mass)), *body.centre_of_mass[1], *shape.tolist()]
