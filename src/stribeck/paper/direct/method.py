"""Identify friction and bodies together by least squares on the dynamic regressor (docs/other-methods.md)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.friction_torque.preparation import Logs, PreparedLog, Progress
from stribeck.core.equations.friction_torque.stage import with_filter
from stribeck.core.equations.whole_log.build import acting
from stribeck.core.equations.whole_log.corrections import find_corrections
from stribeck.core.errors import NothingIdentifiedError
from stribeck.core.estimator.describe import body_correction
from stribeck.core.estimator.model.bodies import bodies_of
from stribeck.core.friction import FrictionLaw, Parameter
from stribeck.core.identify.contract import SHARED, Fitted, FrictionTorque, Method, Unseen, cut, joined_samples
from stribeck.core.identify.corrected import corrected_robot
from stribeck.core.identify.moving import joints_that_move
from stribeck.core.identify.own_friction import own_friction
from stribeck.core.judgement.curve_fit.problem import ARMATURE, joint_problem
from stribeck.core.judgement.excitation import MIN_BLOCKS, MIN_SAMPLES_PER_PARAMETER
from stribeck.core.judgement.joint_fit import PRIOR_FACTOR, JointFit, intervals_95, near_bound, parameter_units
from stribeck.core.result import BODY_COORDINATES, Corrections, ErrorCorrelation, Validation
from stribeck.core.robot import Robot
from stribeck.core.robot.inertial_parameters import SIZE, log_cholesky, pseudo_inertia
from stribeck.core.settings import Settings
from stribeck.paper.curve_fit.fit import validate_values
from stribeck.paper.direct.estimate import DirectFit, fit_direct
from stribeck.paper.direct.regressor_rows import Block, RowMaker
from stribeck.paper.direct.rows import ROOT, DirectRows


@dataclass(frozen=True, eq=False, kw_only=True)
class JointColumns:
    """The friction coefficients of a joint or coupling.

    Attributes
    ----------
    name, parameters
        Name of the joint, and its p parameters: first of the law, then the armature if it is fitted.
    first
        Index of the first coefficient among all.
    units
        Typical size of each parameter, shape (p,).
    kinds
        Kinds of the rows on which the friction acts.
    """

    name: str
    parameters: tuple[Parameter, ...]
    first: int
    units: Array
    kinds: tuple[int, ...]


def find(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings, _: FrictionTorque, progress: Progress
) -> Fitted:
    """Fit friction and bodies to all blocks but every n-th, which is held out."""
    progress("building the regressor", 0.0)
    maker, names, top_speed = _row_maker(prepared, robot, law, settings)
    blocks, every = maker.blocks(prepared), settings.holdout
    held_out = blocks[every // 2 :: every]
    training = [block for number, block in enumerate(blocks) if number % every != every // 2]
    numbers = np.arange(len(training)) * min(64, len(training)) // max(len(training), 1)  # more rows only take longer
    rows = maker.rows(prepared, training, numbers.tolist())
    if len({number for part in rows for number in part.clusters[0].tolist()}) < 2:  # a covariance needs two
        raise NothingIdentifiedError(
            "no joint can be identified from this log: every usable support phase is shorter than the margins "
            "that are trimmed and filtered; stand longer on each foot"
        )
    columns = _columns(maker, names, rows, top_speed)
    progress("fitting", 0.0)
    fit = fit_direct(
        rows,
        bodies_of(maker.corrections.inertial_parameters, settings.priors).parameters,
        1 / (2 * settings.priors.mass) ** 2,  # of a scaled body, d = 2 (dm / m)^2: the mass has this deviation
        PRIOR_FACTOR * np.concatenate([joint.units for joint in columns]),
        np.array([parameter.lower == 0 for joint in columns for parameter in joint.parameters]),
        settings.regression,
    )
    fits = _joint_fits(fit, columns, rows)
    if not fits:
        raise NothingIdentifiedError("no joint can be identified from this log: none moves in enough blocks of it")
    corrected = corrected_robot(robot, maker.corrections, fit.change.ravel())
    fitted = Fitted(
        fits=fits,
        validations=dict.fromkeys(fits),
        unseen=Unseen(fits=fits, robot=corrected, logs=_parts(prepared, held_out)),
        robot=corrected,
        logs=prepared,
        settings=settings.model_copy(update={"filter_torque": True}),
        corrections=_corrections(fit, columns, maker.corrections.bodies, maker.corrections.inertial_parameters),
        couplings=tuple(robot.couplings),
        notes=[
            f"{len(fit.base_columns)} of {fit.change.size} inertial parameters are base parameters of this motion; "
            f"condition number {fit.condition:.3g}, of columns of norm 1."
        ],
    )
    check = maker.settings.model_copy(update={"fit_armature": False})
    return replace(fitted, validations=_validations(fitted, law, check, _parts(prepared, training)))


def _row_maker(
    prepared: Logs, robot: Robot, law: FrictionLaw, settings: Settings
) -> tuple[RowMaker, tuple[str, ...], Array]:
    """Create the builder of rows, and list the moving joints and couplings and their top speeds [rad/s]."""
    joints, couplings, top_speed = joints_that_move(prepared, robot, law, settings)
    names = (*(robot.joint_names[column] for column in joints), *couplings)
    maker = RowMaker(
        robot=robot,
        law=law,
        settings=with_filter(prepared[0], robot, settings)[0].model_copy(update={"filter_torque": True}),
        joints=joints,
        couplings=robot.coefficients(names[: len(joints)], couplings),
        rest=settings.rest * top_speed,
        corrections=find_corrections(robot, names, settings),
    )
    return maker, names, top_speed


def _parts(prepared: Logs, blocks: Sequence[Block]) -> list[PreparedLog]:
    """Cut the support phases of the logs to some blocks."""
    return [
        replace(part, support=cut(part.support, [block.rows for block in blocks if block.log == number]))
        for number, part in enumerate(prepared)
    ]


def _columns(maker: RowMaker, names: Sequence[str], rows: Sequence[DirectRows], top_speed: Array) -> list[JointColumns]:
    """Define the friction coefficients of each joint and coupling."""
    on_joints = acting(maker.couplings) != 0
    columns, first = [], 0
    for k, name in enumerate(names):
        kinds = (ROOT + np.flatnonzero(on_joints[:, k])).tolist()
        parameters, acceleration = tuple(maker.law.parameters[i] for i in maker.has(k)), 1.0
        if k in maker.corrections.rotors:
            column = maker.corrections.inertial_parameters.size + first + len(parameters)
            acceleration = _rms([part.columns[:, part.kind == kinds[0], column] for part in rows])
            parameters = (*parameters, ARMATURE)
        torque = _rms([part.left[:, np.isin(part.kind, kinds)] for part in rows])
        units = parameter_units(parameters, torque, float(top_speed[k]) or 1.0, acceleration)
        columns.append(JointColumns(name=name, parameters=parameters, first=first, units=units, kinds=tuple(kinds)))
        first += len(parameters)
    return columns


def _rms(parts: Sequence[Array]) -> float:
    """Compute the root mean square, 1 if it is zero or there are no values."""
    together = np.concatenate([part.ravel() for part in parts])
    return float(np.sqrt(np.sum(together**2) / max(together.size, 1))) or 1.0


def _validations(
    fitted: Fitted, law: FrictionLaw, settings: Settings, training: Logs
) -> Mapping[str, Validation | None]:
    """Validate each joint's law on the held-out blocks with the corrected robot."""
    assert fitted.unseen is not None
    seen, unseen = (
        own_friction(samples, fitted.fits, law, fitted.robot, fitted.couplings) if samples else None
        for samples in (joined_samples(logs, fitted.robot, settings) for logs in (training, fitted.unseen.logs))
    )
    validations: dict[str, Validation | None] = dict.fromkeys(fitted.fits)
    if seen is None or unseen is None:
        return validations
    for joint, fit in fitted.fits.items():
        problems = [joint_problem(samples, joint, law, settings) for samples in (seen, unseen)]
        if all(len(problem.velocity) for problem in problems):
            validations[joint] = validate_values(fit.law_values(law), *problems)
    return validations


