"""The equations of whole logs as a sequence that is never all in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stribeck.equations.build import WeakForm
from stribeck.equations.stretches import Stretch
from stribeck.weak_equations import WeakEquations


@dataclass(frozen=True, eq=False)
class Lazily(Sequence[WeakEquations]):
    """The equations of several logs' stretches with their gait phases, worked out when they are asked for."""

    parts: tuple[tuple[WeakForm, Stretch, int], ...]

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, k: int) -> WeakEquations:  # type: ignore[override]
        form, stretch, gait = self.parts[k]
        return form.equations(stretch, gait)

    @property
    def supports(self) -> tuple[tuple[str, ...], ...]:
        """The feet that each stretch stands on."""
        return tuple(stretch.feet for _, stretch, _ in self.parts)

    @property
    def gaits(self) -> int:
        """How many gait phases there are."""
        return 1 + max((gait for _, _, gait in self.parts), default=-1)


def all_equations(forms: Sequence[WeakForm]) -> Lazily:
    """Return the equations of all stretches of some logs; every log's supports are gait phases of their own."""
    gaits: dict[tuple[int, tuple[str, ...]], int] = {}
    parts = []
    for number, form in enumerate(forms):
        for stretch in form.stretches:
            steps = stretch.begins is not None or stretch.ends is not None
            gait = gaits.setdefault((number, stretch.feet), len(gaits)) if steps else -1
            parts.append((form, stretch, gait))
    return Lazily(tuple(parts))
