"""The threshold of a stated false-alarm rate, from the peaks of a statistic on a healthy robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError

# Shares of the samples below the levels above which peaks count. All high ones with enough independent peaks are tried;
# of the lower ones the first that has enough, where no high one has.
HIGH, LOW = (0.995, 0.99, 0.98, 0.95, 0.9), (0.8, 0.7, 0.6, 0.5)
# Fewer independent peaks than this say too little of a tail.
LEAST_PEAKS = 8


@dataclass(frozen=True, kw_only=True)
class AlarmThreshold:
    """A threshold for a stated rate of false alarms.

    Attributes:
        value: the threshold.
        rate: false alarms an hour.
        base: level above which peaks count.
        excess: mean height of the peaks above it.
        peaks: number of independent peaks.
        separation: time between independent peaks [s]; exceedances closer than this are one alarm.
        extremal_index: reciprocal of the mean number of exceedances of a peak.
        seconds: time observed.
    """

    value: float
    rate: float
    base: float
    excess: float
    peaks: int
    separation: float
    extremal_index: float
    seconds: float

    def at(self, rate: float) -> float:
        """Gives the threshold of another rate of false alarms an hour."""
        return _threshold(self.base, self.excess, self.peaks, self.seconds, rate)


def alarm_threshold(statistic: Array, period: float, rate: float, *, robust: bool = False) -> AlarmThreshold:
    """Finds the threshold that a healthy robot passes at the stated rate.

    Peaks over a base level, with the exceedances grouped by the intervals estimator of the extremal index (Ferro and
    Segers 2003), which follows from the serial correlation. The peaks' heights are exponential in the tail, as those of
    a squared distance of Gaussian residuals. The threshold is that of their predictive distribution: few peaks make it
    higher. Of several base levels the one with the highest threshold counts.

        rate = (C / time) (1 + (u - u_0) / (C m))^-C

    Args:
        statistic: of a healthy robot (N,).
        period: sample period [s].
        rate: false alarms an hour.
        robust: whether some peaks may be contacts: the median height counts then instead of the mean.

    Raises:
        InputError: too few independent peaks.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{rate} false alarms per hour", allowed="a positive number")
    found: AlarmThreshold | None = None
    for share in HIGH + LOW:
        if found is not None and share in LOW:
            break
        tried = _above(float(np.quantile(statistic, share)) if len(statistic) else 0.0, statistic, period, rate, robust)
        if tried.peaks < 20 and share != LOW[-1]:
            continue
        # A tail that falls more slowly than it does lower down shows in the higher levels.
        if found is None or tried.value > found.value:
            found = tried
    assert found is not None
    if found.peaks < LEAST_PEAKS:
        raise InputError(
            f"the healthy log of {period * len(statistic):.3g} s has {found.peaks} independent peaks of the residual",
            allowed=f"{LEAST_PEAKS} or more",
            remedy="give a longer healthy log with --healthy: a minute or more",
        )
    return found


def _above(base: float, statistic: Array, period: float, rate: float, robust: bool) -> AlarmThreshold:
    """Gives the threshold by the peaks above one level; infinite without any."""
    places, seconds = np.flatnonzero(statistic > base), period * len(statistic)
    index, _, run = _grouped(places)
    if not len(places):
        return AlarmThreshold(
            value=np.inf, rate=float(rate), base=base, excess=0.0, peaks=0, separation=period, extremal_index=1.0,
            seconds=seconds,
        )  # fmt: skip
    starts = np.concatenate([[0], np.flatnonzero(np.diff(places) >= run) + 1])
    heights = np.maximum.reduceat(statistic[places], starts) - base
    mean = float(np.median(heights) / np.log(2.0)) if robust else float(heights.mean())
    return AlarmThreshold(
        value=_threshold(base, mean, len(heights), seconds, rate),
        rate=float(rate),
        base=base,
        excess=mean,
        peaks=len(heights),
        separation=period * run,
        extremal_index=index,
        seconds=seconds,
    )


def _threshold(base: float, excess: float, peaks: int, seconds: float, rate: float) -> float:
    times = max(peaks / seconds * 3600.0 / rate, 1.0)
    return base + peaks * excess * float(np.expm1(np.log(times) / peaks))


def _grouped(places: NDArray[np.intp]) -> tuple[float, int, int]:
    """Extremal index, number of clusters and the gap [samples] between them, of the places of exceedances."""
    gaps = np.diff(places).astype(float)
    if len(gaps) < 2:
        return 1.0, len(places), 1
    if gaps.max() <= 2:
        index = 2 * gaps.sum() ** 2 / (len(gaps) * (gaps**2).sum())
    else:
        index = 2 * (gaps - 1).sum() ** 2 / (len(gaps) * ((gaps - 1) * (gaps - 2)).sum())
    index = min(float(index), 1.0)
    clusters = min(int(index * len(places)) + 1, len(places))
    # The largest gaps separate clusters. Samples that follow each other never do.
    run = int(np.sort(gaps)[::-1][min(clusters - 1, len(gaps)) - 1]) if clusters > 1 else int(gaps.max()) + 1
    run = max(run, 2)
    return index, 1 + int((gaps >= run).sum()), run
