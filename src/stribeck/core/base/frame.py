"""Tables in memory: of any library with the Arrow interface, and of pandas, which is an optional package."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from stribeck.core.errors import SettingsError

if TYPE_CHECKING:
    import pandas


@runtime_checkable
class Frame(Protocol):
    """Table in memory: of pandas, polars or another library with the Arrow interface."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """Export the table as an Arrow stream."""


def data_frame(
    caller: str, data: Any, columns: tuple[str, ...] | None = None, index: tuple[str, ...] | None = None
) -> pandas.DataFrame:
    """Make a pandas table of rows or columns.

    Raises
    ------
    SettingsError
        If pandas is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        raise SettingsError(f"{caller}: needs pandas: pip install pandas") from error
    return pandas.DataFrame(data, columns=columns, index=index)
