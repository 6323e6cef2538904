"""Zero-phase position, velocity and acceleration from positions, and the choice of the cutoff from the spectrum."""

from stribeck.differentiation.cutoff import CutoffChoice as CutoffChoice
from stribeck.differentiation.cutoff import choose_cutoff as choose_cutoff
from stribeck.differentiation.filters import Filter as Filter
from stribeck.differentiation.filters import make_filter as make_filter
from stribeck.differentiation.filters import resolve_auto as resolve_auto
from stribeck.differentiation.savitzky_golay import savgol_cutoff as savgol_cutoff
from stribeck.differentiation.savitzky_golay import savgol_kernels as savgol_kernels
from stribeck.differentiation.savitzky_golay import savgol_window as savgol_window
