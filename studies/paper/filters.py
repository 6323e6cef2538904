"""Fig. 7.2: effect of Savitzky-Golay and Butterworth filters on the right knee's friction.

The log of the contact simulator is exact, therefore the filter causes all errors. As in the paper, the acceleration is
filtered and the torque is not. To keep impacts out of the widest window, 0.1 s are excluded at both ends of a swing.
"""

import numpy as np

from stribeck import Settings
from stribeck.differentiation.savitzky_golay import savgol_cutoff
from stribeck.settings import FilterSettings, SupportSettings
from stribeck_simulation.run import Simulated
from studies.markdown import markdown_table
from studies.paper.estimate import estimate, fit_law, rms
from studies.paper.study import Numbers
from studies.paper.swing import swinging
from studies.paper.walks import get_walk

WALKS = ("right-knee-contact",)
KNEE = "right_knee"
RATE = 1000.0
"""Rate of the log [Hz]."""
WINDOWS = (11, 31, 51, 101, 151)
"""Windows of the Savitzky-Golay filters [samples]; the paper uses 151 in its Fig. 7.3 and 7.4."""
BUTTERWORTH_ORDER = 6
SLOW, FAST = 0.6, 1.2
"""Upper end of the curve's Stribeck part, and lower end of its straight part: 3 and 6 Stribeck velocities [rad/s]."""
SUPPORT = SupportSettings(trim_start=0.1, trim_end=0.1)


def run(quick: bool) -> Numbers:
    walk = get_walk("right-knee-contact", quick)
    equal = savgol_cutoff(WINDOWS[-1], 4, RATE)
    kinds = {str(window): FilterSettings(kind="savitzky-golay", window=window) for window in WINDOWS}
    kinds["Butterworth"] = _butterworth(equal)
    # the paper's 10 Hz is the cutoff of one pass; both passes together have -6 dB there
    kinds["Butterworth, 10 Hz a pass"] = _butterworth(10 * (np.sqrt(2) - 1) ** (1 / (2 * BUTTERWORTH_ORDER)))
    return {
        "equal_cutoff": equal,
        "filters": {name: _filtered(walk, kind) for name, kind in kinds.items()},
        "truth": walk.truth.parameters[KNEE],
    }


def _butterworth(cutoff: float) -> FilterSettings:
    return FilterSettings(kind="butterworth", order=BUTTERWORTH_ORDER, cutoff=float(cutoff))


def _filtered(walk: Simulated, kind: FilterSettings) -> dict[str, float]:
    """Compute the swinging knee's RMS error in both parts of its curve [N m], and the fitted parameters of the law."""
    found = estimate(walk, Settings(filter=kind, support=SUPPORT, filter_torque=False))
    knee = swinging(found, "knee")
    speed, error = np.abs(knee.velocity), knee.torque - knee.truth
    return {"slow": rms(error[speed < SLOW]), "fast": rms(error[speed > FAST])} | fit_law(found, KNEE, Settings())[0]


def texts(numbers: Numbers) -> dict[str, str]:
    """Format errors and fitted parameters, one row per filter, and the numbers that sentences quote."""
    columns = {
        "slow": f"error below {SLOW} rad/s [N m]",
        "fast": f"above {FAST} rad/s [N m]",
        "coulomb": "Fc [N m]",
        "viscous": "Fv [N m s/rad]",
        "stribeck_gain": "S",
        "stribeck_velocity": "vs [rad/s]",
        "slope": "slope [s/rad]",
    }
    rows = [
        (_name(name, numbers["equal_cutoff"]), *(_short(row[key]) for key in columns))
        for name, row in numbers["filters"].items()
    ]
    rows.append(("truth", "", "", *(f"{numbers['truth'][key]:g}" for key in list(columns)[2:])))
    savgol, butter = numbers["filters"][str(WINDOWS[-1])], numbers["filters"]["Butterworth"]
    return {
        "table": markdown_table(("filter", *columns.values()), rows),
        "equal": f"{numbers['equal_cutoff']:.1f} Hz",
        "slow-31": f"{numbers['filters']['31']['slow']:.2g} N m",
        "slow-savgol": f"{savgol['slow']:.2g} N m",
        "slow-butterworth": f"{butter['slow']:.2g} N m",
        "fast-savgol": f"{savgol['fast']:.2g} N m",
        "fast-butterworth": f"{butter['fast']:.2g} N m",
        "gain-savgol": f"{savgol['stribeck_gain']:.1f}",
    }


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def _name(name: str, equal: float) -> str:
    if name.isdigit():
        return f"Savitzky-Golay, window {name} ({savgol_cutoff(int(name), 4, RATE):.0f} Hz)"
    return f"{name} ({equal:.0f} Hz)" if name == "Butterworth" else name
