"""The filter of the settings, for the positions of a log."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from stribeck.core.base.parts import SERVICES
from stribeck.core.base.typing import Array
from stribeck.core.errors import SettingsError
from stribeck.core.filters.averaging import implied_weights
from stribeck.core.filters.savitzky_golay import correlate_valid, savgol_cutoff, savgol_kernels, savgol_window
from stribeck.core.settings import FilterSettings

TAKES = {
    "auto": {"order"},
    "savitzky-golay": {"window", "order", "cutoff"},
    "butterworth": {"order", "cutoff"},
    "log": set[str](),
}
"""Settings that each kind of filter uses."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Filter:
    """Filter for evenly sampled signals. It drops edges that it cannot filter from both sides.

    Attributes
    ----------
    name
        Description for the report.
    half_width
        Number of samples dropped at each end. Chunks that overlap by `2 half_width` give the same output as a whole
        log.
    run
        Function `run(signal, orders)` that computes filtered derivatives of these orders, for a signal of shape (T, n).
    weights
        Weights of second differences in the acceleration, shape (2 half_width + 1,), sum 1; None if they are infinite.
    """

    name: str
    half_width: int
    run: Callable[[Array, tuple[int, ...]], tuple[Array, ...]]
    weights: Array | None

    def apply(self, position: Array) -> tuple[Array, Array, Array]:
        """Compute position, velocity and acceleration, shape (T - 2 half_width, n) each, from positions (T, n).

        A signal shorter than the filter gives empty arrays.
        """
        filtered, velocity, acceleration = self.run(position, (0, 1, 2))
        return filtered, velocity, acceleration

    def smooth(self, signal: Array) -> Array:
        """Smooth another signal of shape (T, n), e.g. the torque, as `apply` smooths the position."""
        return self.run(signal, (0,))[0]

    def average(self, signal: Array) -> Array:
        """Average another signal of shape (T, n), e.g. the torque, as `apply` averages the acceleration.

        Raises
        ------
        SettingsError
            If the filter has no finite window.
        """
        return correlate_valid(signal, self.window_weights()[None], (0,))[0]

    def window_weights(self) -> Array:
        """Return the weights.

        Raises
        ------
        SettingsError
            If the filter has no finite window.
        """
        if self.weights is None:
            raise SettingsError(
                "[identify] averaged_law is true, but the filter of kind 'butterworth' has no finite window; "
                "set its kind to 'auto' or 'savitzky-golay', or averaged_law to false"
            )
        return self.weights


@dataclass(frozen=True, eq=False, kw_only=True)
class CutoffChoice:
    """Cutoff frequency and the reason for it.

    Attributes
    ----------
    cutoff
        -3 dB frequency of the position kernel [Hz].
    window
        Window of the Savitzky-Golay filter of order 4 with this cutoff [samples].
    reason
        Reason in one sentence with numbers, for the user.
    """

    cutoff: float
    window: int
    reason: str


def make_filter(settings: FilterSettings, period: float) -> Filter:
    """Make the filter of the settings.

    Parameters
    ----------
    settings
        Settings of any kind but "auto", which `choose_cutoff` and `resolve_auto` turn into "savitzky-golay". A filter
        of kind "log" passes everything through; velocity and acceleration then come from the log.
    period
        Sampling period [s].

    Raises
    ------
    SettingsError
        If the settings contradict each other or do not suit the sampling period.
    """
    _refuse_unused(settings)
    if settings.kind == "savitzky-golay":
        return _make_savitzky_golay(settings, period)
    if settings.kind == "butterworth":
        return cast(Filter, SERVICES["butterworth"](settings, period))
    if settings.kind == "log":
        name = "none: the log's own velocity and acceleration"
        return Filter(name=name, half_width=0, run=_pass_through, weights=np.ones(1))
    raise SettingsError("[identify.filter] kind is 'auto'; its cutoff must be chosen from a log before it can filter")


def sharper_filter(settings: FilterSettings, period: float) -> Filter:
    """Make the filter with half the window, to resolve events within the full window; unchanged if it has no window."""
    whole = make_filter(settings, period)
    if settings.kind != "savitzky-golay":
        return whole
    shortest = settings.order + 1 + settings.order % 2
    half = max(whole.half_width // 2 * 2 + 1, shortest)
    return make_filter(settings.model_copy(update={"window": half, "cutoff": None}), period)


def resolve_auto(settings: FilterSettings, choice: CutoffChoice) -> FilterSettings:
    """Replace "auto" by the Savitzky-Golay filter with the chosen cutoff.

    Raises
    ------
    SettingsError
        If "auto" has a window or a cutoff.
    """
    _refuse_unused(settings)
    return settings.model_copy(update={"kind": "savitzky-golay", "cutoff": choice.cutoff})


def _refuse_unused(settings: FilterSettings) -> None:
    for key, field in FilterSettings.model_fields.items():
        if key != "kind" and key not in TAKES[settings.kind] and getattr(settings, key) != field.default:
            kinds = " or ".join(f"'{kind}'" for kind, keys in TAKES.items() if key in keys)
            raise SettingsError(
                f"[identify.filter] {key} is {getattr(settings, key)!r}, which the filter of kind "
                f"'{settings.kind}' does not use; remove it, or set kind to {kinds}"
            )


def _make_savitzky_golay(settings: FilterSettings, period: float) -> Filter:
    window = settings.window
    if window is not None and settings.cutoff is not None:
        both = f"window is {window} and cutoff is {settings.cutoff:g} Hz"
        raise SettingsError(f"[identify.filter] {both}; give only one of them")
    if settings.cutoff is not None:
        window = savgol_window(settings.cutoff, settings.order, 1 / period)
    if window is None:
        raise SettingsError("[identify.filter] kind 'savitzky-golay' needs a window [samples] or a cutoff [Hz]")
    kernels = savgol_kernels(window, settings.order, period)
    cutoff = savgol_cutoff(window, settings.order, 1 / period)
    name = f"Savitzky-Golay, window {window}, order {settings.order}, -3 dB at {cutoff:.3g} Hz"
    return finite_filter(name, kernels, implied_weights(kernels[2], period))


def finite_filter(name: str, kernels: Array, weights: Array) -> Filter:
    """Build a filter from kernels of position, velocity and acceleration, shape (3, L)."""

    def run(signal: Array, orders: tuple[int, ...]) -> tuple[Array, ...]:
        return correlate_valid(signal, kernels[list(orders)], orders)

    return Filter(name=name, half_width=kernels.shape[1] // 2, run=run, weights=weights)


def _pass_through(signal: Array, orders: tuple[int, ...]) -> tuple[Array, ...]:
    if orders != (0,):
        raise SettingsError("[identify.filter] kind is 'log', which takes velocity and acceleration from the log")
    return (signal,)
