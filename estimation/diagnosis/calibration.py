"""Constants that decide: what is accepted, rejected or reported."""

from __future__ import annotations

MIN_BIC_GAIN = 10.0
"""An effect is reported if its model's BIC is better by this much: very strong evidence (Kass and Raftery 1995)."""

CLOSE_RIVAL_BIC = 10.0
"""A rival whose BIC is worse by less than this stays possible: the verdict is then ``ambiguous``."""

MIN_EXPLAINED_SHARE = 0.7
"""Named effects that explain less than this share of the significant residual, or of what free functions explain in
their place, do not explain it."""

NEARLY_EXPLAINED_SHARE = 0.9
"""Nor do those that explain less than this share and have a worse BIC: formulas are true to some per cent."""

MIN_RETAINED_CHI2 = 0.75
"""A name must explain this share of its chi-square beside free functions elsewhere; else these explain it."""

# Which logs and rows count.

MAX_UNEXPLAINED_POWER = 0.5
"""Share of the squared torque. A log is left out if even a fit to this log alone leaves more on every joint."""

REST_TIME = 0.3
"""Time [s]. A joint whose direction is unknown for longer is at rest."""

REVERSAL_MARGIN = 0.05
"""Time [s] about rows of unknown direction in which accelerations miss part of their jumps."""

MIN_SPEED_SIGMAS = 4.0
"""Standard errors of the velocity below which a joint's direction is unknown."""

MIN_SHARP_SPEED_SIGMAS = 12.0
"""The same for a smooth sign of any width: its error is 0.45 of the velocity's at most."""

CREEP_SPEED = 0.03
"""Share of a joint's RMS speed below which it creeps: its friction may have any value."""

CREEP_TIME = 0.15
"""Time [s] for which it must do so."""

MAX_ROW_SIGMAS = 3.5
"""Standard deviations beyond which a white row weighs as if it were there (Huber)."""

MIN_PUSH_TIME = 0.05
"""Time [s] for which rows must be outside together to be no outliers."""

IMPACT_TIME = 0.15
"""Time [s] about a reversal in which they still count as outliers."""

MAX_REVERSAL_ERROR = 1.0
"""Error of the torque at reversals over the noise up to which those rows count."""

BURST_SIGMAS = 6.0
"""Standard deviations of a mean over a burst from which it is no noise: 5e8 to 1."""

SPIKE_SIGMAS = 5.0
"""Standard deviations of a single row that count in that mean."""

MAX_BURST_SHARE = 0.1
"""Share of the rows up to which bursts are left out of the noise estimate."""

LINE_FALSE_ALARM = 1e-3
"""Chance that noise of a smooth density has any line removed from its spectrum."""

MAX_MOTION_ERROR = 0.2
"""Share of the torque noise's power that the acceleration's error may have within a band."""

MAX_BIAS_CHI2 = 0.1
"""Chi-square that the bias of an inertia by errors of the acceleration may leave."""

MAX_HIGH_BAND_ERROR = 50.0
"""As MAX_MOTION_ERROR, above the bands: that error is part of the noise there."""

MIN_HIGH_BAND = 0.75
"""A band that ends within this share of the high band has none above it."""

MIN_COUNTED_ENERGY = 0.02
"""Share of a column's energy that must be in rows that count."""

MIN_DISTANT_ENERGY = 0.5
"""Share of what counts of a column that must be away from rows of unknown direction, if it is largest there."""

# Tests and scores.

MIN_VISIBLE_ENERGY = 2e-4
"""Share of a direction's energy that the base model must leave for it to be tested."""

RARE_ODDS = 6.0
"""Twice the log of the odds (20 to 1) against an effect that robots seldom have."""

REVERSAL_FORMULA_ERROR = 0.35
"""Share by which an effect at reversals may differ from its size elsewhere."""

MAX_REVERSAL_CHI2 = 2.0
"""Chi-square of that difference up to which its evidence counts whole."""

