"""Sums up the normal equations of many segments (docs/estimator.md, equation 12), by threads."""

from collections.abc import Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import replace
from threading import Event, Lock

from stribeck.whole_log.constants import COSINES, THREADS
from stribeck.whole_log.fit_checks.alternative_terms import AlternativeTerms
from stribeck.whole_log.model.friction_curves import Curves
from stribeck.whole_log.model.layout import ModelLayout
from stribeck.whole_log.model.model_corrections import ModelCorrections
from stribeck.whole_log.noise.outliers import Prediction
from stribeck.whole_log.noise.variance_components import VarianceComponents
from stribeck.whole_log.solver.normal_equations import NormalEquations, merged
from stribeck.whole_log.weak_equations import WeakEquations

ByWorker = Sequence[NormalEquations]
"""The normal equations of each worker."""


def accumulate(
    equations: Sequence[WeakEquations],
    components: VarianceComponents,
    curves: Curves,
    model: ModelCorrections,
) -> NormalEquations:
    """Return the normal equations of segments."""
    own = _nothing(curves, model)
    _share_out(equations, components, [(place, own, None) for place in range(len(equations))])
    return merged(own)


def accumulate_folds(
    equations: Sequence[WeakEquations],
    folds: Sequence[tuple[Sequence[int], Sequence[int]]],
    prediction: Prediction,
    gaits: int = 0,
    alternatives: AlternativeTerms | None = None,
) -> tuple[list[NormalEquations], NormalEquations]:
    """Return the normal equations of folds, and those of a sample of all segments, with more columns.

    Parameters
    ----------
    equations
        Of all segments.
    folds
        Places of the segments of each: of those in the sample, and of the others.
    prediction
        By the pilot fit, whose curves, model and components are used; windows far from it are set aside.
    gaits, alternatives
        The further columns: random effects of so many gait phases, and alternative terms.
    """
    curves, model, components = prediction.parameters.curves, prediction.parameters.model, prediction.components
    effects = COSINES * (len(curves.top_speed) + len(components.root_turns))
    more = {"gaits": gaits, "gait_effects": effects, "alternatives": alternatives.size if alternatives else 0}
    layout = replace(_layout(curves, model), **more)
    shares = [NormalEquations(curves.basis, layout, alternatives) for _ in range(THREADS)]
    by_fold = [_nothing(curves, model) for _ in folds]
    tasks: list[tuple[int, ByWorker, ByWorker | None]] = []
    for (sampled, others), own in zip(folds, by_fold, strict=True):
        tasks += [(place, shares, own) for place in sampled]
        tasks += [(place, own, None) for place in others]
    _share_out(equations, components, tasks, prediction)
    return [merged(own) for own in by_fold], merged(shares)


def _nothing(curves: Curves, model: ModelCorrections) -> ByWorker:
    return [NormalEquations(curves.basis, _layout(curves, model)) for _ in range(THREADS)]


def _layout(curves: Curves, model: ModelCorrections) -> ModelLayout:
    """Return the layout of curves' coefficients and corrections."""
    joints = len(curves.top_speed)
    return model.layout.beside(joints, curves.basis.size // joints)


def _share_out(
    equations: Sequence[WeakEquations],
    components: VarianceComponents,
    tasks: Sequence[tuple[int, ByWorker, ByWorker | None]],
    prediction: Prediction | None = None,
) -> None:
    """Add equations by threads in turn, each in an order that never changes.

    A task is the place of the equations, the normal equations that they are added to, and those of their core, if any.
    One thread at a time computes equations: Pinocchio's working memory is not for two.
    """
    making, over = Lock(), Event()

    def work(worker: int) -> None:
        for place, whole, core in tasks[worker::THREADS]:
            if over.is_set():
                return
            with making:
                part = equations[place]
            whole[worker].add(part, components, core[worker] if core else None, prediction)

    with ThreadPoolExecutor(THREADS) as pool:
        try:
            done, _ = wait([pool.submit(work, worker) for worker in range(THREADS)], return_when=FIRST_EXCEPTION)
        finally:
            over.set()  # nobody waits for what an error, or Ctrl-C, has made useless
    for each in done:
        each.result()
