"""Parts of the program by name, which this and other packages declare as entry points."""

from collections.abc import Iterator, MutableMapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar, Generic, TypeVar

T = TypeVar("T")


class Parts(MutableMapping[str, T], Generic[T]):
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
    def _parts(self) -> dict[str, T | EntryPoint]:
        if self._group not in self._groups:
            self._groups[self._group] = {point.name: point for point in entry_points(group=self._group)}
        return self._groups[self._group]

    def __getitem__(self, name: str) -> T:
        part = self._parts[name]
        if isinstance(part, EntryPoint):
            self._parts[name] = part = part.load()
        return part

    def __setitem__(self, name: str, part: T) -> None:
        self._parts[name] = part

    def __delitem__(self, name: str) -> None:
        del self._parts[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)

    def __contains__(self, name: object) -> bool:
        return name in self._parts


SERVICES = Parts[Any]("stribeck.services")
"""Functions by name that the core calls in other rooms: readers of logs, checks around a fit, filters, an observer."""
