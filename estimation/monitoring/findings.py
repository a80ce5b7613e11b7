"""Findings of a monitor: kind, joint, date, size and what to do next."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

import numpy as np

from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.records import Record
from robots.common.tables.times import SECONDS_PER_DAY, YEAR_2000

Kind = Literal["damage", "friction_decrease", "payload", "contact", "heat", "offset", "misfit", "unknown"]
Severity = Literal["info", "watch", "act"]

EFFECTS: dict[str, str | None] = {
    "damage": "friction_step",
    "friction_decrease": "friction_step",
    "payload": "payload_change",
    "contact": "external_contact",
    "heat": "thermal_friction",
    "offset": "torque_sensor_drift",
    "misfit": None,
    "unknown": None,
}
"""The name of each kind among the effects of the diagnosis."""

SEVERITIES: dict[str, Severity] = {
    "damage": "act",
    "friction_decrease": "watch",
    "payload": "act",
    "contact": "watch",
    "heat": "info",
    "offset": "watch",
    "misfit": "act",
    "unknown": "watch",
}
LIGHTS = {"info": "green", "watch": "amber", "act": "red"}
ORDER = ("info", "watch", "act")


@dataclass(frozen=True, kw_only=True)
class Finding(Record):
    """One change.

    Attributes:
        kind: damage, friction_decrease, payload, contact, heat, offset, misfit or unknown.
        joint: counted from 1; None for the whole robot.
        size: in the unit.
        low: lower end of its 95 % interval.
        high: upper end.
        unit: "%" of the friction, "kg", "K", "N m" or "".
        earliest: earliest time of the change [s], of its 95 % interval.
        latest: latest time [s].
        detected: when the alarm was raised [s].
        sigmas: size of the change over its standard error.
        from_start: whether the first window already differed from the model.
        log: name of the log in which it was detected.
        text: more of it, such as the centre of a payload.
        settled: whether more windows may still refine size and date.
    """

    ENTRIES = (
        "kind",
        "effect",
        "joint",
        "severity",
        "size",
        "ci95=low,high",
        "unit",
        "time.earliest=earliest",
        "time.latest=latest",
        "time.detected=detected",
        "since=date",
        "sigmas",
        "from_start",
        "log",
        "settled",
        "sentence",
        "advice",
        "text?",
    )

    kind: Kind
    joint: int | None
    size: float
    low: float
    high: float
    unit: str
    earliest: float
    latest: float
    detected: float
    sigmas: float
    from_start: bool = False
    log: str = ""
    text: str = ""
    settled: bool = True

    @property
    def effect(self) -> str | None:
        """Its name among the effects of the diagnosis; None for an unknown cause."""
        return EFFECTS[self.kind]

    @property
    def severity(self) -> Severity:
        """How urgent it is: info, watch or act."""
        return SEVERITIES[self.kind]

    def sentence(self, origin: float) -> str:
        """Says what changed, by how much, and since when.

        Args:
            origin: time at which the first log began [s]; dates count from it where the clock has no date.
        """
        where = "" if self.joint is None else f"Joint {self.joint}: "
        amount = f"{self.size:+.3g} {self.unit} ({self.low:+.3g} to {self.high:+.3g})".replace(" %", " %")
        what = {
            "damage": f"friction changed by {amount}, beyond what temperature explains",
            "friction_decrease": f"friction changed by {amount}, beyond what temperature explains",
            "payload": f"the payload changed by {amount}{self.text}",
            "contact": f"an external force acted for a short time{self.text}",
            "heat": f"all joints changed together, as by heat: {amount}",
            "offset": f"the torque offset changed by {amount}",
            "misfit": f"the model does not fit{self.text}",
            "unknown": f"the residual changed in a way that no known cause explains{self.text}",
        }[self.kind]
        text = where + (what if where else what[0].upper() + what[1:])
        if self.from_start:
            return f"{text}. The first log already differs from the model."
        since = "At" if self.kind == "contact" else "Since"
        log = f", found in {self.log}" if self.log else ""
        return f"{text}. {since} {self.date(origin)}{log}."

    def date(self, origin: float) -> str:
        """The interval of the date in words."""
        first, last = when(self.earliest, origin), when(self.latest, origin)
        if self.latest - self.earliest < 60:
            return f"{first} (within {max(self.latest - self.earliest, 1):.0f} s)"
        return f"{first} to {last}"

    def advice(self) -> str:
        """Says what to do next."""
        joint = "" if self.joint is None else f" {self.joint}"
        before = "run oed diagnose with the logs before and after this date"
        return {
            "damage": f"Inspect joint{joint} (gearbox, lubricant, brake). To confirm, {before}.",
            "friction_decrease": f"Check whether joint{joint} was serviced or runs in. If not, {before}.",
            "payload": "Check tool and load. If the change is intended, state the payload of the logs (--payload), or "
            "run oed payload.",
            "contact": "Check the cell for a collision at this time.",
            "heat": "Nothing to do. If it stays, check the ambient temperature, or run oed thermal with these logs.",
            "offset": f"Check the torque sensor and zero position of joint{joint}. Then {before}.",
            "misfit": "Check that the logs are of this robot, and what torque they hold (oed check). If so, "
            "identify it again.",
            "unknown": before[0].upper() + before[1:] + ".",
        }[self.kind]


def when(time: float, origin: float) -> str:
    """Writes a time: a date where the clock has one, else the day and the time since the first log."""
    if time >= YEAR_2000:
        return f"{datetime.fromtimestamp(time, UTC):%Y-%m-%d %H:%M:%S}"
    since = time - origin
    day, rest = divmod(max(since, 0.0), SECONDS_PER_DAY)
    return f"day {int(day) + 1}, {int(rest // 3600):02d}:{int(rest % 3600 // 60):02d}:{int(rest % 60):02d}"


def worst(severities: list[Severity]) -> Severity:
    """The most urgent of some severities; info of none."""
    return ORDER[max((ORDER.index(s) for s in severities), default=0)]  # type: ignore[return-value]


def relative(size: float, error: float) -> tuple[float, float, float]:
    """A log ratio and its 95 % interval in per cent."""
    return tuple(float(100 * np.expm1(size + k * NORMAL_95 * error)) for k in (0, -1, 1))  # type: ignore[return-value]
