"""The tuned constants of the weak form, each with its unit in brackets and what it was chosen on.

A docstring says what halving and doubling a constant does where that is much.
"""

import numpy as np

# Windows of the weak form

WINDOW_LENGTH = 0.041
"""Length of a window [s]: long enough to average encoder noise, short against the motion. Chosen by judgement.

Halved or doubled, a parameter of a trotting quadruped moves by 1.8 standard errors at most.
"""

WINDOW_SPACING = 0.012
"""Time from one window to the next [s]: errors of three walks are as with windows that are closer.

Halved or doubled, a parameter of a trotting quadruped moves by 1.2 standard errors at most.
"""

BOXES = 4
"""Boxes that a window is the convolution of [1]: its spectrum falls with the fourth power of frequency."""

NEGLIGIBLE_CORRELATION = 1e-4
"""Correlation of two windows' errors that counts as none [1], chosen by judgement."""

# Segments

LONGEST_SEGMENT = 1.6
"""Length of a segment at most [s]: errors of different segments count as independent. Chosen by judgement.

Doubled, a log of 14 s has too few of them for a fit.
"""

SEGMENTS_OF_A_LOG = 12
"""Segments that a short log is cut into at least [1]: more than there are folds."""

LONGEST_FLIGHT = 1.0
"""Flight that is used at most [s]: who falls for a second falls five metres, and the contacts must be wrong."""

LEAST_LONGEST_SEGMENT = 0.4
"""Length of a segment [s] that even a short log is not cut below: ten windows' reach."""

FEWEST_WINDOWS = 4
"""Windows of a segment at least [1], chosen by judgement."""

TRIM_LIFTED = 0.05
"""Time left out after a foot has lifted [s], chosen by judgement.

Halved or doubled, a parameter of a trotting quadruped moves by 1.1 standard errors at most.
"""

TRIM_LANDED = 0.07
"""Time left out after a foot has landed [s]: it chatters. Chosen by judgement."""

TRIM_END = 0.02
"""Time left out before a contact change [s], chosen by judgement."""

CLAMPED_DELAY = 0.02
"""Longest delay of the torques [s] with which segments stay as they are."""

# Logs

MOST_LOG_OFFSETS = 400
"""Logs but one, times joints, above which offsets are the same in all logs [1], to save time. Chosen by judgement."""

# Derivatives

POLYNOMIAL = 4
"""Order of the Savitzky-Golay polynomials [1], chosen by judgement: with half or twice as much some fits fail."""

ACCELERATION_LENGTH = 0.011
"""Window of the acceleration [s]: as short as it can be, as the window of the weak form averages its noise."""

VELOCITY_REFERENCE = (0.031, 2e-5, 1e-3)
"""Window of the velocity [s] for an encoder noise of so much [rad] at such a sampling period [s], by judgement."""

VELOCITY_LENGTHS = (0.015, 0.061)
"""Shortest and longest window of the velocity [s], chosen by judgement."""

NOISE_SHARE = 5e-4
"""Power of noise over that of motion in the regressors' accelerations [1], to which a joint's window brings it.

Chosen on exact models in strong noise (TORO-like, TALOS), whose offsets are 20 to 40 % closer than with one window for
all joints.
"""

SHORTEST_ACCELERATION = 0.03
"""Shortest of these windows [s], chosen by judgement."""

LONGEST_ACCELERATION = 0.2
"""Longest of these windows [s]: a longer one loses motion. Chosen by judgement."""

BEFORE = 0.5
"""Motion before a segment that presliding is followed from [s]: with no more, friction is taken to have built up."""

# Sensor noise

DIFFERENCES = 6
"""Order of the differences that noise is measured by [1]: smooth motion hardly shows in them, noise thirtyfold."""

MOST_ROWS = 60_000
"""Rows that noise is measured on [1]: a minute at 1 kHz, to save time."""

POSITION_FLOOR = 1e-7
"""Noise of an encoder at least [rad]: what rounding and clocks leave even of a perfect one.

Noise that is taken to be none would hide slow errors, such as those of a foot that rocks.
"""

TORQUE_FLOOR = 1e-3
"""The same of a torque sensor [N m]."""

WRENCH_FLOOR = np.repeat([0.5, 0.05], 3)
"""The same of a wrench sensor [N], [N m]: feet in the air feel no wrench, and would seem to have no noise."""

# Spikes

SPIKE = 5.0
"""Distance of a sample from all that its neighbours predict, in standard deviations [1], from which it is replaced.

With white noise hardly one in ten million is. Chosen on an arm: of spikes of 20 standard deviations nine in ten go.
"""

SPIKE_NEIGHBOURHOOD = 20
"""Samples on either side whose median distance a spike must exceed as often [1]: impacts are no spikes."""
