"""Term of the law `auto`, for the fit, results, plans and exports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from stribeck.core.base.typing import Array
from stribeck.core.friction.law import Parameter


@dataclass(frozen=True, eq=False, kw_only=True)
class Seen:
    """Properties of a joint's motion that decide whether the log can show a term.

    Attributes
    ----------
    mean_load, load_deviation
        Mean and standard deviation of its load [N m].
    temperature, duration, chirps
        Temperatures [deg C], None if the log has none, duration of the log [s], and the share of the variance of time
        that the speed explains [1].
    turned
        Standard deviation of the position [rad]; NaN for a prismatic joint.
    settings
        Settings of the term; NaN if the pilot found none.
    """

    mean_load: float
    load_deviation: float
    temperature: Array | None
    duration: float
    chirps: float
    turned: float
    settings: list[float]


@dataclass(frozen=True, eq=False, kw_only=True)
class Term:
    """Term of a joint's friction.

    A column is a product in C and in Python, without its parameter. Its variables are

    - `velocity` v [rad/s] and `rise`, the smooth sign tanh(a v),
    - `load` [N m], `temperature` minus its mean [K], and `elapsed`, time from -1/2 to 1/2,
    - `position` [rad], `near`, the position within the range of the log, `mean_cosine` and `mean_sine`,
    - the settings of the term,

    and its functions `abs`, `lag(travel)` of the past motion (`friction/presliding.py`), and `cos`, `sin` and `tanh` of
    the position. In a fit, variables and functions are averages over windows, so that columns are products of averages.

    Attributes
    ----------
    name, parameters, columns
        Name, parameters, and a column for each. The first parameter is zero without the term. Terms without columns are
        part of `AutoLaw`.
    needs, part_of
        Another term that must be present, and a term that includes the parameters.
    over
        Quantity that the friction depends on in addition to velocity.
    settings, find
        Fields of `JointResult` with settings, and the function that finds them from the residual of the pilot
        (`estimator/model/unexplained.py`): one array of shape (n,) per setting, NaN for a joint without the term.
    refuse
        Function that states why the log cannot show the term; "" if it can.
    doubt
        Function that states why parameter values are implausible, given the terms of the joint; "" if they are not.
    misfit, words, shown
        Kind of the misfit of a law without the term, or "", its description, and a format of the settings.
    """

    name: str
    parameters: tuple[Parameter, ...]
    columns: tuple[str, ...] = ()
    needs: str = ""
    part_of: str = ""
    over: Literal["", "load", "temperature", "time", "position", "travel"] = ""
    settings: tuple[str, ...] = ()
    find: Callable[[Any], Sequence[Array]] | None = None
    refuse: Callable[[Seen], str] = lambda _: ""
    doubt: Callable[[Mapping[str, float], frozenset[str]], str] = lambda *_: ""
    misfit: str = ""
    words: str = ""
    shown: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)


def evaluate(column: str, signals: Mapping[str, Any]) -> Array:
    """Compute a column from signals by name."""
    values: Array = eval(column, {"__builtins__": {}}, signals)  # columns are constants  # nosec B307
    return values


def linear(name: str, symbol: str, unit: str, lower: float = float("-inf")) -> Parameter:
    """Make a parameter that multiplies a column."""
    return Parameter(name=name, symbol=symbol, unit=unit, lower=lower, neutral=0.0)
