"""What a user sets of a monitor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from robots.common.errors import InputError

Heat = Literal["auto", "model", "temperature", "common", "none"]
# A longer time between windows [s] is a pause, in which the robot may work unseen.
PAUSE_SECONDS = 30.0
HEATS = ("auto", "model", "temperature", "common", "none")


@dataclass(frozen=True, kw_only=True)
class MonitorSettings:
    """Settings of a monitor.

    Attributes:
        window: length of a window [s]: one estimate of friction, offsets and payload each.
        false_alarm_hours: mean time between false alarms of the whole monitor [h of recorded motion].
        heat: what explains common changes of friction. `model`: the thermal model. `temperature`: measured joint
            temperatures. `common`: two heat states per joint, with assumed time constants. `none`: nothing. `auto`
            takes the first that is known, in this order.
        smallest: change of friction that is worth a finding, as a share. Smaller ones are within what thermal models
            get wrong between cold and warm.
        confirm: windows after an alarm that confirm, size and name it.

    Raises:
        InputError: a value that is out of range.
    """

    window: float = 10.0
    false_alarm_hours: float = 1000.0
    heat: Heat = "auto"
    smallest: float = 0.05
    confirm: int = 6

    def __post_init__(self) -> None:
        if not (math.isfinite(self.window) and self.window >= 1.0):
            raise InputError(f"a window of {self.window} s", allowed="1 s or more")
        if not (math.isfinite(self.false_alarm_hours) and self.false_alarm_hours >= 1.0):
            raise InputError(f"{self.false_alarm_hours} h between false alarms", allowed="1 h or more")
        if self.heat not in HEATS:
            raise InputError(f"heat {self.heat!r}", allowed=", ".join(HEATS))
        if not 0.0 <= self.smallest < 1.0:
            raise InputError(f"a smallest change of {self.smallest}", allowed="0 or more, and less than 1")
        if self.confirm < 1:
            raise InputError(f"{self.confirm} windows to confirm an alarm", allowed="1 or more")
