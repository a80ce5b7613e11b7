"""Whether healthy motion confirms a stated rate of false alarms: their count, and its Poisson interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from estimation.uncertainty.quantiles import count_interval
from robots.common.records import Record, plain


@dataclass(frozen=True, kw_only=True)
class RateCheck(Record):
    """False alarms in healthy motion that the threshold was not made of.

    Attributes:
        alarms: how many.
        hours: of motion that the threshold has not seen; a repeated motion counts once.
        rate: stated, false alarms an hour.
    """

    alarms: int
    hours: float
    rate: float

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the rate an hour by the exact Poisson distribution."""
        if not self.hours > 0.0:
            return 0.0, float("inf")
        low, high = count_interval(self.alarms)
        return low / self.hours, high / self.hours

    @property
    def confirmed(self) -> bool:
        """Whether the interval is below the stated rate."""
        return self.interval[1] <= self.rate

    @property
    def contradicted(self) -> bool:
        """Whether the interval is above the stated rate."""
        return self.interval[0] > self.rate

    def text(self) -> str:
        """Says it in a sentence."""
        if not self.hours > 0.0:
            return (
                "the false-alarm rate is not confirmed: the healthy motion repeats, or is too short to test the "
                "threshold of one part on another"
            )
        low, high = self.interval
        verdict = "confirmed" if self.confirmed else "contradicted" if self.contradicted else "not confirmed"
        count = f"{self.alarms} false alarm{'' if self.alarms == 1 else 's'} in {_duration(self.hours)}"
        found = f"{self.alarms / self.hours:.2g} ({low:.2g} to {high:.2g}) per hour"
        return f"the false-alarm rate is {verdict} by the healthy logs: {count} of new motion, {found}, 95 % interval"

    def summary(self) -> dict[str, Any]:
        """Gives count, time, interval and verdict as plain data."""
        more = {"interval95": self.interval, "confirmed": self.confirmed, "contradicted": self.contradicted}
        return self.to_dict() | plain(more)


def _duration(hours: float) -> str:
    return f"{hours:.2g} h" if hours >= 1.0 else f"{3600.0 * hours:.3g} s"
