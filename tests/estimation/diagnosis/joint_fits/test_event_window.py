"""Tests of the time window of a contact whose torques do not follow the formula."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.event_window import open_event_edges, refit_event_window
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

PUSH = Hypothesis(EFFECTS["external_contact"], None)
STEP = Hypothesis(EFFECTS["friction_step"], 1)
SIZE = 0.5  # N m
ERRORS = [0.01, 0.02, 0.03, 0.0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "after", "open_"),
    [(0.0, 0.0, ()), (0.4, 0.0, (0,)), (0.0, -0.4, (1,)), (0.4, 0.4, (0, 1))],
)
def test_a_push_that_goes_on_has_no_edge_there(
    arm: Robot,
    arm_log: Callable[..., Log],
    pose_arm: Callable[..., Problem],
    before: float,
    after: float,
    open_: tuple[int, ...],
) -> None:
    """If a push continues with a smaller torque before or after its window, the error of that edge is infinite."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    start = float(recording.t[len(recording) // 2])
    since = recording.t - start
    course = np.select(
        [(since > -1.0) & (since < 0.0), (since > 0.0) & (since < 1.0), (since > 1.0) & (since < 2.0)],
        [before, 1.0, after],
        0.0,
    )
    problem = pose_arm(replace(recording, tau=recording.tau + SIZE * course[:, None]))
    member = refine(problem, PUSH, (start, 1.0, 0.05, 0.0, 0.0), accept(problem, ()), effort=0)
    wanted = [np.inf if k in open_ else error for k, error in enumerate(ERRORS)]
    assert open_event_edges(problem, member, [], ERRORS) == wanted


@pytest.mark.slow
def test_a_push_at_the_log_s_end_and_what_is_no_push_have_their_errors(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """Edges at the end of the log keep their errors, and so does the time of a friction step."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    problem = pose_arm(recording)
    last = float(recording.t[-1])
    member = refine(problem, PUSH, (last - 1.0, 1.0, 0.05, 0.0, 0.0), accept(problem, ()), effort=0)
    assert open_event_edges(problem, member, [], ERRORS) == ERRORS
    step = refine(problem, STEP, (last - 1.0,), accept(problem, ()), effort=0)
    assert open_event_edges(problem, step, [], [0.01]) == [0.01]


@pytest.mark.slow
@pytest.mark.parametrize(("begin", "end"), [(0.3, 0.55), (0.4, 0.7)])
def test_a_push_on_a_moving_arm_is_distinguished_from_its_first_to_its_last_moment(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], begin: float, end: float
) -> None:
    """A constant force on a moving arm, found as a short pulse, gets its full window by the body's Jacobian."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    first, last = recording.t[[int(share * len(recording)) for share in (begin, end)]]
    problem = pose_arm(recording)
    on_body = (first, last - first, 0.01, 0.0, float(arm.n))
    X = PUSH.effect.columns(problem.situation, None, on_body)
    assert X[0].any() == X[-1].any() == np.False_
    force = np.zeros(X.shape[2])
    force[:3] = [2.0, 3.0, 1.0]
    force[3:] = np.outer([0.2, 0.1, -0.1], force[:3]).ravel()
    problem = pose_arm(replace(recording, tau=recording.tau + X @ force))
    beside = accept(problem, ())
    quarter = (last - first) / 4
    pulse = refine(problem, PUSH, (first + quarter, 2 * quarter, 0.05, 0.0, 0.0), beside, effort=0)
    found = refit_event_window(problem, pulse, beside)
    assert found.shape[4] > 0
    assert found.shape[0] == pytest.approx(first, abs=0.1)
    assert found.shape[0] + found.shape[1] == pytest.approx(last, abs=0.1)
    assert found.gain > pulse.gain
    # It already has the formula for a moving arm, and other effects have none.
    assert refit_event_window(problem, found, beside) is found
    step = refine(problem, STEP, (first,), beside, effort=0)
    assert refit_event_window(problem, step, beside) is step
