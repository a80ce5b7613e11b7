"""Control charts of one monitored quantity: a CUSUM for sudden changes, an EWMA for slow ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

from estimation.monitoring.control_charts.level_filter import CORRELATION_TIME
from robots.common.records import Record

# Allowance of the CUSUM: half of a change by two standard deviations of the innovations.
CUSUM_ALLOWANCE = 1.0


@dataclass
class Chart(Record):
    """Both charts of a quantity.

    Attributes:
        window: length of a window [s].
        run_length: windows between false alarms of each of the two.
        up: CUSUM of increases.
        down: CUSUM of decreases.
        level: EWMA of the deviation from the explained level.
        count: windows in the EWMA.
        last: the last standardised innovation.
        products: sum of products of consecutive innovations.
        squares: sum of their squares.
        unlogged: EWMA of the standard deviation by unlogged work.
    """

    window: float
    run_length: float
    up: float = 0.0
    down: float = 0.0
    level: float = 0.0
    count: int = 0
    last: float = 0.0
    products: float = 0.0
    squares: float = 0.0
    unlogged: float = 0.0

    @property
    def weight(self) -> float:
        """Weight of the newest window in the EWMA."""
        # Memory of the EWMA [s]: several correlation times of the model error.
        return min(1.0, self.window / 1800.0)

    @property
    def correlation(self) -> float:
        """Serial correlation of the innovations, never negative, rounded up."""
        # Prior weight of the serial correlation of innovations [windows].
        found = self.products / (self.squares + 100.0)
        # Steps to which the serial correlation of innovations is rounded.
        step = 0.05
        rounded = float(np.ceil(max(found, 0.0) / step)) * step
        return min(rounded, 0.6)

    @property
    def limits(self) -> tuple[float, float]:
        """Thresholds of the CUSUM and of the EWMA, each in its standard deviations."""
        slow = float(np.exp(-self.window / CORRELATION_TIME))
        return (
            cusum_threshold(CUSUM_ALLOWANCE, self.run_length, self.correlation),
            ewma_threshold(self.weight, self.run_length, slow),
        )

    def update(
        self, z: float, deviation: float, scatter: float, noise: float, unsure: float, unlogged: float = 0.0
    ) -> bool:
        """Takes one window into account, and says whether there is an alarm.

        Args:
            z: standardised innovation.
            deviation: measured minus explained level.
            scatter: standard deviation of the model error.
            noise: variance of the measured value.
            unsure: variance of the explained level.
            unlogged: standard deviation of what unlogged work does to the measured value.
        """
        clipped = float(np.clip(z, -3.0, 3.0))
        self.products += clipped * self.last
        self.squares += clipped * clipped
        self.last = clipped
        self.up = max(0.0, self.up + z - CUSUM_ALLOWANCE)
        self.down = max(0.0, self.down - z - CUSUM_ALLOWANCE)
        w = max(self.weight, 1.0 / (self.count + 1))
        self.level += w * (deviation - self.level)
        self.unlogged += w * (unlogged - self.unlogged)
        self.count += 1
        cusum, ewma = self.limits
        keep, slow = 1 - w, float(np.exp(-self.window / CORRELATION_TIME))
        share = w / (2 - w)
        variance = (
            scatter**2 * share * (1 + keep * slow) / (1 - keep * slow) + noise * share + unsure + self.unlogged**2
        )
        return max(self.up, self.down) > cusum or abs(self.level) > ewma * float(np.sqrt(variance))

    def reset(self) -> None:
        """Starts both charts again; the serial correlation is kept."""
        self.up = self.down = self.level = self.unlogged = 0.0
        self.count = 0


@dataclass
class BurstChart(Record):
    """The extreme-value distribution (Gumbel) of a window's largest chi-square, learnt from healthy windows.

    Attributes:
        run_length: windows between false alarms.
        count: windows so far, the prior included.
        mean: of the largest chi-squares.
        square: sum of their squared deviations.
    """

    run_length: float
    count: float = 10.0
    mean: float = 17.0
    square: float = 10.0 * 6.0**2

    @property
    def threshold(self) -> float:
        """The chi-square that a healthy window exceeds once in `run_length` windows."""
        deviation = float(np.sqrt(self.square / self.count))
        # Few windows say little of the spread.
        scale = deviation * (1 + 2 / self.count) * np.sqrt(6) / np.pi
        place = self.mean - np.euler_gamma * scale
        return float(place - scale * np.log(-np.log1p(-1.0 / self.run_length)))

    def update(self, chi: float) -> bool:
        """Takes a window's largest chi-square into account, and says whether it is an alarm."""
        if chi > self.threshold:
            return True
        most = 2000.0
        self.count = min(self.count + 1, most)
        step = chi - self.mean
        self.mean += step / self.count
        if self.count >= most:
            self.square *= 1 - 1 / most
        self.square += step * (chi - self.mean)
        return False


