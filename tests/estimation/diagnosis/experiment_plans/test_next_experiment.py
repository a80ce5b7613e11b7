"""Tests of the next experiment: its predicted chances, and motions that stay within the range of the logs."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.experiment_plans.choices import (
    ENOUGH,
    LIKELY,
    LONGEST,
    Choice,
    combined,
    make_choice,
    repeat_stages,
)
from estimation.diagnosis.experiment_plans.experiment_grams import Grams
from estimation.diagnosis.experiment_plans.experiment_motions import MADE, MAKERS, Stage, motion_range
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment, plan_next
from estimation.diagnosis.experiment_plans.planned_limits import planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from robots.loading import load_robot
from robots.plants import Sensors
from robots.regressor import default_model
from robots.signals import Motion
from robots.terms.effects import EFFECTS, EXPERIMENTS
from robots.terms.situations.flange_body import point_mass


@dataclass(frozen=True)
class Guess:
    """An effect as a diagnosis found it."""

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    coefficients: np.ndarray


@pytest.fixture(scope="module")
def problem():
    friction = np.zeros((6, 4))
    friction[:, :2] = [[10, 15], [10, 15], [8, 12], [3, 4], [3, 4], [3, 4]]
    robot = replace(load_robot("ur10"), friction=friction)
    t = 0.008 * np.arange(3000)
    random = np.random.default_rng(4)
    w = 2 * np.pi * 0.1 * np.arange(1, 6)
    size, phase = 0.5 * random.normal(size=(6, 5)) / np.arange(1, 6), random.uniform(0, 2 * np.pi, (6, 5))
    angle = t[:, None, None] * w + phase
    q = (size * np.sin(angle)).sum(axis=2)
    dq, ddq = (size * w * np.cos(angle)).sum(axis=2), -(size * w**2 * np.sin(angle)).sum(axis=2)
    model = default_model(robot, velocity_scale=2e-3)
    return planned_problem(model, model.nominal, [Motion(t, q, dq, ddq)], noise=Sensors(torque_noise=0.025))


def _guess(problem, name, joint, shape, share):
    """Builds an effect with a given fraction of the joint's torque, and columns of equal size."""
    hypothesis = Hypothesis(EFFECTS[name], joint)
    X = EFFECTS[name].columns(problem.situation, joint, shape)
    row = (joint or 2) - 1
    weights = 1 / np.sqrt(np.mean(X**2, axis=(0, 1)))
    size = np.sqrt(np.mean((X[:, row] @ weights) ** 2))
    return Guess(hypothesis, shape, weights * share * np.sqrt(np.mean(problem.recording.tau[:, row] ** 2)) / size)


@pytest.fixture(scope="module")
def payload_plan(problem):
    """Plans for a wrong torque constant and an encoder offset of one joint."""
    causes = [
        _guess(problem, "torque_constant_error", 4, (), 0.02),
        _guess(problem, "encoder_offset", 4, (), 0.02),
    ]
    return plan_next(problem, causes)


@pytest.mark.slow
def test_every_kind_has_its_motions(problem):
    """Each kind of experiment that an effect can name has a generator of its motions."""
    assert set(MAKERS) == set(EXPERIMENTS)


@pytest.mark.parametrize("kind", list(MAKERS))
def test_motions_stay_where_the_robot_has_been(kind, problem):
    """Motions stay within the logs' positions and near their speeds, and velocities are the positions' derivatives."""
    room = motion_range(problem.situation.robot, problem.recording)
    for stage in MAKERS[kind](room, 3, 1):
        m = stage.motion
        reach = room.upper - room.lower
        assert (m.q >= room.lower - 1e-6 * reach).all()
        assert (m.q <= room.upper + 1e-6 * reach).all()
        assert (np.abs(m.dq) <= 1.05 * room.speed).all()  # sums of sines, and ramps of finite steps
        assert (np.abs(m.ddq).max(axis=0) <= 1.5 * room.acceleration).all()
        way = np.cumsum(m.dq[:-1] + m.dq[1:], axis=0) * room.step / 2
        np.testing.assert_allclose(m.q[1:] - m.q[0], way, atol=5e-3 * reach.max())
        assert stage.motion.duration > 1.0
        if kind in MADE:
            ends = m.dq[[0, -1]]
            assert np.abs(ends).max() < 0.01 * room.speed.max()


