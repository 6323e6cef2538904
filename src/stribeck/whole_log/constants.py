"""Tuned constants of the whole-log estimator; `stribeck.settings.Priors` has its priors.

Each note states the unit in brackets and the data behind the choice.
"""

ROUNDS = 3
"""Largest number of rounds of the iterations [1], chosen by judgment."""

FOLDS = 8
"""Parts of a log that are held out in turn, and compared [1], chosen by judgement."""

MOST_SEGMENTS, MOST_EQUATIONS = 200, 400_000
"""Segments of a log that are read, and their equations, at most [1]: evenly spread, to save time."""

LEAST_SEGMENTS, ENOUGH = 100, 2e-3
"""Fewest segments that are read of a long log [1], and the standard error of friction, relative to the joint's torque
[1], for which more are read. Noisy walks reach 0.7 %, exact ones 0.05 %; with 64 segments intervals are too narrow."""

PILOT_SEGMENTS = 8
"""Approximate number of segments in the pilot [1]: with fewer, some leg may swing in all of them. Chosen by
judgment."""

CONTACT_BINS = (0.06, 0.12, 0.24)
"""Ends of the bins of the contact variance scale, by the time since a contact change [s]; the last bin, before the next
contact change, is as long as the first. With no bins, a walk without noise is 2.5 times as far off."""

PILOT_OUTLIER, OUTLIER, SHOULDER = 16.0, 10.0, 4.0
"""Standard deviations [1] from which a window is an outlier: in the pilot, robust ones, as friction that no law has is
none (it reaches 16 on a double pendulum); of the distance from what the pilot predicts; down to which it lasts."""

CONVERGED = 5e-4
"""Decrease of half chi^2 in a step that ends a descent [1]: a thirtieth of a standard error."""

LEAST_GAIN = 9.0
"""Decrease of the held-out chi^2 from which a term is kept [1]: a coefficient of three standard errors lowers it this
much."""

COSINES = 4
"""Cosines of each random effect over a gait phase, the constant included [1], chosen by judgement."""

ROOT_EFFECT_FACTOR = 1.5
"""Standard deviation of the root's random effect over that from window to window [1].

Chosen on the offsets of calibrated robots in `studies.accuracy`, which were 1.15 standard errors off without.
"""
