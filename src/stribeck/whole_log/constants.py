"""The tuned constants of the whole-log estimator; its priors stand in `stribeck.settings.Priors`.

Each has its unit in brackets and what it was chosen on, and what halving and doubling it does where that is much.
"""

import numpy as np

THREADS = 2
"""Threads that whiten equations [1]: linear algebra lets other threads run."""

ROUNDS = 3
"""Rounds of what is repeated until nothing changes [1]: variance components of the pilot fit, passes over the terms,
and terms taken back for random effects. Chosen by judgement."""

FOLDS = 8
"""Parts of a log that are held out in turn, and compared [1], chosen by judgement.

Halved, the law `auto` selects another term on a double pendulum.
"""

# Pilot fit and variance components

PILOT_SEGMENTS = 8
"""Segments in the pilot fit, about [1]: with fewer, a leg may not stand in any. Chosen by judgement.

Halved, the law `auto` selects another term on a double pendulum.
"""

MOST_ROUNDS, STILL_GROWING = 10, 1.2
"""Rounds of the pilot fit at most [1], and the growth of a standard deviation of the model in a round above which there
is another one [1]: gains that are taken for certain while a model seems good explain what friction should. With three
rounds, chi^2 per degree of freedom of the TX40 with its calibration freed is 9, and 59 with all terms."""

SEGMENTS_PER_HELD_OUT = 4
"""Segments in all for each one that is held out for the validation [1], chosen by judgement.

Halved or doubled, the law `auto` selects another term on a double pendulum.
"""

FIRST_MODEL_STD = 0.02
"""Standard deviation of the model's errors before the pilot fit [N m]: of a good model.

Halved or doubled, a parameter moves by 1.2 standard errors at most, held-out errors by 0.9 %; halved, chi^2 per degree
of freedom of the TX40 is 6.4 instead of 1.1, as the rounds end before the components have converged, and the law `auto`
selects another term on a double pendulum, whose Coulomb friction moves by 15 standard errors.
"""

FIRST_ROOT_STD = 0.01
"""The same of the root's acceleration, linear [m/s^2] and angular [rad/s^2]: of a hard floor.

Halved or doubled, a parameter of the quadruped moves by 0.3 standard errors at most.
"""

FIRST_WRENCH_STD = np.repeat([2.0, 0.5], 3)
"""The same of the difference between wrench sensor and model [N], [N m], chosen by judgement."""

CONTACT_BINS = (0.06, 0.12, 0.24)
"""Ends of the bins of the contact variance scale, by the time since a contact change [s]; the last bin, before the next
contact change, is as long as the first.

Halved or doubled, a parameter of the quadruped moves by 0.2 standard errors at most. With no bins, a walk without noise
is 2.5 times as far off.
"""

LARGEST_VARIANCE_RATIO = 30.0
"""Ratio of a variance after and before a round [1]: keeps the first rounds from overshooting.

Halved or doubled, a parameter moves by 0.3 standard errors at most, held-out errors by 0.1 %.
"""

# Outliers

PILOT_OUTLIER = 16.0
"""Residual of a window of the pilot fit, in robust standard deviations [1], from which it is an outlier.

Friction that no law has is none: residuals reach to 16 on a double pendulum, and to 9 on a Kinova Gen3, a Go2, a TX40.
"""

OUTLIER = 10.0
"""Distance of a window from what the pilot fit predicts, in standard deviations [1], from which it is an outlier."""

SHOULDER = 4.0
"""The same [1] down to which an outlier lasts, chosen by judgement."""

# Friction curves

FINEST_KNOTS = 1.5e-3
"""Distance of the knots at standstill, over the top speed [1]: friction changes most there. Chosen by judgement."""

KNOT_GROWTH = 0.12
"""Growth of the distance of the knots per unit of velocity [1], chosen by judgement."""

KNOT_REACH = 1.05
"""Outermost knots over the top speed [1]: that is a percentile, which some samples exceed.

Halved, they end within the motion, and parameters move by up to 33 standard errors.
"""

SHAPE_REACH = 3.0
"""Factor beyond a law's starts up to which the basis covers its nonlinear parameters [1], chosen by judgement."""

SHAPE_GRID = 9
"""Values of each nonlinear parameter that the basis is made from [1], chosen by judgement."""

BASIS_TOLERANCE = 1e-3
"""Error of the basis, root mean square over the knots, over a curve's largest value [1]: below friction's errors."""

