"""One clock for several logs of a controller, whose own clock may restart between them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ClockAnchor:
    """Where a log ended, so that the next one goes on from there.

    Attributes:
        t: time stamp of its last row [s].
        unix: when that was, in seconds since 1970.
        offset: what was added to the clock [s].
        clock: that of the log, ``controller`` or ``arrival``.
    """

    t: float
    unix: float
    offset: float = 0.0
    clock: str = "controller"

    def offset_of(self, stamp: float, unix: float, clock: str) -> float:
        """Gives what to add to the stamps of the next log.

        A controller that restarted begins at zero again. Its pause is then taken from this computer's clock, as it is
        between logs of different clocks.

        Args:
            stamp: time of the next log's clock now [s].
            unix: now, in seconds since 1970.
            clock: of the next log.

        Returns:
            The offset so far where the clock went on; otherwise a new one [s].
        """
        if clock == self.clock and stamp + self.offset > self.t:
            return self.offset
        return self.t + max(unix - self.unix, 1e-3) - stamp
