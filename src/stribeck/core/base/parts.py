"""Parts of the program by name, which this and other packages declare as entry points."""

from collections import UserDict
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar, TypeVar

T = TypeVar("T")


class Parts(UserDict[str, T]):
    """Parts of one kind by name; a part is loaded at its first use. Objects of one group share their parts.

    Parameters
    ----------
    group
        Group of the entry points, e.g. "stribeck.laws".
    """

    _groups: ClassVar[dict[str, dict[str, Any]]] = {}

    def __init__(self, group: str) -> None:
        self._group = group

    @property
    def data(self) -> dict[str, T | EntryPoint]:  # type: ignore[override]
        """Parts and entry points that are not loaded yet."""
        if self._group not in self._groups:
            self._groups[self._group] = {point.name: point for point in entry_points(group=self._group)}
        return self._groups[self._group]

    def __getitem__(self, name: str) -> T:
        part = self.data[name]
        if isinstance(part, EntryPoint):
            self.data[name] = part = part.load()
        return part


SERVICES = Parts[Any]("stribeck.services")
"""Functions by name that the core calls in other rooms: readers of logs, checks around a fit, filters, an observer."""
