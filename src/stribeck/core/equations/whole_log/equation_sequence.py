"""The equations of whole logs as a sequence that is never all in memory."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.constants import FOLDS, PILOT_SEGMENTS
from stribeck.core.equations.weak_equations import WeakEquations, through_windows
from stribeck.core.equations.whole_log.build import WeakForm
from stribeck.core.equations.whole_log.corrections.correction import Layout
from stribeck.core.equations.whole_log.corrections.model import contrasts_of_logs
from stribeck.core.equations.whole_log.segments import Segment
from stribeck.core.friction.presliding import SMOOTH_SIGN

EFFECTS, MOST_EFFECTS = 3, 400
"""Effects that differ between logs: offset, Coulomb friction, viscous friction; and largest number of effects times
joints times logs but one [1], to save time."""


@dataclass(frozen=True, eq=False)
class EquationSequence(Sequence[WeakEquations]):
    """The equations of several logs' segments with their gait phases, computed when they are requested.

    Attributes
    ----------
    forms
        Weak form of each log.
    parts
        Number of the log, segment, and gait phase of each part.
    top_speed
        Top speed of each joint [rad/s], shape (n,).
    effects
        Largest number of effects that differ between logs, of `EFFECTS`.
    """

    forms: tuple[WeakForm, ...]
    parts: tuple[tuple[int, Segment, int], ...]
    top_speed: Array
    effects: int = EFFECTS

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, k: int) -> WeakEquations:  # type: ignore[override]
        log, segment, gait = self.parts[k]
        equations = self.forms[log].equations(segment, gait)
        contrasts, effects, joints = self.corrections.log_effects
        if not contrasts:
            return equations
        relative = equations.velocity[:, :joints] / self.top_speed[:joints]
        shapes = np.stack([np.ones_like(relative), np.tanh(relative / SMOOTH_SIGN), relative], axis=1)[:, :effects]
        shapes = through_windows(shapes, equations.taps, equations.step)[: len(equations.residual)]
        contrast, weights = contrasts_of_logs(contrasts + 1)[:, log], equations.weights[:, :, :joints]
        columns = np.einsum("c,kmj,kej->kmcej", contrast, weights, shapes).reshape(*equations.residual.shape, -1)
        others = [] if equations.regressors is None else [equations.regressors]
        return replace(equations, regressors=np.concatenate([*others, columns], axis=2))

    def delayed(self, delay: float) -> "EquationSequence":
        """Return the same equations with torques that come `delay` [s] after the motion.

        Segments are the same for all delays up to 0.02 s; for longer ones they lose the rows whose torques the log
        lacks.
        """
        forms = tuple(replace(form, delay=delay) for form in self.forms)
        cut = ((log, forms[log].delayed(segment), gait) for log, segment, gait in self.parts)
        parts = tuple((log, segment, gait) for log, segment, gait in cut if segment)
        return replace(self, forms=forms, parts=parts)

    @property
    def corrections(self) -> Layout:
        """Corrections of every log, and contrasts of the effects that differ between logs; the fewer, the more logs."""
        contrasts, joints = len(self.forms) - 1, len(self.forms[0].joints)
        effects = min(self.effects, MOST_EFFECTS // max(contrasts * joints, 1))
        of_logs = (contrasts, effects, joints) if effects else (0, 0, 0)
        layout = self.forms[0].corrections
        return replace(layout, log_effects=of_logs, sizes={**layout.sizes, "log_effects": math.prod(of_logs)})

    def spread(self, count: int) -> list[int]:
        """Choose about `count` segments over all contact modes.

        Every contact mode gets a share of at least one segment, spread over the mode's segments, because errors of a
        standing leg appear only while it stands. Evenly spaced segments of a walk could all have the same standing
        foot.
        """
        supports, choice = [segment.feet for _, segment, _ in self.parts], set[int]()
        for support in set(supports):
            places = [place for place, feet in enumerate(supports) if feet == support]
            share = max(1, round(count * len(places) / len(supports)))
            choice.update(places[k] for k in np.linspace(0, len(places) - 1, share).astype(int))
        return sorted(choice)

    def folds(self, most: int) -> tuple[list[list[int]], list[int]]:
        """Choose up to `most` segments, evenly spread, in `FOLDS` parts, and other segments that are held out."""
        held_out = self.spread(PILOT_SEGMENTS)[: len(self) // 4]
        others = [k for k in range(len(self)) if k not in held_out]
        every = np.linspace(0, len(others) - 1, min(most, len(others))).round().astype(int)
        count = min(FOLDS, len(every))
        return [[others[place] for place in every[k::count]] for k in range(count)], held_out


def equation_sequence(forms: Sequence[WeakForm], top_speed: Array) -> EquationSequence:
    """Collect the equations of all segments of some logs; each contact mode of each log is one gait phase."""
    gaits: dict[tuple[int, tuple[str, ...]], int] = {}
    parts = []
    for number, form in enumerate(forms):
        for segment in form.segments:
            steps = segment.begins is not None or segment.ends is not None
            gait = gaits.setdefault((number, segment.feet), len(gaits)) if steps else -1
            parts.append((number, segment, gait))
    return EquationSequence(tuple(forms), tuple(parts), np.maximum(top_speed, 1e-9))