ABSENT_CHI2 = 4.0
"""Chi-square against its presence away from reversals from which it counts for nothing: 2 % of true ones."""

SHARED_FORMULA_ERROR = 0.25
"""Share by which joints may differ in a coefficient that they share."""

OTHER_FORMULA_ERROR = 0.05
"""Share of other effects' torque by which their formulas may be wrong on a joint."""

POWER = 0.95
"""Chance with which an effect of the stated size is found, and separated from its rival."""

SHOCK_COUNT = 0.01
"""Expected number of noise shocks as large from which a short effect may be one."""

MAX_GLITCH_SHARE = 0.1
"""Share of a short effect's chi-square that one shock must leave; less, and it is one."""

# Search.

MAX_EFFECTS = 4
"""Effects that are found at most."""

MIN_CANDIDATE_GAIN = 0.3
"""Share of the best chi-square on the grid that a candidate must have."""

# Free functions and held-out data.

MAX_FREE_FUNCTIONS = 3
"""Free functions that are found at most."""

MIN_FREE_SHARE = 0.05
"""Share of the names' chi-square on its joint from which a free function counts: formulas are true to some per cent."""

FREE_P_VALUE = 1e-9
"""p-value below which a single free function needs no better BIC, and no support by held-out data."""

MAX_SHAPE_CHI2 = 3.0
"""Chi-square by which equivalent shapes of one effect may differ."""

MIN_JOINT_GAIN = 0.1
"""Share of an effect's chi-square from which a joint counts for its held-out gain."""

ONE_LOG_ENERGY = 0.9
"""Share of an effect's energy in one log from which it acts in that log only."""

MIN_FIT_GAIN = 0.05
"""Fall of the fit's error below which cross-validation does not judge what is retained."""

MAX_ERROR_RATIO = 3.0
"""Held-out error over fit error from which a joint's base model is unreliable."""

MIN_UNRELIABLE_ERROR = 0.1
"""Share of the torque that this error must have."""

MIN_RETAINED_GAIN = 0.2
"""Share of an effect's gain that must remain in cross-validation."""

OSCILLATION_P_VALUE = 1e-5
"""p-value above which a single oscillation counts as noise if held-out data contradict it."""

CONTRADICTION_SHARE = 0.1
"""Share of an effect's chi-square by which held-out data must contradict it."""

MAX_RMSE_RATIO = 1.05
"""Held-out error with an effect over that without it, from which the effect is rejected."""

REJECT_RMSE_RATIO = 1.2
"""The same despite support by held-out rows: the formula does not extrapolate."""

MIN_SUPPORT = 0.4
"""Growth of chi-square on held-out rows, as a share, that supports an effect whatever the error."""

MIN_SUPPORT_CHI2 = 30.0
"""Growth that this must be at least."""

MIN_COMPLIANCE_ENERGY = 1e-2
"""Share of a gear load's energy that zero, delay, friction and eccentricity must leave."""

# Reports.

MAX_RELATIVE_ERROR = 0.2
"""Half-width of a 95 % interval over the value up to which a shape parameter is determined."""

MAX_TIME_ERROR = 0.2
"""Half-width [s] up to which a moment is determined."""

MIN_HELD_OUT_RATIO = 1.5
"""Held-out error over the fit's from which it is reported."""

MIN_HELD_OUT_ERROR = 0.035
"""Share of the torque that this error must have."""

LARGE_HELD_OUT_ERROR = 0.2
"""Share of the torque from which a held-out error is reported in any case."""

MIN_SPEED_RATIO = 1.3
"""Held-out speed over the fitted one from which it is reported."""

MIN_RANGE_EXCESS = 0.05
"""Share of the range, and of the time, from which positions outside the fitted ones are reported."""

MIN_WORSE_RATIO = 1.1
"""Factor by which a joint's error must grow to be reported."""