@pytest.mark.slow
def test_a_payload_tells_a_torque_constant(payload_plan):
    """A known payload separates a wrong torque constant from an encoder offset, as is known from the literature."""
    plan = payload_plan
    assert plan.kind == "payload"
    assert plan.resolves > 0.9
    assert plan.joint == 4
    assert f"payload {max(stage.payload for stage in plan.stages):.2g} kg" in plan.why
    assert "torque constant error of joint 4" in plan.why
    assert {p.kind for p in plan.ranking} == set(EXPERIMENTS)
    assert max(p.resolves for p in plan.ranking if p.kind not in ("payload", "second_base_pose")) < 0.5


@pytest.mark.slow
def test_heat_is_not_stated_by_going_on_at_once(problem):
    """Repeating the motion at once does not separate heat from a friction step, because the joint has not cooled."""
    end = float(problem.recording.t[-1])
    step = _guess(problem, "friction_step", 2, (0.5 * end,), 0.015)
    causes = [_guess(problem, "thermal_friction", 2, (0.2 * end, 0.0, 0.0), 0.015), step]
    grams = Grams(problem, causes)
    room = motion_range(problem.situation.robot, problem.recording)
    cold, warm = (grams.chances_of([gram])[0, 1] for gram in grams.later(MAKERS["repeat"](room, 1, 0)))
    assert cold > 0.95
    assert warm < 0.9
    plan = plan_next(problem, causes)
    assert plan.kind != "repeat"
    assert plan.resolves > 0.99


@pytest.mark.slow
def test_heat_of_the_logs_goes_on_in_the_experiment(problem):
    """An experiment after the logs shows the same as the second part of one that begins with the logs' motion."""
    recording = problem.recording
    logged = Stage(motion=Motion(recording.t - recording.t[0], recording.q, recording.dq, recording.ddq))
    grams = Grams(problem, [_guess(problem, "thermal_friction", 2, (30.0, 0.0, 0.0), 0.02)])
    (stage,) = MAKERS["repeat"](motion_range(problem.situation.robot, recording), 1, 0)
    cold, warm = (grams.block(gram, 0) for gram in grams.later([stage]))
    both = grams.block(grams.of([logged, stage]), 0) - grams.block(grams.of([logged]), 0)
    np.testing.assert_allclose(warm, both, atol=0.03 * np.abs(both).max())
    assert np.trace(cold) < 0.7 * np.trace(warm)


@pytest.mark.slow
def test_levels_of_the_logs_are_not_those_of_experiments_to_come(problem):
    """Noise levels of individual logs are not used for experiments with another number of parts."""
    louder = replace(problem, whitening=replace(problem.whitening, levels=np.full((1, problem.n), 0.5)))
    causes = [
        _guess(problem, "torque_constant_error", 4, (), 0.02),
        _guess(problem, "encoder_offset", 4, (), 0.02),
    ]
    plan = plan_next(louder, causes)
    assert plan.kind == "payload"
    assert plan.resolves > 0.9


@pytest.mark.slow
def test_the_least_trouble_is_proposed_where_several_would_do(problem):
    """Causes that any motion separates need only a repetition, not a payload or a tilted base."""
    causes = [
        _guess(problem, "stribeck", 4, (0.05, 1.0), 0.02),
        _guess(problem, "presliding_hysteresis", 4, (0.003,), 0.02),
    ]
    assert plan_next(problem, causes).kind == "repeat"


@pytest.mark.slow
def test_what_to_play_is_reported(payload_plan):
    """For an experiment with a payload the runs are the logged motion, first without and then with the payload."""
    plan = payload_plan
    assert len(plan.motions) == 1
    without, with_it = plan.runs[0], plan.runs[-1]
    assert (without["motion"], without["payload_kg"], without["gravity"]) == (1, 0.0, None)
    assert with_it["motion"] == 1
    assert with_it["payload_kg"] == plan.stages[-1].payload > 0
    assert plan.logged.endswith("from t = 0 to 23.99 s")
    assert plan.to_dict()["runs"] == plan.runs