VARYING_BASIS_TOLERANCE = 0.04
"""The same of the curves that covariates multiply [1]: these are a small part of friction."""

COARSE_BASIS_TOLERANCE = 0.1
"""The same of those that position multiplies [1]: a smaller part."""

# Covariates and corrections of the model

LEAST_WARMING = 2.0
"""Range of temperature below which a term of temperature is refused [K], chosen by judgement."""

SHORTEST_DRIFT = 20.0
"""Length of a log below which a term of drift is refused [s], chosen by judgement."""

LEAST_LOAD_VARIATION = 0.1
"""Standard deviation of the load over its mean below which a term of load is refused [1]: it is Coulomb friction"""

FEWEST_PERIODS = 2.0
"""Periods of a torque ripple that a joint's motion spans at least [1]: fewer would be a spring, or gravity."""

MOST_PER_TURN = 300.0
"""Periods a turn of a torque ripple at most [1]: a joint that turns at 0.25 rad/s passes one in a window's length."""

RIPPLE_SEGMENTS = 60
"""Segments that ripple is looked for in, at most [1], to save time: few as in the pilot fit show other periods."""

FASTEST_RIPPLE = 25.0
"""Periods that a joint passes in a second at its usual speed, at most [1]: the window (2) levels what is faster."""

NEARLY = 0.95
"""Share of the most power [1] from which a whole number of periods a turn is taken instead of another: most are."""

MOST_FREQUENCIES, FINER = 4000, 21
"""Frequencies that a torque ripple is looked for at, at most, to save time, and once more around the best [1]."""

LEAST_TURN = 0.1
"""Standard deviation of a position [rad] below which friction over position is refused, chosen by judgement."""

LEAST_LOAD = 0.05
"""Torque of a sensor over the largest one's from which its gain is corrected and counts in the mean gain [1].

Gains of lighter limbs come out wrong by some percent, as noise is in their torques and in the motion that their bodies
are corrected with; gains being right on average, the legs' would make up for that.
"""

MEAN_GAIN_STD = 1e-3
"""Standard deviation of the mean gain in units of its prior [1]: held at one, as a common gain is friction's scale."""

# Long logs

SELECTION_SEGMENTS = 200
"""Segments that terms are selected on, at most [1]: of a longer log, evenly spread ones, to save time."""

DRAWN_CURVES, DRAWN_STD = 100, 3.0
"""Curves that a long log's coefficients are reduced to, and how far from the estimate by a part they are drawn, in its
standard errors [1]: the rest of the log moves it by less."""

REDUCTION_TOLERANCE = 0.1
"""What is left out of any of these curves at most [1]: by it, chi^2 of the whole log changes by its square."""

# Gauss-Newton

CONVERGED = 5e-4
"""Decrease of half chi^2 in a step that ends a descent [1]: a thirtieth of a standard error."""

MOST_STEPS = 100
"""Steps after which a descent is given up [1]; about ten are needed, for some sets of terms over 50.

Halved, the law `auto` selects another term on a double pendulum, whose Coulomb friction moves by 15 standard errors.
"""

FIRST_DAMPING = 1e-3
"""First damping over the curvature [1], chosen by judgement: later steps find their own."""

DAMPING_FACTOR = 8.0
"""Factor that a step divides or multiplies the damping by [1], chosen by judgement."""

# Multistart

MULTISTART_STARTS = 4
"""Starts of a joint that are followed to their minimum [1]: those whose linear fit is best. Chosen by judgement."""

LEAST_DECREASE = 0.05
"""Decrease of half of chi^2 for which a joint leaves its minimum [1]: more than descents to the same one differ by."""

# Empirical Bayes

EMPIRICAL_BAYES_ROUNDS = 4
"""Rounds of empirical Bayes, each with a fit of its own [1], chosen by judgement."""

GROUP_PSEUDO_COUNT = 0.03
"""Joints that the first group prior counts as [1]: what the log does not determine stays as it was."""

MODEL_PSEUDO_COUNT = 0.001
"""Coordinates that the first prior of model and sensors counts as [1].

With as much as `GROUP_PSEUDO_COUNT`, an exact model would still be taken to be wrong.
"""

LARGEST_PRIOR_STD = 1.0
"""Standard deviation of model and sensors in units of their first prior, at most [1].

A log with errors of other kinds would have bodies explain them, and more so with every round. Halved or doubled, a
parameter of a double pendulum moves by a standard error.
"""

