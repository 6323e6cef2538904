"""Tuned constants of the whole-log estimator; `stribeck.core.settings.Priors` has its priors.

Each note states the unit in brackets and the data behind the choice.
"""

ROUNDS = 3
"""Largest number of rounds of the iterations [1], chosen by judgment."""

MOST_ROUNDS = 10
"""Largest number of rounds of the pilot [1], to save time."""

FOLDS = 8
"""Number of parts of a log that are held out in turn, and compared [1], chosen by judgment."""

MOST_SEGMENTS, MOST_EQUATIONS = 200, 400_000
"""Largest number of segments that are read from a log, spread evenly, and of their equations [1], to save time."""

LEAST_SEGMENTS, ENOUGH = 100, 2e-3
"""Smallest number of segments that are read from a long log [1], and the standard error of friction relative to the
joint's torque [1] above which more are read. Noisy walks reach 0.7 %, exact walks 0.05 %; with 64 segments, intervals
are too narrow."""

PILOT_SEGMENTS = 8
"""Approximate number of segments in the pilot [1]: with fewer, some leg may swing in all of them. Chosen by
judgment."""

CONTACT_BINS = (0.06, 0.12, 0.24)
"""Ends of the bins of the contact variance scale, by the time since a contact change [s]; the last bin, before the next
contact change, is as long as the first. Without bins, errors in walks without noise are 2.5 times as large."""

PILOT_OUTLIER, PILOT_OUTLIER_OF_MEANS, OUTLIER, SHOULDER = 24.0, 50.0, 30.0, 4.0
"""Limits of outliers in standard deviations [1]: of robust residuals in the pilot (friction outside the law reaches 16
on a double pendulum) and of their means over groups of windows (39 on a KUKA; pushes in noise of encoders 86), of the
difference from the pilot's prediction (friction and model errors of real arms reach 26, pushes and hands start at
110), and of the residuals at an outlier's ends."""

WIDEST_PRIOR = 4.0
"""Largest standard deviation of a model error relative to its first prior [1], for logs that predict themselves better
with it. Of the arms whose errors on another log this decides, AIRBOT Play is best at 6 or more, a KUKA at 4."""

FRICTION_OF_LOGS = 0.2
"""First prior of the friction of one log minus the mean friction, relative to that of offsets [1]."""

CONVERGED = 5e-4
"""Decrease of half chi^2 per step below which a descent ends [1]: a thirtieth of a standard error."""

LEAST_GAIN = 9.0
"""Decrease of the held-out chi^2 above which a term is kept [1]: the effect of a coefficient of three standard
errors."""

COSINES = 4
"""Number of cosines of each random effect over a gait phase, including the constant [1], chosen by judgment."""

ROOT_EFFECT_FACTOR = 1.5
"""Standard deviation of the root's random effect divided by its deviation between windows [1].

Chosen on the offsets of calibrated robots in `studies.accuracy`, whose errors were 1.15 standard errors without it.
"""

LEAST_FRICTION = 0.01
"""Smallest friction relative to the joint's torque [1] of which shares are computed; they mean nothing below it."""
