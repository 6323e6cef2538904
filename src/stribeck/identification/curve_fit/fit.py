"""Friction law parameters of every joint from its friction torque samples, (6.4)."""

from stribeck.friction import FrictionLaw
from stribeck.identification.curve_fit.descent import ROUGH, Descent, descend
from stribeck.identification.curve_fit.problem import FitProblem, hold_out, joint_problem
from stribeck.identification.curve_fit.robust import TUNING, Loss, robust_scale
from stribeck.identification.curve_fit.starts import grid_starts
from stribeck.identification.joint_fit import JointFit as JointFit
from stribeck.identification.joint_fit import describe_fit
from stribeck.identification.judgement.excitation import excitation
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.threads import one_blas_thread

SUBSET = 4000
"""Samples [1] on which starts are tried; the best one is finished on all."""

BEST_STARTS = 3
"""Grid points [1] that are followed to their minimum."""


def fit_law(samples: Samples, law: FrictionLaw, settings: Settings) -> dict[str, JointFit]:
    """Fit a law to every joint that moves enough; every n-th block is held out.

    Whether the numbers mean anything is for `verdict.judge` to say.
    """
    fits = {}
    for column, joint in enumerate(samples.joint_names):
        problem = joint_problem(samples, joint, law, settings)
        if not excitation(problem, samples.slides(column)).reason:
            training, _ = hold_out(problem, settings.holdout)
            fits[joint] = fit_joint(training, settings.loss)
    return fits


def fit_joint(problem: FitProblem, loss: Loss = "linear") -> JointFit:
    """Fit one joint: many starts and a few descents on a subset, the best one finished on all samples.

    The problem needs samples of at least two blocks: intervals come from how blocks differ.
    """
    # decompositions of tall, narrow Jacobians are several times slower on two BLAS threads than on one
    with one_blas_thread():
        best, loss_scale = _minimise(problem, loss)
        return describe_fit(problem, best, loss, loss_scale)


def _minimise(problem: FitProblem, loss: Loss) -> tuple[Descent, float]:
    """Return the best minimum, and the scale of the loss [N m], 0 if it has none."""
    step = -(-len(problem.velocity) // SUBSET)
    subset = problem.take(slice(None, None, step))
    starts = grid_starts(subset)
    descents = [descend(subset, values, tolerance=ROUGH) for _, values in starts[:BEST_STARTS]]
    best = min(descents, key=lambda descent: descent.cost)
    loss_scale = 0.0
    if loss != "linear":  # twice: outliers inflate the first scale
        for _ in range(2):
            loss_scale = TUNING[loss] * robust_scale(subset.predict(best.values) - subset.friction_torque)
            best = descend(subset, best.values, loss, loss_scale, ROUGH)
    return descend(problem, best.values, loss, loss_scale), loss_scale