# Mean overshoot of a normal random walk beyond a boundary, on both sides together (Siegmund 1985, eq. 10.17).
CUSUM_OVERSHOOT = 1.166


def cusum_run_length(threshold: float, allowance: float, correlation: float = 0.0) -> float:
    """Mean steps until a two-sided CUSUM of a standard normal AR(1) sequence gives a false alarm.

    Siegmund's approximation, with the variance of the steps replaced by the long-run variance
    (1 + rho) / (1 - rho):  ARL = v / (2 k^2) (exp(2 k b / v) - 1 - 2 k b / v) / 2,  b = h + 1.166.

    Args:
        threshold: h, in standard deviations.
        allowance: k, in standard deviations.
        correlation: rho between consecutive values.
    """
    variance = (1 + correlation) / (1 - correlation)
    exponent = 2 * allowance * (threshold + CUSUM_OVERSHOOT) / variance
    return float(variance / (2 * allowance**2) * (np.expm1(min(exponent, 600.0)) - exponent) / 2)


@lru_cache(maxsize=256)
def cusum_threshold(allowance: float, run_length: float, correlation: float = 0.0) -> float:
    """The threshold of a two-sided CUSUM with this mean time between false alarms.

    Args:
        allowance: k, in standard deviations.
        run_length: mean steps between false alarms.
        correlation: rho between consecutive values.
    """
    return float(
        brentq(lambda h: np.log(cusum_run_length(h, allowance, correlation) / run_length), -CUSUM_OVERSHOOT + 1e-6, 1e4)
    )


def ewma_run_length(threshold: float, weight: float, correlation: float = 0.0) -> float:
    """Mean steps between crossings of a two-sided threshold by an EWMA of a standard normal AR(1) sequence.

    The EWMA is an AR(2) process. The rate of crossings follows from its correlation between consecutive values,
    (a + rho) / (1 + a rho) with a = 1 - w. Crossings come in clusters, so alarms are rarer than crossings.

    Args:
        threshold: in standard deviations of the EWMA.
        weight: w of the newest value.
        correlation: rho between consecutive values.
    """
    keep = 1 - weight
    r = (keep + correlation) / (1 + keep * correlation)
    spread = np.sqrt(1 - r * r)
    rate, _ = quad(
        lambda y: np.exp(-y * y / 2) * ndtr((threshold - r * y) / spread),
        threshold,
        threshold + 12.0,
        epsabs=0,
        limit=200,
    )
    return float(1 / max(2 * rate / np.sqrt(2 * np.pi), np.finfo(float).tiny))


@lru_cache(maxsize=256)
def ewma_threshold(weight: float, run_length: float, correlation: float = 0.0) -> float:
    """The threshold of a two-sided EWMA chart, in its standard deviations, with this mean time between crossings.

    Args:
        weight: w of the newest value.
        run_length: mean steps between false alarms.
        correlation: rho between consecutive values.
    """
    return float(brentq(lambda L: np.log(ewma_run_length(L, weight, correlation) / run_length), 0.0, 30.0))
