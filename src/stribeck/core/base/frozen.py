"""Read-only dictionaries of frozen dataclasses."""

from dataclasses import fields
from typing import Any, Never, TypeVar

Key = TypeVar("Key")
Value = TypeVar("Value")


class FrozenDict(dict[Key, Value]):
    """Dictionary that cannot be changed; unlike a MappingProxyType, it can be pickled and copied."""

    def _refuse(self, *_: object, **__: object) -> Never:
        raise TypeError("this dictionary is read-only; change a copy: dict(...)")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenDict, (dict(self),)


def freeze_dicts(owner: Any) -> None:
    """Make the dictionaries in the fields of a frozen dataclass read-only."""
    for field in fields(owner):
        value = getattr(owner, field.name)
        if type(value) is dict:
            object.__setattr__(owner, field.name, FrozenDict(value))
