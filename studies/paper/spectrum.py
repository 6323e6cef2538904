"""Fig. 7.1: spectra of the model's acceleration of knee and hip pitch, and the cutoff that `auto` chooses.

For comparison, the measured acceleration is the second difference of the unfiltered position.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.signal import periodogram

from stribeck import Settings
from stribeck.base.typing import Array
from stribeck.differentiation import make_filter
from stribeck.differentiation.savitzky_golay import savgol_cutoff
from stribeck.friction_torque.preparation import prepare
from stribeck.friction_torque.stage import with_filter
from stribeck.settings import FilterSettings
from stribeck_simulation.run import Simulated
from stribeck_simulation.sensors.measure import measure, sensors_for
from stribeck_simulation.sensors.profiles import get_profile
from studies.markdown import markdown_table
from studies.paper.acceleration import model_acceleration
from studies.paper.estimate import estimate
from studies.paper.study import Numbers
from studies.paper.swing import JOINTS, swinging
from studies.paper.walks import get_walk

WALKS = ("legs-contact", "harsh")
SHOWN = ("knee", "hip_pitch")
PAPER = 10.0
"""Cutoff of the paper [Hz]."""
NOISE = (200.0, 450.0)
"""Band in which a spectrum contains only noise [Hz]."""
UNFILTERED = Settings(filter=FilterSettings(kind="savitzky-golay", window=7))
"""Settings with a short filter: the model's acceleration depends on velocity, but not on measured acceleration."""
BINS = np.geomspace(1.2, 500.0, 61)
"""Edges of the bins over which densities are averaged [Hz]."""
SEED = 1


class Spectra(NamedTuple):
    """Spectral densities of the acceleration of the swinging leg's joints [(rad/s^2)^2/Hz], shape (F, 6)."""

    frequency: Array  # [Hz], shape (F,)
    model: Array
    measured: Array


def run(quick: bool) -> Numbers:
    exact = get_walk("legs-contact", quick)
    realistic = measure(exact.log, sensors_for(exact.log, get_profile("realistic"), SEED))
    walks = {"exact": exact, "realistic": replace(exact, log=realistic), "harsh": get_walk("harsh", quick)}
    found = {name: _spectra(walk) for name, walk in walks.items()}
    cutoffs = {name: _cutoff(walk) for name, walk in walks.items()}
    return {
        "logs": {name: cutoffs[name] | {"noisier": _noisier(spectra)} for name, spectra in found.items()},
        "beyond": _beyond(found["exact"]),
    }


def _spectra(walk: Simulated) -> Spectra:
    """Average the spectra of the right leg's swings, with one Hann window per swing."""
    found = estimate(walk, UNFILTERED)
    model = model_acceleration(walk, found)
    time, rate = swinging(found, "knee").time, 1 / found.samples.period
    ends = np.concatenate([[0], np.flatnonzero(np.diff(time) > 1.5 / rate) + 1, [len(time)]])
    length = round(0.95 * float(np.median(np.diff(ends))))
    firsts = ends[:-1][np.diff(ends) >= length]
    here = np.searchsorted(walk.log.time, time - 0.5 / rate)
    columns = [walk.log.joint_names.index(f"right_{joint}") for joint in JOINTS]
    models: list[Array] = []
    measured: list[Array] = []
    for first in firsts:
        rows = slice(here[first] - 1, here[first] + length + 1)
        second = np.diff(walk.log.position[rows, columns], 2, axis=0) * rate**2
        for kept, signal in ((models, model[first : first + length]), (measured, second)):
            frequency, density = periodogram(signal, rate, window="hann", axis=0)
            kept.append(density[1:])
    return Spectra(frequency[1:], np.mean(models, axis=0), np.mean(measured, axis=0))


def _cutoff(walk: Simulated) -> dict[str, float]:
    """Compute the window [samples] and the cutoff [Hz] that `auto` chooses."""
    prepared = prepare(walk.log, walk.robot, Settings())
    settings, _ = with_filter(prepared, walk.robot, Settings())
    chosen = settings.filter.cutoff
    window = 2 * make_filter(settings.filter, prepared.sampling.period).half_width + 1
    assert chosen is not None
    return {"cutoff": savgol_cutoff(window, 4, prepared.sampling.rate), "window": window}


def _noisier(spectra: Spectra) -> dict[str, float]:
    """Compute the noise amplitude of the measured acceleration divided by the model's, per joint."""
    band = (spectra.frequency > NOISE[0]) & (spectra.frequency < NOISE[1])
    ratios = np.sqrt(spectra.measured[band].mean(axis=0) / spectra.model[band].mean(axis=0))
    return dict(zip(JOINTS, ratios.tolist(), strict=True))


def _beyond(spectra: Spectra) -> dict[str, float]:
    """Compute the share of power above the paper's 10 Hz in each joint's acceleration."""
    shares = spectra.model[spectra.frequency > PAPER].sum(axis=0) / spectra.model.sum(axis=0)
    return dict(zip(JOINTS, shares.tolist(), strict=True))


def texts(numbers: Numbers) -> dict[str, str]:
    """Format cutoffs, power above 10 Hz, and noise of measured accelerations."""
    logs, beyond = numbers["logs"], numbers["beyond"]
    noisier = {name: logs[name]["noisier"] for name in ("realistic", "harsh")}
    rows = [
        (joint.replace("_", " "), f"{100 * beyond[joint]:.1f} %", *(f"{each[joint]:.2g}" for each in noisier.values()))
        for joint in JOINTS
    ]
    head = ("joint", "power beyond 10 Hz", "measured / model, realistic", "measured / model, harsh")
    return {
        "table": markdown_table(head, rows),
        **{f"cutoff-{name}": f"{row['cutoff']:.0f} Hz" for name, row in logs.items()},
        "beyond-most": f"{100 * max(beyond.values()):.0f} % ({max(beyond, key=beyond.__getitem__).replace('_', ' ')})",
        "noisier-knee": f"{noisier['realistic']['knee']:.0f}",
        "noisier-least": f"{min(noisier['realistic'].values()):.1f}",
    }
