"""Fig. 7.2: effect of Savitzky-Golay and Butterworth filters on the right knee's friction.

The log of the contact simulator is exact, therefore the filter causes all errors. As in the paper, the acceleration is
filtered and the torque is not. To keep impacts out of the widest window, 0.1 s are excluded at both ends of a swing.
"""

import numpy as np

from stribeck import Settings
from stribeck.differentiation.savitzky_golay import savgol_cutoff
from stribeck.friction import get_law
from stribeck.judgement.curve_fit.fit import fit_joint
from stribeck.judgement.curve_fit.problem import joint_problem
from stribeck.settings import FilterSettings, SupportSettings
from stribeck_simulation.run import Simulated
from studies.markdown import markdown_table
from studies.paper.estimate import Estimate, estimate, rms
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
    found = {name: _estimate(walk, kind) for name, kind in kinds.items()}
    both = {name: _estimate(walk, kinds[name], filter_torque=True) for name in ("31", "151")}
    averaged = {name: _estimate(walk, kinds[name], averaged_law=True) for name in ("11", "31", "151")}
    return {
        "equal_cutoff": equal,
        "filters": {name: _errors(each) | _fit(each) for name, each in found.items()},
        "torque_too": {name: _errors(each) | _fit(each) for name, each in both.items()},
        "law_averaged": {name: _errors(each) | _fit(each, averaged_law=True) for name, each in averaged.items()},
        "truth": walk.truth.parameters[KNEE],
    }


def _butterworth(cutoff: float) -> FilterSettings:
    return FilterSettings(kind="butterworth", order=BUTTERWORTH_ORDER, cutoff=float(cutoff))


def _estimate(
    walk: Simulated, kind: FilterSettings, *, filter_torque: bool = False, averaged_law: bool = False
) -> Estimate:
    settings = Settings(filter=kind, support=SUPPORT, filter_torque=filter_torque, averaged_law=averaged_law)
    return estimate(walk, settings)


def _errors(found: Estimate) -> dict[str, float]:
    """Compute the RMS error of the swinging knee in the Stribeck part and in the straight part of its curve [N m]."""
    knee = swinging(found, "knee")
    speed, error = np.abs(knee.velocity), knee.torque - knee.truth
    return {"slow": rms(error[speed < SLOW]), "fast": rms(error[speed > FAST])}


def _fit(found: Estimate, averaged_law: bool = False) -> dict[str, float]:
    """Fit the law's parameters to the filtered curve."""
    law, settings = get_law("stribeck"), Settings(averaged_law=averaged_law)
    fit = fit_joint(joint_problem(found.samples, KNEE, law, settings))
    return dict(zip(fit.names, map(float, fit.values), strict=True))


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
    rows += [
        (f"{_name(name, 0)}, {label}", *(_short(row[key]) for key in columns))
        for case, label in (("torque_too", "torque too"), ("law_averaged", "law averaged"))
        for name, row in numbers[case].items()
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
