"""What a diagnosis of geometry names: causes with their size, and sentences for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robots.common.plain import two_digits
from robots.common.records import Record

ACTIONS = {
    "zero": "Add it to the joint's zero (joint_zeros.yaml), or use the calibrated robot.",
    "link": "Use the calibrated robot; it has this placement.",
    "gear_ratio": "Check the gear ratio in the controller.",
    "eccentricity": "Compensate it in the controller, or have the encoder or gear seated again.",
    "compliance": "Compensate it in the controller where loads differ, or calibrate with the load of the task.",
    "thermal_growth": "Let the arm warm up, or compensate by its temperature.",
    "backlash": "Approach poses from one side; have the gear checked.",
    "load_backlash": "Have the gear checked; poses where gravity pulls to one side are not affected.",
    "time_offset": "Measure at rest, or correct the clock of the tracker.",
    "loose_marker": "Fasten the marker and measure again; poses from there on are of another marker.",
    "moved_base": "Fasten base and tracker; calibrate each part of the poses for itself.",
    "unexplained": "Look at the errors over positions and loads in the report; measure repeated poses.",
}


@dataclass(frozen=True, kw_only=True)
class CauseFinding(Record):
    """A named cause.

    Attributes:
        cause: such as "zero"; "unexplained" where errors remain that none of the causes explains.
        joint: that it is at, from 1; None for none.
        marker: from 1; None for none.
        since: pose, from 1, from which on it counts; None for all.
        parameters: value, 95 % interval and unit by name.
        p_value: of the test that it is there, corrected for all causes that were tried.
        share: of the squared error before that it takes away.
        rivals: causes that explain the same errors nearly as well.
    """

    ENTRIES = ("*", "parameters=stated_parameters", "sentence", "action")

    cause: str
    joint: int | None
    marker: int | None
    since: int | None
    parameters: tuple[dict[str, Any], ...]
    p_value: float
    share: float
    rivals: tuple[str, ...] = ()

    @property
    def stated_parameters(self) -> list[dict[str, Any]]:
        """The parameters, as files have them."""
        return [{key: value for key, value in item.items() if key != "shown"} for item in self.parameters]

    @property
    def action(self) -> str:
        """Says what to do."""
        return ACTIONS[self.cause]

    @property
    def sentence(self) -> str:
        """Says it in words."""
        where = f" of joint {self.joint}" if self.joint is not None else ""
        since = f" from pose {self.since} on" if self.since is not None else ""
        p = "p < 0.001" if self.p_value < 0.001 else f"p = {self.p_value:.2g}"
        rivals = f"; it cannot be distinguished from {' or '.join(self.rivals)}" if self.rivals else ""
        head = {
            "zero": f"the zero{where} is off by {self._size()}",
            "link": f"joint {self.joint} stands elsewhere on its link, by {self._size()}",
            "gear_ratio": f"the gear ratio{where} is off by {self._size()}",
            "eccentricity": f"an error of once per turn{where}, amplitude {self._size()}",
            "compliance": f"joint {self.joint} or its link gives way under its load, {self._size()}",
            "thermal_growth": f"the link before joint {self.joint} grows with temperature, {self._size()}",
            "backlash": f"backlash{where} of {self._size()}: the error depends on the direction of approach",
            "load_backlash": f"backlash{where} of {self._size()}: the joint lies on the side to which gravity pulls",
            "time_offset": f"the clocks of tracker and robot differ by {self._size()}",
            "loose_marker": f"marker {self.marker} moved by {self._size()}{since}",
            "moved_base": f"the base or the tracker moved by {self._size()}{since}",
            "unexplained": "errors remain that vary smoothly with the pose and that no known cause explains",
        }[self.cause]
        return f"{head} ({p}, {100.0 * self.share:.2g} % of the squared error){rivals}"

    def _size(self) -> str:
        """The size for people: the value of one parameter, or the length of shifts and turns."""
        by_unit: dict[str, float] = {}
        for item in self.parameters:
            by_unit[item["unit"]] = by_unit.get(item["unit"], 0.0) + item["value"] ** 2
        if len(self.parameters) == 1:
            item = self.parameters[0]
            unit, factor = item["shown"]
            # Intervals are often narrower than two digits tell.
            value, low, high = (f"{float(f'{factor * x:.3g}'):g}" for x in (item["value"], *item["ci95"]))
            return f"{value} ({low} to {high}) {unit}"
        shown = {item["unit"]: item["shown"] for item in self.parameters}
        parts = [f"{two_digits(shown[unit][1] * square**0.5)} {shown[unit][0]}" for unit, square in by_unit.items()]
        return " and ".join(parts)