GROUP_STD = 0.5
"""First standard deviation over the joints, of logarithms and pure numbers [1], chosen by judgement."""

# Selection of terms

LEAST_GAIN = 9.0
"""Decrease of the held-out chi^2 from which a term is kept [1]: that of a value of three standard errors.

Doubled, another term is selected on a double pendulum.
"""

FEWEST_FOLDS = 4
"""Folds without which no term is selected [1]: fewer do not show how much their scores differ.

Doubled, other terms are selected on a double pendulum, and parameters move by up to 4 standard errors.
"""

LARGEST_ASYMMETRY = 0.5
"""Asymmetry from which it is refused [1]: one direction's viscous friction is then three times the other's, which
something else must explain. Chosen by judgement."""

MOST_UNEXPLAINED = 0.5
"""Residual over the mean load [1] from which a joint is not said to have no friction, chosen by judgement."""

BEST_STARTS = 2
"""Starts of one joint's curve that are followed to their minimum [1], chosen by judgement."""

# Uncertainty

LEAST_DETERMINED = 0.5
"""Coordinates that a log must determine for heterogeneity over folds to be looked at [1], chosen by judgement."""

HETEROGENEITY_P = 0.01
"""Probability by chance alone below which heterogeneity of a joint, or of a parameter, widens its intervals [1]."""

SAMPLED_SEGMENTS = 30
"""Segments in all that random effects and alternative terms are looked for in, about [1]: a share, to save time."""

SAMPLED_STEPS = 5
"""The same of each gait phase [1]."""

COSINES = 4
"""Cosines of each random effect over a gait phase, the constant included [1], chosen by judgement.

Without random effects, coverage on a walk without noise falls by 35 points.
"""

LEAST_EFFECT_STD = 6e-4
"""Standard deviation of random effects over the root mean square of friction, at least [1]: filters make as much."""

ROOT_EFFECT_FACTOR = 1.5
"""Standard deviation of the root's random effect over that from window to window [1].

Chosen on the offsets of calibrated robots in `studies.accuracy`, which were 1.15 standard errors off without.
"""

REML_ROUNDS = 5
"""Rounds of Fisher's scoring [1]: standard deviations are then within 2 % of their limits."""

# Score tests

LEAST_MINUS_LOG10_P = 8.0
"""-log10 of the probability by chance alone from which a term is flagged [1]: errors of the model add to chance."""

LEAST_SHARE = 0.05
"""Size over a joint's friction from which a term is flagged [1]: less does not matter to a user."""

MOST_SHARE = 2.0
"""Size over a joint's friction above which no change of friction explains it [1]: a torque of the wrong sign, say."""

LEAST_DELAY = 1e-3
"""Delay of one joint's torque from which it is flagged [s]: a cycle of a 1 kHz bus."""

LEAST_SHIFT = 2.0
"""Shift of the friction curve that a term makes, in standard errors, from which it is flagged [1]: out of its interval.

On a walk of `studies.misfits`, coloured torque noise, taken for drift, shifts it by 1.4.
"""

CURVE_SPEEDS = (0.1, 0.5, 1.0)
"""Shares of the top speed at which that shift is looked at [1]: those of the verdicts."""

EQUALLY_GOOD = 0.5
"""Share of the best term's decrease of chi^2 from which another term explains as much [1].

On the arm of `studies.misfits`, terms that shadow the one that is there reach a third.
"""

LEAST_FRICTION = 0.01
"""Friction over the torque that a joint carries, at least, in that share [1], chosen by judgement."""

PRESLIDING_GRID = (0.125e-3, 0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3)
"""Travels over the top speed [s] at which presliding is looked for, chosen by judgement."""

RESOLVED_STEPS = 1.0
"""Steps of an encoder in the shortest travel that presliding is looked for in [1]: a coarser one sees reversals late.

With encoders of 10 and of 14 bits, no joint of an arm without presliding is given the term.
"""

PRESLIDING_TIMES = (1e-3, 4e-3)
"""Distances of presliding over the top speed [s]: a short one and a long one, chosen by judgement."""

SIGN_CHANGE = 6.0
"""Change of a torque from window to window, in standard deviations of its noise, that surely crosses zero [1]."""

UNEXPLAINED_CHANGE = 2.0
"""The same, in what the pilot fit leaves of the torque, root mean square [1]: coloured noise changes signs as well."""
