"""Feedback of a controller that also says what it does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from oed.exports.simple_message import Status, TorqueFeedback


@dataclass(frozen=True, slots=True, kw_only=True)
class StateFeedback(TorqueFeedback):
    """Feedback that also says what the controller does.

    Attributes:
        further: other quantities of the joints by their names in logs, each with its unit.
        played: counter of the program on the controller.
        status: state of the controller.
    """

    further: Mapping[str, tuple[str, tuple[float, ...]]]
    played: int
    status: Status
