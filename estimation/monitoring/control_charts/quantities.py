"""Monitored quantities: friction of each joint, offsets, the payload, and what all joints share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.control_charts.change_fit import StepFit, fit_steps
from estimation.monitoring.control_charts.charts import Chart
from estimation.monitoring.control_charts.level_filter import LevelFilter
from estimation.monitoring.settings import PAUSE_SECONDS
from estimation.uncertainty.quantiles import chi2_limit
from robots.common.arrays import Array
from robots.common.records import Record

Group = Literal["friction", "offset", "payload", "common", "residual"]

# The model error projects onto each direction with this share of the model's residual.
DIRECTION_SHARE = 0.5


def start_limit(count: int) -> float:
    """Chi-square of one degree of freedom that none of some healthy quantities exceeds at the start."""
    # Probability that any quantity of a healthy robot differs from the model at the start.
    return chi2_limit(0.05, tests=count)


@dataclass(frozen=True, eq=False)
class Sample(Record, as_list=True):
    """One window of one quantity.

    Attributes:
        start: of the window [s].
        end: of the window [s].
        t: mean time [s].
        y: measured value.
        variance: of its noise.
        features: (m,).
        unlogged: standard deviation of what unlogged work in the last pause does to it.
    """

    start: float
    end: float
    t: float
    y: float
    variance: float
    features: Array
    unlogged: float = 0.0


@dataclass(eq=False)
class Quantity(Record):
    """One monitored quantity with its filter, its charts and its last windows.

    Attributes:
        group: what it is.
        index: joint, or payload direction, counted from 0.
        level: its healthy level.
        chart: its charts.
        margin: steps up to this size are no finding.
        samples: the last windows.
        before: coefficients and covariance before each of the samples.
        deviation: of the last window from the explained level.
    """

    ENTRIES = ("group", "index", "level", "chart", "margin", "samples", "before")

    group: Group
    index: int
    level: LevelFilter
    chart: Chart
    margin: float
    samples: list[Sample] = field(default_factory=list)
    before: list[tuple[Array, Array]] = field(default_factory=list)
    deviation: float = np.nan

    def observe(self, sample: Sample, *, learn: bool) -> bool:
        """Takes a window into account, and says whether a chart gives an alarm.

        Args:
            sample: the window.
            learn: whether level and charts are updated; not so while an alarm is being confirmed.
        """
        self.samples.append(sample)
        self.before.append((self.level.coefficients.copy(), self.level.covariance[:-1, :-1].copy()))
        # Windows kept for dating and sizing a change.
        if len(self.samples) > 150:
            del self.samples[0], self.before[0]
        explained, unsure = self.level.explained(sample.features)
        self.deviation = sample.y - explained
        if not learn:
            return False
        paused = self.level.time is None or sample.t - self.level.time > PAUSE_SECONDS
        self.level.predict(sample.t)
        if paused:
            self.level.widen(sample.unlogged)
        scatter = self.level.deviation
        z = self.level.update(sample.features, sample.y, sample.variance)
        return self.chart.update(z, self.deviation, scatter, sample.variance, unsure, sample.unlogged)

    def step_alarm(self) -> bool:
        """Tests for a step after any of the last pauses, by the likelihood ratio (Willsky and Jones 1976).

        It finds what charts of single windows absorb: a change in a long pause, before which nothing is remembered but
        the level. Tests at one window after another are correlated, so alarms are rarer than stated.
        """
        begins = self.after_pauses()
        if not len(begins):
            return False
        return bool(self.steps(begins).exceeding(self.margin).max() > chi2_limit(1.0 / self.chart.run_length))

    def after_pauses(self) -> NDArray[np.intp]:
        """Indices of the samples that follow a pause."""
        starts = np.array([s.start for s in self.samples])
        ends = np.array([s.end for s in self.samples])
        return 1 + np.flatnonzero(starts[1:] - ends[:-1] > PAUSE_SECONDS)

    def differs_from_start(self, first: float, limit: float) -> bool:
        """Tests whether all windows so far differ from the prior level, which is that of the model.

        Args:
            first: start of the first of all windows [s].
            limit: see `start_limit`.
        """
        return self.is_whole(first) and self.starts_beyond(self.steps(np.zeros(1, dtype=np.intp)), limit)

    def is_whole(self, first: float) -> bool:
        """Whether its windows begin with the first of all windows, which starts at a time [s]."""
        return len(self.samples) > 0 and self.samples[0].start <= first + 1e-6

    def starts_beyond(self, fit: StepFit, limit: float) -> bool:
        """Whether a step with the first window is beyond what models get wrong.

        The prior of the level contains that error: no margin is taken off. Steps up to the margin are no finding.
        """
        return bool(fit.gains[0] > limit and abs(fit.sizes[0]) > self.margin)

    def steps(self, begins: NDArray[np.intp] | None = None) -> StepFit:
        """Fits a step at each of the last windows, or at some of them."""
        mean, covariance = self.before[0]
        return fit_steps(
            np.array([s.t for s in self.samples]),
            np.array([s.y for s in self.samples]),
            np.array([s.variance for s in self.samples]),
            np.stack([s.features for s in self.samples]),
            mean,
            covariance,
            self.level.deviation,
            begins,
            unlogged=self._unlogged(),
        )

    def _unlogged(self) -> Array:
        """Covariance of what unlogged work does to the samples (k, k): one error in a log, a part of it in all logs."""
        spread = np.array([s.unlogged for s in self.samples])
        log = np.zeros(len(spread))
        log[self.after_pauses()] = 1.0
        log = np.cumsum(log)
        # Share of the variance by unlogged work that is alike in all pauses: the same work comes again.
        same = np.where(log[:, None] == log[None, :], 1.0, 0.5)
        return np.asarray(same * spread[:, None] * spread[None, :])