def _joint_fits(fit: DirectFit, joints: Sequence[JointColumns], rows: Sequence[DirectRows]) -> dict[str, JointFit]:
    """Describe the fit of each joint that moves long enough; up to half of its blocks can be held out."""
    fits = {}
    for joint in joints:
        samples, blocks = _counts(rows, joint)
        if 2 * blocks >= MIN_BLOCKS and samples >= MIN_SAMPLES_PER_PARAMETER * len(joint.parameters):
            fits[joint.name] = _joint_fit(fit, joint, samples, blocks)
    return fits


def _counts(rows: Sequence[DirectRows], joint: JointColumns) -> tuple[int, int]:
    """Count the samples and blocks in which all rows of a joint's friction are used."""
    parts = [part for part in rows if np.isin(joint.kinds, part.kind).all()]
    blocks = [part.clusters[0, part.used[:, np.isin(part.kind, joint.kinds)].all(axis=1)] for part in parts]
    return sum(len(labels) for labels in blocks), len({*(number for labels in blocks for number in labels.tolist())})


def _joint_fit(fit: DirectFit, joint: JointColumns, samples: int, blocks: int) -> JointFit:
    span = slice(joint.first, joint.first + len(joint.parameters))
    of_all = slice(fit.change.size + span.start, fit.change.size + span.stop)
    values, covariance = fit.coefficients[span], fit.covariance[of_all, of_all]
    errors, freedom = np.sqrt(np.diag(covariance)), fit.freedom[of_all]
    bounds = np.array([(parameter.lower, parameter.upper) for parameter in joint.parameters])
    intervals = intervals_95(values, errors, freedom, np.zeros(len(values), dtype=bool))
    return JointFit(
        parameters=joint.parameters,
        values=values,
        standard_errors=errors,
        covariance=covariance,
        intervals=np.clip(intervals, bounds[:, :1], bounds[:, 1:]),
        degrees_of_freedom=freedom,
        at_bound=fit.held[span] | near_bound(joint.parameters, values, errors, joint.units),
        rms=float(np.linalg.norm(fit.deviation[list(joint.kinds)])),
        samples=samples,
        blocks=blocks,
        converged=fit.converged,
    )


