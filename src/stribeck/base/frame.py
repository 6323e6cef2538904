"""Pandas tables, which need an optional package."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stribeck.errors import SettingsError

if TYPE_CHECKING:
    import pandas


def data_frame(caller: str, data: Any, columns: tuple[str, ...] | None = None) -> pandas.DataFrame:
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
    return pandas.DataFrame(data, columns=columns)
