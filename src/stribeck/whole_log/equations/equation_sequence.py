"""The equations of whole logs as a sequence that is never all in memory."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from stribeck.whole_log.equations.build import WeakForm
from stribeck.whole_log.equations.constants import MOST_LOG_OFFSETS
from stribeck.whole_log.equations.log_offsets import with_log_offsets
from stribeck.whole_log.equations.segments import Segment
from stribeck.whole_log.weak_equations import CorrectionLayout, WeakEquations


@dataclass(frozen=True, eq=False)
class EquationSequence(Sequence[WeakEquations]):
    """The equations of several logs' segments with their gait phases, computed when they are asked for.

    Attributes
    ----------
    forms
        Weak form of each log.
    parts
        Number of the log, segment, and gait phase of each part.
    """

    forms: tuple[WeakForm, ...]
    parts: tuple[tuple[int, Segment, int], ...]

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, k: int) -> WeakEquations:  # type: ignore[override]
        log, segment, gait = self.parts[k]
        return with_log_offsets(self.forms[log].equations(segment, gait), log, self.corrections.log_offsets)

    def delayed(self, delay: float) -> "EquationSequence":
        """Return the same equations with torques that come `delay` [s] after the motion.

        Segments are the same for all delays up to 0.02 s; for longer ones they lose the rows whose torques the log
        lacks.
        """
        forms = tuple(replace(form, delay=delay) for form in self.forms)
        cut = ((log, forms[log].delayed(segment), gait) for log, segment, gait in self.parts)
        return EquationSequence(forms, tuple((log, segment, gait) for log, segment, gait in cut if segment))

    @property
    def corrections(self) -> CorrectionLayout:
        """Those of every log, and contrasts of the offsets where there are several logs, but not many."""
        contrasts, joints = len(self.forms) - 1, len(self.forms[0].joints)
        few = 0 < contrasts * joints <= MOST_LOG_OFFSETS
        return replace(self.forms[0].corrections, log_offsets=(contrasts, joints) if few else (0, 0))

    @property
    def feet(self) -> tuple[tuple[str, ...], ...]:
        """The feet that each segment stands on."""
        return tuple(segment.feet for _, segment, _ in self.parts)

    @property
    def gaits(self) -> int:
        """How many gait phases there are."""
        return 1 + max((gait for _, _, gait in self.parts), default=-1)


def equation_sequence(forms: Sequence[WeakForm]) -> EquationSequence:
    """Return the equations of all segments of some logs; every log's contact modes are gait phases of their own."""
    gaits: dict[tuple[int, tuple[str, ...]], int] = {}
    parts = []
    for number, form in enumerate(forms):
        for segment in form.segments:
            steps = segment.begins is not None or segment.ends is not None
            gait = gaits.setdefault((number, segment.feet), len(gaits)) if steps else -1
            parts.append((number, segment, gait))
    return EquationSequence(tuple(forms), tuple(parts))
