"""Coverage of the 95 % intervals.

    python studies/coverage.py --repetitions 200 --save studies/coverage.json

A joint with a known smooth Stribeck law moves in every repetition along another smooth random path, in steps of about
0.65 s, as the swing legs of a walk do. Its sensors are noisy: torque noise is white; encoder noise goes through the
Savitzky-Golay kernels into velocity and, times the joint's inertia, into friction torque, where it is strongly
correlated from sample to sample; an error that lasts a step stands for a base orientation that is off. The study counts
how often the interval of each parameter covers the true value.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import savgol_coeffs

from stribeck.friction import get_law
from stribeck.identification.curve_fit.fit import fit_law
from stribeck.samples import Samples
from stribeck.settings import Settings
from stribeck.typing import Array

PERIOD = 1e-3
"""Sampling period of the log [s]."""

STEP = 650
"""Samples of a step that are used [1]: single support of 0.8 s without its trimmed ends."""

FREQUENCIES = (0.7, 1.3, 2.1)
"""Of the sines that make a path [Hz]; a walk has a little more than one step a second."""

INERTIA = 0.5
"""Effective inertia of the joint [kg m^2], a humanoid's knee: what acceleration noise is multiplied by."""

TRUTH = {
    "viscous": 0.2,
    "coulomb": 1.0,
    "stribeck_gain": 0.2,
    "stribeck_velocity": 0.2,
    "offset": 1.0,
    "slope": 40.0,
}
"""The knee of the paper's Table 6.1, units as the law's."""


@dataclass(frozen=True)
class Case:
    """One level of noise and what the study varies with it."""

    steps: int  # usable steps of the log
    encoder: float  # standard deviation of the encoder's noise [rad]
    torque: float  # standard deviation of the torque sensor's noise [N m]
    window: int  # Savitzky-Golay window [samples], order 4
    step_error: float = 0.0  # standard deviation of a torque error that lasts a whole step [N m]


CASES = {
    "20 steps, good sensors": Case(20, 1e-5, 0.1, 31),
    "40 steps, good sensors": Case(40, 1e-5, 0.1, 31),
    "60 steps, fair sensors": Case(60, 2e-5, 0.1, 31),
    "40 steps, poor sensors": Case(40, 1e-4, 0.3, 51),
    "40 steps, another error each step": Case(40, 1e-5, 0.1, 31, 0.1),
    "10 steps, good sensors": Case(10, 1e-5, 0.1, 31),
}


def noisy_samples(case: Case, rng: np.random.Generator) -> Samples:
    """Return the friction torque samples of one joint over a log with the noise of a case."""
    count = case.steps * STEP
    time = PERIOD * np.arange(count, dtype=np.float64)
    phase = 2 * np.pi * np.array(FREQUENCIES)[:, None] * time + rng.uniform(0, 2 * np.pi, (3, 1))
    amplitude = rng.uniform(0.5, 1.0, (3, 1))
    velocity = (amplitude * np.sin(phase)).sum(axis=0)
    torque = get_law("stribeck").torque(velocity, np.array(list(TRUTH.values())))
    encoder = case.encoder * rng.normal(size=count + case.window - 1)
    kernels = [savgol_coeffs(case.window, 4, deriv=order, delta=PERIOD) for order in (1, 2)]
    velocity_noise, acceleration_noise = (np.convolve(encoder, kernel, mode="valid") for kernel in kernels)
    torque += case.torque * rng.normal(size=count) - INERTIA * acceleration_noise
    block = np.arange(count) // STEP
    torque += case.step_error * rng.normal(size=case.steps)[block]
    return Samples(
        joint_names=("knee",),
        period=PERIOD,
        time=time,
        velocity=(velocity + velocity_noise)[:, None],
        acceleration=np.zeros((count, 1)),
        friction_torque=torque[:, None],
        usable=np.ones((count, 1), dtype=bool),
        block=block,
        support=np.zeros(count, dtype=np.int64),
        support_names=("stance_foot",),
    )


def coverage(case: Case, repetitions: int, seed: int = 0) -> dict[str, dict[str, float]]:
    """Return per parameter the coverage of the intervals, and their mean relative error and width."""
    rng = np.random.default_rng(seed)
    truth = np.array(list(TRUTH.values()))
    values = np.empty((repetitions, len(truth)))
    intervals = np.empty((repetitions, len(truth), 2))
    for repetition in range(repetitions):
        fit = fit_law(noisy_samples(case, rng), get_law("stribeck"), Settings())["knee"]
        values[repetition], intervals[repetition] = fit.values, fit.intervals
    held = (intervals[..., 0] <= truth) & (truth <= intervals[..., 1])
    columns: dict[str, Array] = {
        "coverage": held.mean(axis=0),
        "bias": np.median(values, axis=0) / truth - 1,
        "spread": values.std(axis=0) / truth,
        "half_width": np.median(np.diff(intervals)[..., 0], axis=0) / 2 / truth,
    }
    return {
        name: {label: round(float(column[index]), 4) for label, column in columns.items()}
        for index, name in enumerate(TRUTH)
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--save", type=Path, help="write the summary as JSON")
    arguments = parser.parse_args()
    summary = {}
    for label, case in CASES.items():
        summary[label] = coverage(case, arguments.repetitions)
        print(f"{label}, {arguments.repetitions} repetitions; all but coverage relative to the truth")
        print(f"  {'parameter':20}{'coverage':>10}{'bias':>10}{'spread':>10}{'half width':>12}")
        for name, row in summary[label].items():
            numbers = f"{row['coverage']:10.3f}{row['bias']:10.4f}{row['spread']:10.4f}{row['half_width']:12.4f}"
            print(f"  {name:20}{numbers}", flush=True)
    if arguments.save:
        document = {"repetitions": arguments.repetitions, "cases": summary}
        arguments.save.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