def test_what_is_nearly_sure_goes_after_what_is(problem):
    """An experiment with a sufficient chance is ranked before one with a chance slightly below."""
    grams, stages = np.zeros((1, 1)), ()
    chances = [np.full((2, 2), enough) for enough in (ENOUGH - 1e-3, ENOUGH)]
    nearly, enough = (Choice("payload", stages, (grams,), each) for each in chances)
    assert enough.rank < nearly.rank


@pytest.mark.slow
def test_what_once_does_not_tell_is_made_several_times(problem):
    """For a small effect the motion is repeated until the chance is sufficient, and the plan states that chance."""
    names = (("stribeck", (0.05, 1.0)), ("presliding_hysteresis", (0.003,)))
    causes = [_guess(problem, name, 4, shape, 0.002) for name, shape in names]
    plan = plan_next(problem, causes)
    grams = Grams(problem, causes)
    assert plan.times > 1
    assert plan.resolves >= 0.95
    assert plan.resolves == pytest.approx(grams.chance(plan.stages))
    assert grams.chance(plan.stages[: len(plan.stages) // plan.times]) < 0.95
    assert f"({plan.times} times)" in plan.why
    assert plan.to_dict()["times"] == plan.times
    assert plan.ranking[0].duration == pytest.approx(sum(s.pause + s.motion.duration for s in plan.stages))
    assert plan.ranking[0].duration <= LONGEST


@pytest.mark.slow
def test_kinds_are_combined_where_none_is_likely_to_decide(problem):
    """Two kinds together are more likely to separate two causes than each; their information adds up."""
    names = (("stribeck", (0.05, 1.0)), ("presliding_hysteresis", (0.003,)))
    causes = [_guess(problem, name, 4, shape, 7e-4) for name, shape in names]
    grams = Grams(problem, causes)
    room = motion_range(problem.situation.robot, problem.recording)
    first, *others = (make_choice(grams, room, 3, kind) for kind in ("micro_reversals", "sweep", "multisine"))
    both = combined(grams, first, others)
    assert first.chance < LIKELY
    assert both.more
    assert both.chance > first.chance
    assert both.chance == pytest.approx(grams.chance(both.stages), rel=1e-6)
    assert both.duration > first.duration


def test_a_payload_is_mounted_once_however_often_the_motion_is_made(problem):
    """Repeated stages are ordered by their payload, so the payload is mounted once, with one pause for it."""
    stages = MAKERS["payload"](motion_range(problem.situation.robot, problem.recording), 0, 0)
    four = repeat_stages(stages, 4)
    assert [stage.payload for stage in four] == [0.0] * 4 + [stages[1].payload] * 4
    assert [stage.pause for stage in four] == [2.0] * 4 + [60.0] + [2.0] * 3
    assert repeat_stages(stages, 1) == stages


@pytest.mark.slow
def test_where_two_causes_stay_alike_the_others_are_distinguished(problem):
    """If two causes cannot be separated, the plan separates the others as well as possible and states this."""
    error = _guess(problem, "torque_constant_error", 2, (), 0.01)
    other = _guess(problem, "torque_constant_error", 3, (), 0.01)
    plan = plan_next(problem, [error, other, error])
    assert plan is not None
    assert plan.resolves < 1e-6
    twice = "torque constant error of joint 2 and torque constant error of joint 2"
    assert plan.why.startswith(f"No experiment of the known kinds is likely to distinguish {twice}")
    assert "it may distinguish the others" in plan.why
    grams = Grams(problem, [error, other])
    first, last = (
        MAKERS[choice.kind](motion_range(problem.situation.robot, problem.recording), 1, 0)
        for choice in (plan.ranking[0], plan.ranking[-1])
    )
    assert grams.chance(repeat_stages(first, plan.times)) > grams.chance(last)
    pair = plan_next(problem, [error, error])
    assert pair is not None
    assert "with 0 % probability" in pair.why


def test_one_cause_needs_no_experiment(problem):
    """With a single cause left, no experiment is proposed."""
    assert plan_next(problem, [_guess(problem, "stribeck", 4, (0.05, 1.0), 0.02)]) is None


@pytest.mark.slow
def test_the_plan_is_plain_data(payload_plan):
    """The plan converts to plain data for the diagnosis file."""
    data = json.loads(json.dumps(payload_plan.to_dict()))
    assert {"kind", "why", "resolves"} <= set(data)
    assert 0 <= data["resolves"] <= 1


def test_limits_of_zero_are_no_limits(problem):
    """Velocity limits of zero and a joint at rest still give finite motions."""
    robot = problem.situation.robot
    zero = replace(robot, limits=replace(robot.limits, velocity=np.zeros(6)))
    q = problem.recording.q.copy()
    q[:, 2] = 0.3
    still = replace(problem.recording, q=q, dq=np.where(np.arange(6) == 2, 0.0, problem.recording.dq))
    room = motion_range(zero, still)
    assert (np.delete(room.speed, 2) > 0).all()
    for make in MAKERS.values():
        for stage in make(room, 2, 0):
            assert np.isfinite(stage.motion.q).all()


@pytest.mark.slow
def test_the_experiment_starts_from_the_arm_itself(problem):
    """A payload in the first log does not change the information of an experiment without it."""
    body = point_mass(6.0, (0.0, 0.1, 0.2))
    carried = replace(problem.recording, payloads=(body,))
    now = build_situation(carried, problem.situation.model, problem.situation.parameters)
    loaded = replace(problem, recording=carried, situation=now)
    assert np.abs(now.rigid - problem.situation.rigid).max() > 10.0
    causes = [
        _guess(problem, "load_dependent_friction", 4, (1.0, 0.0), 0.02),
        _guess(problem, "stribeck", 4, (0.05, 1.0), 0.02),
    ]
    room = motion_range(problem.situation.robot, problem.recording)
    stages = MAKERS["payload"](room, 3, 0)
    expected, found = (Grams(some, causes).of(stages) for some in (problem, loaded))
    # The payload's parameters were added and subtracted, so sums are rounded.
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.slow
def test_a_tilted_base_counts_with_the_parameters_that_it_shows(problem):
    """With a tilted base, the first joint's first moments, which level logs do not determine, are fitted, too."""
    causes = [
        _guess(problem, "spring", 1, (0.0, 0.0, 3.0), 0.02),
        _guess(problem, "torque_constant_error", 1, (), 0.02),
    ]
    grams = Grams(problem, causes)
    names = {column.name for column in grams.base.columns} - {c.name for c in problem.baseline.base.columns}
    assert names == {"mPx_1", "mPy_1"}
    room = motion_range(problem.situation.robot, problem.recording)
    total = grams.old + grams.of(MAKERS["second_base_pose"](room, 0, 0))
    own = [i for i, column in enumerate(grams.base.columns) if column.name in names]
    level = np.sqrt(np.diag(grams.old)[own])
    assert np.all(level < 1e-6 * np.sqrt(np.diag(total)[own]))


@pytest.mark.slow
def test_a_base_that_stands_otherwise_stays_there(problem):
    """Experiments are made in the base pose of the last log, and a second base pose is tilted from there."""
    wall = np.array([-9.81, 0.0, 0.0])
    stands = replace(problem, recording=replace(problem.recording, gravity_fields=(wall,)))
    causes = [_guess(problem, "stribeck", 4, (0.05, 1.0), 0.02), _guess(problem, "spring", 4, (0.0, 0.0, 3.0), 0.02)]
    room = motion_range(problem.situation.robot, problem.recording)
    (stage,) = MAKERS["repeat"](room, 3, 0)
    grams = Grams(stands, causes)
    expected = grams.of([replace(stage, gravity=wall)])
    np.testing.assert_allclose(grams.of([stage]), expected, atol=1e-12 * np.abs(expected).max())
    plan = plan_next(stands, causes)
    (tilted,) = MAKERS["second_base_pose"](motion_range(problem.situation.robot.under(wall), stands.recording), 3, 0)
    assert plan is not None
    assert tilted.gravity @ wall / 9.81**2 == pytest.approx(np.cos(np.radians(15.0)))


def test_a_combined_experiment_survives_its_file() -> None:
    """All kinds that an experiment combines are read back."""
    planned = NextExperiment(kind="payload", joint=None, why="", resolves=0.9, kinds=("payload", "repeat"))
    assert NextExperiment.from_dict(planned.to_dict()).kinds == planned.kinds
    assert NextExperiment(kind="repeat", joint=1, why="", resolves=0.1).kinds == ("repeat",)