def _corrections(fit: DirectFit, joints: Sequence[JointColumns], names: Sequence[str], model: Array) -> Corrections:
    """Describe the corrections, given the parameters of the bodies in the model, shape (L, 10).

    Massless bodies are omitted, and so are shape errors at the limit of physically possible shapes.
    """
    turn, kept = np.eye(len(fit.covariance)), [k for k in range(len(names)) if model[k, 0] > 0]
    told = {}  # number of coordinates per body
    for k in kept:
        span = slice(SIZE * k, SIZE * (k + 1))
        slopes = _slopes(model[k] + fit.change[k], np.sqrt(np.diag(fit.covariance)[span]))
        told[k] = SIZE if np.isfinite(slopes).all() else 4  # mass and center, without the shape
        turn[span, span][: told[k]] = slopes[: told[k]]
    covariance = turn @ fit.covariance @ turn.T
    errors = np.sqrt(np.diag(covariance))
    bodies = {}
    for k in kept:
        mass, after = float(np.sqrt(fit.covariance[SIZE * k, SIZE * k])), model[k] + fit.change[k]
        centre, shape = (errors[SIZE * k + first : SIZE * k + last] for first, last in ((1, 4), (4, SIZE)))
        said = tuple(shape.tolist()) if told[k] == SIZE else None
        bodies[names[k]] = body_correction(model[k], after, mass, centre, float(fit.known[k]), said)
    places = [fit.change.size + joint.first + k for joint in joints for k in range(len(joint.parameters))]
    places += [SIZE * k + coordinate for k in kept for coordinate in range(told[k])]
    return Corrections(
        chi_square=1.0,
        disagreement=fit.overdispersion,
        bodies=bodies,
        correlation=ErrorCorrelation.of(
            [
                *(f"{joint.name}.{parameter.name}" for joint in joints for parameter in joint.parameters),
                *(f"{names[k]}.{coordinate}" for k in kept for coordinate in BODY_COORDINATES[: told[k]]),
            ],
            covariance[np.ix_(places, places)],
        ),
    )


def _slopes(parameters: Array, errors: Array) -> Array:
    """Compute the derivatives of a body's log-Cholesky coordinates with respect to its parameters, shape (10, 10)."""
    step = 1e-4  # [standard errors]
    steps = step * np.diag(errors)
    ahead, behind = (log_cholesky(pseudo_inertia(parameters + sign * steps)) for sign in (1, -1))
    return np.asarray((ahead - behind).T / (2 * step * errors))


DIRECT = Method(
    name="direct",
    uses=(SHARED - {"filter_torque"}) | {"double_support", "regression", "holdout", "priors.mass"},
    laws=("coulomb-viscous", "asymmetric"),
    defaults=lambda _: {"law": "coulomb-viscous"},
    find=find,
    wrenches=False,
)
