"""Zero-phase position, velocity and acceleration from positions, and the choice of the cutoff from the spectrum."""

from stribeck.core.filters.filters import CutoffChoice as CutoffChoice
from stribeck.core.filters.filters import Filter as Filter
from stribeck.core.filters.filters import make_filter as make_filter
from stribeck.core.filters.filters import resolve_auto as resolve_auto
from stribeck.core.filters.savitzky_golay import savgol_cutoff as savgol_cutoff
from stribeck.core.filters.savitzky_golay import savgol_kernels as savgol_kernels
from stribeck.core.filters.savitzky_golay import savgol_window as savgol_window
