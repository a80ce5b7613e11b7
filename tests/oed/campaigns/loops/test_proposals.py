"""The proposed experiment as motions that a controller plays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.choices import Proposal
from estimation.diagnosis.experiment_plans.experiment_motions import Stage
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment
from oed.campaigns.loops.proposals import PlannedExperiment, plan_experiment, repeats, within
from robots.signals import Motion
from tests.oed.campaigns.conftest import arm

PERIOD = 0.004
HOME = np.zeros(2)


def played() -> Motion:
    """A motion from home and back in 8 s that is not the same backwards."""
    t = PERIOD * np.arange(2001)
    w = 2 * np.pi / 8.0
    shape = [np.sin(w * t) ** 3, 3 * w * np.sin(w * t) ** 2 * np.cos(w * t)]
    shape.append(3 * w**2 * (2 * np.sin(w * t) * np.cos(w * t) ** 2 - np.sin(w * t) ** 3))
    ease = (t / 8.0) ** 2 * (1 - t / 8.0) ** 2 * 16
    dease = np.gradient(ease, PERIOD)
    q = np.column_stack([0.5 * shape[0], 0.4 * ease])
    dq = np.column_stack([0.5 * shape[1], 0.4 * dease])
    return Motion(t, q, dq, np.column_stack([0.5 * shape[2], 0.4 * np.gradient(dease, PERIOD)]))


def logged(motion: Motion, seed: int = 0) -> Motion:
    """The motion as a diagnosis has it: at 100 Hz, the robot at rest for 0.7 s before it, with noise."""
    t = 0.01 * np.arange(round((motion.duration + 0.7) / 0.01))
    q = np.column_stack([np.interp(t - 0.7, motion.t, x) for x in motion.q.T])
    q += 1e-5 * np.random.default_rng(seed).standard_normal(q.shape)
    return Motion(t, q, np.gradient(q, 0.01, axis=0), np.zeros_like(q))


def backwards(motion: Motion) -> Motion:
    """The motion backwards in time."""
    return Motion(motion.t, motion.q[::-1], -motion.dq[::-1], motion.ddq[::-1])


def proposal(kind: str, *stages: Stage, resolves: float = 0.9, others: tuple[Proposal, ...] = ()) -> NextExperiment:
    """What a diagnosis proposes."""
    return NextExperiment(
        kind=kind, joint=2, why="two causes fit", resolves=resolves, stages=stages, ranking=others, times=1
    )


def test_a_logged_motion_is_recognised() -> None:
    """A motion is recognised in its log, whole or cut at its end; another one and its reverse are not."""
    motion = played()
    seen = logged(motion)
    assert repeats(seen, motion)
    assert repeats(seen.slice(None, 600), motion)
    assert not repeats(seen.slice(None, 300), motion)
    assert not repeats(seen, backwards(motion))
    other = Motion(motion.t, 0.8 * motion.q, 0.8 * motion.dq, 0.8 * motion.ddq)
    assert not repeats(seen, other)
    assert not repeats(seen, replace(motion, q=motion.q[:, :1], dq=motion.dq[:, :1], ddq=motion.ddq[:, :1]))


def test_repetitions_are_cut_to_the_time() -> None:
    """Repetitions beyond the time are left out, and each different stage stays."""
    first, second = (Stage(motion=logged(played(), seed), pause=2.0) for seed in (0, 1))
    stages = (first,) * 4 + (second,) * 4
    length = first.motion.duration + 2.0
    assert within(stages, np.inf) == stages
    assert within(stages, 4.5 * length) == (first,) * 2 + (second,) * 2
    assert within(stages, 1.0) == (first, second)
    loaded = replace(first, payload=1.0)
    assert within((first, first, loaded), 1.0) == (first, loaded)


@pytest.mark.slow
def test_repeated_motions_are_played_as_they_were() -> None:
    """A stage that repeats a log is the trajectory itself, or that backwards, with the rest that is asked for."""
    motion = played()
    seen = logged(motion)
    mirrored = proposal("mirrored", Stage(motion=seen, pause=5.0), Stage(motion=backwards(seen)))
    planned = plan_experiment(mirrored, arm(), HOME, [motion])
    assert isinstance(planned, PlannedExperiment)
    assert [run.pause for run in planned.runs] == [5.0, 2.0]
    assert planned.runs[0].motion is motion
    np.testing.assert_array_equal(planned.runs[1].motion.q, motion.q[::-1])
    np.testing.assert_array_equal(planned.runs[1].motion.dq, -motion.dq[::-1])


@pytest.mark.slow
def test_changes_by_hand_are_avoided() -> None:
    """In place of an experiment with a payload the best other kind is made, within all limits, from home to home."""
    robot, motion = arm(), played()
    stages = (Stage(motion=logged(motion)), Stage(motion=logged(motion), payload=2.0))
    others = tuple(
        Proposal(kind=kind, resolves=resolves, duration=60.0)
        for kind, resolves in (("payload", 0.9), ("sweep", 0.7), ("pause", 0.4))
    )
    planned = plan_experiment(proposal("payload", *stages, others=others), robot, HOME, [motion])
    assert isinstance(planned, PlannedExperiment)
    assert (planned.kind, planned.resolves, len(planned.runs)) == ("sweep", 0.7, 1)
    assert "in place of: two causes fit" in planned.why
    sweep = planned.runs[0].motion
    np.testing.assert_allclose(sweep.q[[0, -1]], np.tile(HOME, (2, 1)), atol=1e-9)
    assert not any(margin.violated for margin in robot.limits.margins(sweep))
    assert np.ptp(sweep.q[:, 1]) > 1.0
    reason = plan_experiment(proposal("payload", *stages), robot, HOME, [motion])
    assert isinstance(reason, str)
    assert "a payload of 2 kg must be mounted" in reason


@pytest.mark.slow
def test_unlikely_experiments_are_not_made() -> None:
    """An experiment below the asked probability is a reason to end, in the diagnosis' words."""
    stage = Stage(motion=logged(played()))
    unlikely = proposal("repeat", stage, resolves=0.3)
    assert plan_experiment(unlikely, arm(), HOME, [played()]) == "two causes fit"
    made = plan_experiment(unlikely, arm(), HOME, [played()], least_probability=0.2)
    assert isinstance(made, PlannedExperiment)
