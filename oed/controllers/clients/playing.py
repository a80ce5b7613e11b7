"""The verb `stream`: plays a trajectory on a controller and records the feedback."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict
from os import PathLike, fspath
from typing import Any

import numpy as np

from oed.controllers.clients.checks import check_start, check_status, require_known_form, status_problem
from oed.controllers.clients.ending import Ending
from oed.controllers.clients.guide import GuidePlayer
from oed.controllers.clients.program import ProgramPlayer
from oed.controllers.clients.requests import Requests
from oed.controllers.clients.result import StreamResult
from oed.controllers.clients.sender import Array, Sender
from oed.controllers.clients.traffic import Traffic
from oed.controllers.clients.watching import tolerances, watch_of
from oed.controllers.egm.link import EgmLink
from oed.controllers.errors import ControllerError, NoReplyError, PointRefusedError
from oed.controllers.interrupts import signals_held
from oed.controllers.links import Link, open_link
from oed.controllers.options import Endpoint, StreamOptions
from oed.controllers.recording.clock import ClockAnchor
from oed.controllers.recording.log_file import check_log_path
from oed.controllers.recording.pose import require_torque
from oed.controllers.recording.recorder import Recorder
from oed.controllers.recording.recording import with_rows
from oed.controllers.recording.reported_joints import require_no_further_joints, warn_of_other_robot
from oed.controllers.rtde.link import RtdeLink, ScriptLink
from oed.controllers.rtde.packages import UR_JOINTS
from oed.exports.forms.base import require_joints
from oed.exports.forms.sampling import at_cycle
from oed.exports.simple_message import JointPosition, trajectory_points
from oed.exports.simple_message.kinds import MESSAGE_JOINTS
from oed.exports.trajectory_checks import check_trajectory
from robots.common.errors import InputError, OedError
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Motion
from robots.version import VERSION

CLEAR = "clear it at the controller, move the robot to the start of the trajectory, and play it again"


def stream(
    motion: Motion,
    robot: Robot,
    endpoint: Endpoint,
    *,
    log: str | PathLike[str] | None = None,
    options: StreamOptions | None = None,
    metadata: Mapping[str, Any] | None = None,
    header: Mapping[str, Any] | None = None,
    anchor: ClockAnchor | None = None,
    needs_torque: bool = False,
    file: str | PathLike[str] | None = None,
    dry_run: bool = False,
    force: bool = False,
    progress: Progress = SILENT,
) -> StreamResult:
    """Plays a trajectory on a controller by simple_message and records the feedback.

    Before anything moves the trajectory is checked against the robot's limits, the controller's state is looked at, and
    the reported pose is compared with the first point. Whatever ends the motion, Ctrl-C included, a stop is ordered.

    Args:
        motion: the trajectory, at rest at both ends.
        robot: the robot.
        endpoint: its controller.
        log: CSV file for the feedback; needed but for a dry run.
        options: how it is sent.
        metadata: what the trajectory's file says of itself.
        header: further entries of the log's header.
        anchor: the end of the log whose clock this one continues.
        needs_torque: refuse a controller whose feedback carries neither torque nor current.
        file: the trajectory's file, for messages.
        dry_run: check everything that feedback shows, send nothing but pings that are asked for, and write nothing.
        force: whether an existing log may be replaced.
        progress: listener.

    Returns:
        What happened.

    Raises:
        InputError: a trajectory that this robot must not play, another start pose, or a log that cannot be written.
        LinkError: the controller cannot be reached, or falls silent.
        ControllerError: the controller is not ready, refuses a point, or the robot does not reach the end.

    Warns:
        OtherRobotWarning: positions that this robot cannot have, or last joints that read zero all the time.
    """
    options = options or StreamOptions()
    metadata = metadata or {}
    check_trajectory(motion, robot, metadata, file)
    if motion.n > MESSAGE_JOINTS:
        raise InputError(f"{motion.n} joints", file=file, allowed=f"up to {MESSAGE_JOINTS}, as simple_message has")
    tolerances(robot, options.tolerance)
    most = None if options.driver is None else options.driver.most
    if most is not None and len(motion) > most:
        assert options.driver is not None
        raise InputError(
            f"{len(motion)} points",
            file=file,
            allowed=f"up to {most}, as {options.driver.title} holds",
            remedy="play it with a longer --period, or a program of `oed export` on the controller",
        )
    if not dry_run:
        if log is None:
            raise InputError("no log file for the feedback", remedy="give one")
        check_log_path(log, force)
    if endpoint.protocol == "rtde":
        require_joints(robot, UR_JOINTS, UR_JOINTS, "a UR controller")
    state = open_link(endpoint, endpoint.state_port)
    if isinstance(state, RtdeLink):
        motion = at_cycle(motion, state.cycle)
    recorder = Recorder(
        state,
        robot,
        endpoint.form,
        options.patience,
        endpoint.connect_time,
        answers=not dry_run,
    )
    source = f"feedback of {endpoint.place(endpoint.state_port)}"
    known = {"robot": robot.name, "source": source, "tool": VERSION, **(header or {})}
    traffic = Traffic()
    requests: Sender | None = None
    begin, ended = time.monotonic(), "interrupted"
    failure: OedError | None = None
    try:
        pose = recorder.wait_for_feedback()
        if not options.external_axes:
            require_no_further_joints(pose[robot.n :], robot)
        if not options.ignore_status and recorder.is_moving(options.start_tolerance):
            raise ControllerError(
                "the robot is moving", remedy="wait for the end of its motion; another client may be playing it"
            )
        check_start(motion.q[0], pose[: robot.n], options.start_tolerance)
        if needs_torque:
            require_torque(recorder.layout, endpoint)
        require_known_form(options, endpoint, recorder.layout.kind is JointPosition)
        with ExitStack() as links:
            # A motion port may belong to a driver that moves on what it does not know, or drops its client.
            if options.ping or not dry_run:
                # A controller that is guided has one port for all.
                guided = isinstance(state, EgmLink)
                link = state if guided else links.enter_context(open_link(endpoint, endpoint.motion_port))
                # A port that serves another client closes the link, or says something.
                if not guided:
                    # How long a link that is closed at once is waited for [s].
                    link.receive(0.1)
                requests = _sender(link, state, motion, robot, endpoint, options, recorder, traffic)
                # Pings from which the delay is measured.
                for number in range(9 if options.ping else 0):
                    requests.ping(None if number else max(options.patience, endpoint.connect_time))
            if not options.ignore_status and status_problem(recorder.status) is not None:
                # The error of an interrupted motion ends with the link of the next client.
                check_status(recorder.renewed_status(), endpoint.place(endpoint.state_port))
            if not dry_run:
                assert log is not None
                assert requests is not None
                recorder.begin(log, known, anchor=anchor, delay=traffic.delay, force=force)
                begin = time.monotonic()
                try:
                    _play(motion, robot, requests, recorder, options, progress)
                finally:
                    with signals_held():
                        if traffic.begun and not traffic.stopped:
                            requests.stop()
        ended = "done"
    except OedError as error:
        failure, ended = error, error.problem
    finally:
        duration = time.monotonic() - begin
        final = {
            "complete": ended == "done",
            "ended": ended,
            "sent_points": traffic.sent,
            "resent_points": traffic.resent,
            "message_delay": traffic.delay,
            **({} if requests is None or requests.lag is None else {"command_lag": requests.lag.lags()}),
        }
        with signals_held():
            try:
                recorder.finish(final)
            except OedError as error:
                failure = failure or error
        # The terminal may be lost: the log comes first.
        progress.finish()
    if failure is not None:
        stop = "the controller did not confirm the stop" if traffic.begun and not traffic.stopped else ""
        raise with_rows(failure, recorder.rows, log, stop)
    if recorder.lowest is not None and recorder.highest is not None:
        warn_of_other_robot(robot, recorder.lowest, recorder.highest, motion.q)
    return StreamResult(
        robot=robot.name,
        place=endpoint.place(endpoint.motion_port),
        points=len(motion),
        sent=traffic.sent,
        resent=traffic.resent,
        unexpected=traffic.unexpected,
        duration=duration,
        delay=traffic.delay,
        stopped=traffic.stopped,
        log="" if dry_run else fspath(log or ""),
        rows=recorder.rows,
        feedback=recorder.statistics.summary(),
        status={} if recorder.status is None else asdict(recorder.status),
        dry_run=dry_run,
        note="\n".join(filter(None, [recorder.note, _lag_in_words(requests)])),
        anchor=None if dry_run else recorder.anchor(),
    )


def _sender(
    link: Link,
    state: Link,
    motion: Motion,
    robot: Robot,
    endpoint: Endpoint,
    options: StreamOptions,
    recorder: Recorder,
    traffic: Traffic,
) -> Sender:
    """Gives what sends points over a link, by the protocol of the controller."""
    if isinstance(state, EgmLink):
        return GuidePlayer(state, motion, robot, options, recorder, traffic)
    if isinstance(link, ScriptLink) and isinstance(state, RtdeLink):
        return ProgramPlayer(link, state.own_address, motion, robot, options, recorder, traffic)
    return Requests(link, endpoint.wire_form, options, traffic)


def _lag_in_words(requests: Sender | None) -> str:
    """Says how far the joints follow behind their commands, where that is measured."""
    lags = [] if requests is None or requests.lag is None else requests.lag.lags()
    known = [lag for lag in lags if lag is not None]
    if not known:
        return ""
    return f"the joints follow {1e3 * min(known):.0f} to {1e3 * max(known):.0f} ms behind the commands"


def _play(
    motion: Motion,
    robot: Robot,
    requests: Sender,
    recorder: Recorder,
    options: StreamOptions,
    progress: Progress,
) -> None:
    """Sends all points and waits for the end of the motion."""
    # Zero is a place to go to, for an axis that there is.
    further = tuple(recorder.positions[robot.n :].tolist()) if recorder.positions is not None else ()
    resting = options.driver.resting_velocity if options.driver is not None else 0.0
    points = trajectory_points(
        motion,
        robot.limits,
        kind=options.points,
        robot_id=options.robot_id,
        resting=resting,
        further=further,
    )
    ending = Ending(motion, recorder, options.start_tolerance, options.patience)
    path = watch_of(motion, robot, options.tolerance, options.timed, 1.0 if recorder.layout.stamped else options.speed)

    def see(stamp: float, q: Array) -> None:
        requests.see(stamp, q)
        if path is not None:
            path.see(stamp, q)

    recorder.watch = see

    def watch() -> None:
        recorder.check()
        problem = None if options.ignore_status else status_problem(recorder.status)
        if problem is not None:
            raise ControllerError(f"the controller reports {problem} after point {requests.traffic.sent}", remedy=CLEAR)

    def turn() -> None:
        watch()
        requests.keep_alive()

    requests.start()
    progress.start("playing", float(len(motion)))
    if options.download:
        requests.download(points, watch, lambda count: progress.update(float(count)))
    else:
        longest = float(np.diff(motion.t).max()) if len(motion) > 1 else 0.0
        try:
            requests.stream(points, watch, lambda count: progress.update(float(count)), longest)
        except NoReplyError as error:
            # No reply comes at a full buffer; a controller that is gone falls silent at both ports.
            if time.monotonic() - recorder.last_heard > options.patience / 2:
                raise
            raise ControllerError(
                f"the controller takes no points: {error.problem}, but its feedback arrives",
                remedy="its buffer does not empty: check drives, mode, the running program and the motion port",
            ) from error
        except PointRefusedError as error:
            requests.stop()
            # The reply comes before the next report of the state, which says why.
            problem = status_problem(recorder.renewed_status())
            if problem is None:
                raise
            raise ControllerError(
                f"the controller reports {problem} after point {requests.traffic.sent}", remedy=CLEAR
            ) from error
    ending.wait(turn)
