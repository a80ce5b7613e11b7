"""Tables of known programs: one recorder a file. The first that recognises the column names reads a table."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.logs.recorders.kuka_fri import KukaFri
from estimation.logs.recorders.libfranka import LibFranka
from estimation.logs.recorders.recorder import Recognised, Recorder
from estimation.logs.recorders.ros_topic_csv import RosTopicCsv
from estimation.logs.recorders.ur_rtde import UrRtde

__all__ = ["RECORDERS", "Recognised", "Recorder", "recorder_of"]

RECORDERS: tuple[Recorder, ...] = (UrRtde(), LibFranka(), KukaFri(), RosTopicCsv())
"""All known programs."""


def recorder_of(names: Sequence[str]) -> Recorder | None:
    """Finds the program that wrote a table with these columns; None for a table with a log's own names.

    Args:
        names: of the columns, in order.
    """
    if {"t", "q1"} <= set(names):
        return None
    return next((recorder for recorder in RECORDERS if recorder.recognises(names)), None)
