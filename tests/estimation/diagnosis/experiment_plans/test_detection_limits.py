"""Tests of the limits of a planned experiment, against the scores of such data in a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.detection_limits import Limit, find_limits, summarise_limits
from estimation.diagnosis.experiment_plans.planned_limits import planned_limits, planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.power import detectable_energy
from estimation.diagnosis.hypothesis_tests.scan import measure
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.plants import Sensors
from robots.regressor import default_model
from robots.signals import Motion
from robots.terms.effects import EFFECTS

NAMES = (
    "friction_step",
    "stribeck",
    "spring",
    "time_delay",
    "torque_ripple",
    "encoder_offset",
    "torque_constant_error",
)


@pytest.fixture(scope="module")
def ur10():
    friction = np.zeros((6, 4))
    friction[:, :2] = [[10, 15], [10, 15], [8, 12], [3, 4], [3, 4], [3, 4]]
    return replace(load_robot("ur10"), friction=friction)


def _motion(samples, still=None):
    t = 0.008 * np.arange(samples)
    random = np.random.default_rng(4)
    w = 2 * np.pi * 0.1 * np.arange(1, 6)
    size, phase = 0.5 * random.normal(size=(6, 5)) / np.arange(1, 6), random.uniform(0, 2 * np.pi, (6, 5))
    if still is not None:
        size[still] = 0
    angle = t[:, None, None] * w + phase
    return Motion(
        t,
        (size * np.sin(angle)).sum(axis=2),
        (size * w * np.cos(angle)).sum(axis=2),
        -(size * w**2 * np.sin(angle)).sum(axis=2),
    )


@pytest.fixture(scope="module")
def planned(ur10):
    model = default_model(ur10, velocity_scale=2e-3)
    problem = planned_problem(model, model.nominal, [_motion(5000)], noise=Sensors(torque_noise=0.025))
    hypotheses = [Hypothesis(EFFECTS[name], joint) for name in NAMES for joint in EFFECTS[name].joints(ur10)]
    return problem, measure(problem, hypotheses)


@pytest.mark.slow
def test_an_effect_of_the_limits_size_has_the_energy_to_be_found(planned):
    """An effect of the detectable size has the whitened energy that the false-alarm level requires."""
    problem, entries = planned
    limits = {(limit.effect, limit.joint): limit for limit in find_limits(problem, entries)}
    tries = sum(entry.tries for entry in entries)
    rms = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    limit = next(x for x in limits.values() if x.effect == "torque_constant_error" and np.isfinite(x.detectable))
    entry = next(e for e in entries if (e.hypothesis.name, e.hypothesis.joint) == (limit.effect, limit.joint))
    (joint,), (column,) = problem.columns_of(entry.hypothesis, ())
    error = limit.detectable * rms[joint] / np.sqrt(np.mean(column**2))
    needed = detectable_energy(1, tries, penalty=np.log(problem.rows))
    assert error**2 * entry.groups[0].gram[0, 0] == pytest.approx(needed)


def test_the_worst_limit_is_enough_for_each_kind_of_an_effect(planned, ur10):
    """At the size `at_worst` each exponent of a saturation has at least the required energy; one has exactly that."""
    problem, _ = planned
    effect = EFFECTS["torque_constant_saturation"]
    entries = measure(problem, [Hypothesis(effect, joint) for joint in effect.joints(ur10)])
    limits = {limit.joint: limit for limit in find_limits(problem, entries) if limit.effect == effect.name}
    rms = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    needed = detectable_energy(1, sum(entry.tries for entry in entries), penalty=2 * np.log(problem.rows))
    shown = [entry for entry in entries if np.isfinite(limits[entry.hypothesis.joint].at_worst)]
    assert len(shown) >= 3
    for entry in shown:
        limit = limits[entry.hypothesis.joint]
        energies = []
        for shape, group in zip(entry.shapes, entry.groups, strict=True):
            (joint,), (column,) = problem.columns_of(entry.hypothesis, shape)
            error = limit.at_worst * rms[joint] / np.sqrt(np.mean(column**2))
            energies.append(error**2 * group.gram[0, 0])
        assert min(energies) == pytest.approx(needed)
        assert limit.detectable < limit.at_worst


def test_what_the_base_model_absorbs_is_hidden(planned):
    """An encoder offset of a vertical first joint is not detectable at any size, and the limit has a note."""
    problem, entries = planned
    limits = {(limit.effect, limit.joint): limit for limit in find_limits(problem, entries)}
    first = limits["encoder_offset", 1]
    assert not np.isfinite(first.detectable)
    assert first.note
    assert first.to_dict()["detectable"] is None


@pytest.mark.slow
def test_limits_are_ordered_and_fall_with_the_noise(planned, ur10):
    """Attributable sizes are not below detectable sizes, and both are proportional to the noise."""
    problem, entries = planned
    model = default_model(ur10, velocity_scale=2e-3)
    quiet = planned_problem(model, model.nominal, [_motion(5000)], noise=Sensors(torque_noise=0.025 / 4))
    loud = find_limits(problem, entries)
    soft = find_limits(quiet, measure(quiet, [entry.hypothesis for entry in entries]))
    for a, b in zip(loud, soft, strict=True):
        assert a.attributable >= a.detectable
        if np.isfinite(a.detectable):
            assert b.detectable == pytest.approx(a.detectable / 4, rel=1e-3)


@pytest.mark.slow
def test_limits_grow_as_the_root_of_the_time(ur10):
    """With four times the duration, detectable sizes are about half as large."""
    model = default_model(ur10, velocity_scale=2e-3)
    names = ("asymmetric_friction", "time_delay")
    sizes = []
    for samples in (2500, 10_000):
        problem = planned_problem(model, model.nominal, [_motion(samples)], noise=Sensors())
        entries = measure(problem, [Hypothesis(EFFECTS[name], EFFECTS[name].joints(ur10)[0]) for name in names])
        sizes.append([limit.detectable for limit in find_limits(problem, entries) if np.isfinite(limit.detectable)])
    np.testing.assert_allclose(np.array(sizes[0]) / sizes[1], 2.0, rtol=0.1)  # ten of the slowest periods against 2.5


@pytest.mark.slow
def test_a_joint_at_rest_is_reported(ur10):
    """Friction of a joint that does not move has a note and no limit; the limits of other joints are finite."""
    model = default_model(ur10, velocity_scale=2e-3)
    problem = planned_problem(model, model.nominal, [_motion(2000, still=3)], noise=Sensors())
    entries = measure(problem, [Hypothesis(EFFECTS["stribeck"], joint) for joint in (4, 5)])
    limits = {limit.joint: limit for limit in find_limits(problem, entries) if limit.effect == "stribeck"}
    assert limits[4].note == "joint hardly moves"
    assert np.isfinite(limits[5].detectable)
    # The note on rest is not given for a joint that moves.
    assert limits[1].note == "not excited by this motion"


def test_unknown_dynamics_are_refused():
    """Unknown link masses raise an error that names the first unknown parameter."""
    robot = load_robot("ur10")
    unknown = replace(robot, inertia=np.full((6, 10), np.nan))
    model = default_model(unknown)
    with pytest.raises(InputError, match="m_1 is not known"):
        planned_limits(model, model.nominal, [_motion(500)])


@pytest.mark.slow
def test_a_log_shorter_than_the_slowest_heat_is_reported(ur10):
    """For a short log the limit of a thermal effect notes that longer time constants cannot be distinguished."""
    model = default_model(ur10, velocity_scale=2e-3)
    problem = planned_problem(model, model.nominal, [_motion(2000)], noise=Sensors())
    limits = find_limits(problem, measure(problem, [Hypothesis(EFFECTS["thermal_friction"], 2)]))
    note = next(limit.note for limit in limits if (limit.effect, limit.joint) == ("thermal_friction", 2))
    assert "time constants above 16 s, the length of the data, cannot be distinguished" in note


def test_what_shows_at_no_size_is_named() -> None:
    """The summary names at most five undetectable effects, and the number of further ones."""
    known = {"at_worst": 0.02, "attributable": 0.02, "toughest": "", "visible": 0.5}
    seen = Limit(effect="spring", joint=1, detectable=0.01, **known)
    hidden = [Limit(effect="backlash", joint=j + 1, detectable=np.inf, **known) for j in range(6)]
    some = ", ".join(f"backlash of joint {j + 1}" for j in range(4))
    assert "hidden" not in summarise_limits([seen])
    assert summarise_limits([seen, *hidden[:4]]).endswith(f"; at any size hidden: {some}")
    assert summarise_limits([seen, *hidden[:5]]).endswith(f"{some}, backlash of joint 5")
    assert summarise_limits([seen, *hidden]).endswith(f"{some}, and 2 more")
    assert summarise_limits(hidden) == ""
