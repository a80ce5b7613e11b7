"""Rates with their intervals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from estimation.uncertainty.quantiles import NORMAL_95, median_interval, share_interval
from robots.common.records import Record


@dataclass(frozen=True, kw_only=True)
class Rate(Record):
    """A share of cases, with the Clopper-Pearson interval at 95 %."""

    ENTRIES = ("hits", "cases=tries", "rate=value", "ci95=interval")

    hits: int
    tries: int

    @property
    def value(self) -> float | None:
        """The share; None without a case."""
        return self.hits / self.tries if self.tries else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """The interval; None without a case."""
        return share_interval(self.hits, self.tries) if self.tries else None

    def text(self) -> str:
        """Writes counts and interval, such as ``7 of 8 (47 to 100 %)``."""
        if self.interval is None:
            return "-"
        low, high = (100 * bound for bound in self.interval)
        return f"{self.hits} of {self.tries} ({low:.0f} to {high:.0f} %)"


@dataclass(frozen=True, kw_only=True)
class Median(Record):
    """A median, with the interval at 95 % that holds for every continuous distribution.

    Attributes:
        values: sorted.
    """

    ENTRIES = ("cases=size", "median=value", "ci95=interval")

    values: tuple[float, ...]

    @property
    def size(self) -> int:
        """Number of values."""
        return len(self.values)

    @property
    def value(self) -> float | None:
        """The median; None without a value."""
        return float(np.median(self.values)) if self.values else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """The interval by order statistics; None where there are too few values for one."""
        return median_interval(self.values)

    def text(self) -> str:
        """Writes median, interval and count."""
        if self.value is None:
            return "-"
        if self.interval is None:
            return f"{self.value:.3g} ({len(self.values)} cases)"
        return f"{self.value:.3g} ({self.interval[0]:.3g} to {self.interval[1]:.3g}, {len(self.values)} cases)"


@dataclass(frozen=True, kw_only=True)
class Mean(Record):
    """A mean, with the interval at 95 % of a normal distribution.

    Attributes:
        values: whose mean it is.
    """

    ENTRIES = ("effects=size", "mean=value", "ci95=interval")

    values: tuple[float, ...]

    @property
    def size(self) -> int:
        """Number of values."""
        return len(self.values)

    @property
    def value(self) -> float:
        """The mean."""
        return float(np.mean(self.values))

    @property
    def interval(self) -> tuple[float, float] | None:
        """The interval; None with one value."""
        if len(self.values) < 2:
            return None
        half = float(NORMAL_95 * np.std(self.values, ddof=1) / np.sqrt(len(self.values)))
        return self.value - half, self.value + half

    def text(self) -> str:
        """Writes mean, interval and count."""
        between = "" if self.interval is None else f"{self.interval[0]:.2g} to {self.interval[1]:.2g}, "
        return f"{self.value:.2g} ({between}{len(self.values)} effects)"


def rate(values: Iterable[bool]) -> Rate:
    """Counts hits among tries."""
    counted = list(map(bool, values))
    return Rate(hits=sum(counted), tries=len(counted))


def median(values: Iterable[float]) -> Median:
    """Collects values for their median."""
    return Median(values=tuple(sorted(values)))
