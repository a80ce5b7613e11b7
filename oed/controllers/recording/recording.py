"""The verb `record`: feedback of a controller into a log, whoever moves the robot."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any

from oed.controllers.interrupts import signals_held
from oed.controllers.links import open_link
from oed.controllers.options import Endpoint
from oed.controllers.recording.log_file import check_log_path
from oed.controllers.recording.recorder import Recorder
from oed.controllers.recording.reported_joints import require_no_further_joints, warn_of_other_robot
from robots.common.errors import InputError, OedError
from robots.common.plain import several
from robots.common.progress import SILENT, Progress
from robots.common.records import Record
from robots.robot import Robot
from robots.version import VERSION


@dataclass(frozen=True, kw_only=True)
class Recording(Record):
    """What was recorded.

    Attributes:
        robot: its name.
        place: the controller.
        log: the file.
        rows: of the log.
        duration: of the recording [s].
        interrupted: whether Ctrl-C ended it.
        feedback: rate, loss and jitter.
        note: what went wrong without harm.
    """

    robot: str
    place: str
    log: str
    rows: int
    duration: float
    interrupted: bool
    feedback: dict[str, Any]
    note: str = ""

    def summary(self) -> str:
        """Says in one line what was recorded."""
        text = f"{self.rows} rows of {self.robot} in {self.duration:.1f} s written to {self.log}, {loss(self.feedback)}"
        return "\n".join([text, *([self.note] if self.note else [])])


def record(
    robot: Robot,
    endpoint: Endpoint,
    log: str | PathLike[str],
    *,
    duration: float | None = None,
    patience: float = 2.0,
    external_axes: bool = False,
    force: bool = False,
    progress: Progress = SILENT,
) -> Recording:
    """Records the feedback of a controller.

    Args:
        robot: whose joints report.
        endpoint: its controller.
        log: CSV file.
        duration: of the recording [s]; until Ctrl-C by default.
        patience: longest silence [s].
        external_axes: whether the controller may report axes behind those of the robot; they are left out.
        force: whether an existing log may be replaced.
        progress: listener.

    Returns:
        What was recorded; Ctrl-C is a usual end.

    Raises:
        InputError: a log that cannot be written, a duration that is not positive, or a controller with more joints.
        LinkError: the controller cannot be reached, or falls silent; what was recorded stays.

    Warns:
        OtherRobotWarning: positions that this robot cannot have, or last joints that read zero all the time.
    """
    if duration is not None and not duration > 0:
        raise InputError(f"a duration of {duration} s", allowed="above 0")
    check_log_path(log, force)
    place = endpoint.place(endpoint.state_port)
    recorder = Recorder(open_link(endpoint, endpoint.state_port), robot, endpoint.form, patience, endpoint.connect_time)
    begin, ended, interrupted = time.monotonic(), "interrupted", False
    failure: OedError | None = None
    try:
        pose = recorder.wait_for_feedback()
        if not external_axes:
            require_no_further_joints(pose[robot.n :], robot)
        recorder.begin(log, {"robot": robot.name, "source": f"feedback of {place}", "tool": VERSION}, force=force)
        begin = time.monotonic()
        progress.start("recording", duration)
        while duration is None or time.monotonic() - begin < duration:
            time.sleep(0.05)
            recorder.check()
            progress.update(time.monotonic() - begin, f"{recorder.statistics.rows} rows")
        ended = "done"
    except KeyboardInterrupt:
        if not recorder.statistics.rows:
            raise
        interrupted = True
    except OedError as error:
        failure, ended = error, error.problem
    finally:
        length = time.monotonic() - begin
        with signals_held():
            try:
                recorder.finish({"complete": ended in ("done", "interrupted"), "ended": ended})
            except OedError as error:
                failure = failure or error
        progress.finish()
    if failure is not None:
        raise with_rows(failure, recorder.rows, log)
    if recorder.lowest is not None and recorder.highest is not None:
        warn_of_other_robot(robot, recorder.lowest, recorder.highest)
    return Recording(
        robot=robot.name,
        place=place,
        log=fspath(log),
        rows=recorder.rows,
        duration=length,
        interrupted=interrupted,
        feedback=recorder.statistics.summary(),
        note=recorder.note,
    )


def loss(feedback: Mapping[str, Any]) -> str:
    """Says how many rows were lost, and how many messages came too late to be one.

    Args:
        feedback: `Statistics.summary`.
    """
    lost, late = feedback.get("lost"), feedback.get("late_or_twice")
    if lost is None:
        return "loss unknown: rows have the times of their arrival"
    text = f"{lost} lost" if lost else "none lost"
    return f"{text}, {several(late, 'message')} left out that came late or twice" if late else text


def with_rows(error: OedError, rows: int, log: str | PathLike[str] | None, *further: str) -> OedError:
    """Adds to an error where the rows are that were recorded before it.

    Args:
        error: what ended the recording.
        rows: of the log; nothing is added without any.
        log: the file.
        further: what is said before.
    """
    if rows:
        error.remedy = "; ".join([*filter(None, [error.remedy, *further]), f"{rows} rows are in {fspath(log or '')}"])
    return error
