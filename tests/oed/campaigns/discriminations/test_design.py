"""The experiment that separates two effects, before there is a log."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from oed.campaigns.discrimination_options import DiscriminationOptions
from oed.campaigns.discriminations.design import discriminate, parse_rivals
from oed.campaigns.discriminations.discrimination import Discrimination, DiscriminationScore
from oed.campaigns.discriminations.motions import ExperimentBuilder
from oed.campaigns.discriminations.probabilities import require_separable
from oed.experiments.safety_checks.freedom import is_free
from oed.exports import read_trajectory
from oed.reports import Page
from oed.reports.pages.discrimination_report import discrimination_page
from robots import load_robot
from robots.base_parameters import find_base_parameters
from robots.collision import CoalChecker, collision_model
from robots.common.errors import InfeasibleError, InputError, NotIdentifiableError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import EFFECTS

pytestmark = pytest.mark.slow

PAIR = "stribeck:2,load_dependent_friction:2"


@pytest.fixture(scope="module")
def found(two: Robot) -> Discrimination:
    """The experiment for the usual pair."""
    return discriminate(two, PAIR)


@pytest.fixture(scope="module")
def workshop(two: Robot) -> ExperimentBuilder:
    """Makes motions for the small robot."""
    return ExperimentBuilder(find_base_parameters(default_model(two, velocity_scale=1e-3)), seed=3)


def pendulum() -> Robot:
    """One horizontal axis: what tilts its base turns its zero."""
    axis, turned = np.array([0.0, 0.0, 1.0]), np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    limits = Limits(
        lower=np.array([-2.0]),
        upper=np.array([2.0]),
        velocity=np.array([2.0]),
        acceleration=np.array([10.0]),
        jerk=np.array([200.0]),
        torque=np.array([200.0]),
    )
    return Robot(
        name="pendulum",
        chain=Chain((Joint("swing", "revolute", turned, np.zeros(3), axis),)),
        limits=limits,
        inertia=np.array([[3.0, 0.6, 0, 0, 0.01, 0, 0, 0.16, 0, 0.16]]),
        friction=np.array([[3.0, 2.0, 0.0, 0.0]]),
    )


@pytest.mark.parametrize("kind", sorted(MAKERS))
def test_every_kind_keeps_all_limits_and_rests_at_home(kind: str, workshop: ExperimentBuilder, two: Robot) -> None:
    """Whatever the kind, each run begins and ends at rest at home and passes no limit, the torque's included."""
    for run in workshop.runs(MAKERS[kind](workshop.room, 1, 0)):
        m, limits = run.motion, two.limits
        for row in (0, -1):
            np.testing.assert_allclose(m.q[row], limits.home, atol=1e-9)
            np.testing.assert_allclose(m.dq[row], 0.0, atol=1e-9)
            np.testing.assert_allclose(m.ddq[row], 0.0, atol=1e-7)
        np.testing.assert_allclose(np.diff(m.t), two.period, rtol=1e-6)
        assert (m.q >= limits.lower).all()
        assert (m.q <= limits.upper).all()
        for value, limit in (
            (m.dq, limits.velocity),
            (m.ddq, limits.acceleration),
            (np.diff(m.ddq, axis=0) / two.period, limits.jerk),
        ):
            assert (np.abs(value) <= limit).all()
        # Velocities are the positions' own: the trapezoidal rule errs by jerk h^3 / 12 a step at most.
        step = np.diff(m.q, axis=0) - two.period * (m.dq[1:] + m.dq[:-1]) / 2
        assert np.abs(step).max() <= limits.jerk.max() * two.period**3 / 6


def test_files_say_what_to_play_and_how_sure_it_is(found: Discrimination, two: Robot, tmp_path: Path) -> None:
    """The saved trajectory is the motion that was judged; the file gives kind, reason, chance and segments."""
    found.save(tmp_path)
    data = json.loads((tmp_path / "design.json").read_text())
    motion = read_trajectory(tmp_path / "trajectory.csv", n=2)[0]
    np.testing.assert_array_equal(motion.q, found.motion.q)
    assert data["kind"] == found.kind == data["alternatives"][0]["kind"]
    assert data["resolves"] == found.resolves > 0.95
    assert "distinguishes stribeck of joint 2 from load dependent friction of joint 2" in data["why"]
    assert {run["file"] for run in data["runs"]} == {"trajectory.csv"}
    assert data["segments"][-1]["end"] == pytest.approx(motion.duration)


def test_more_noise_needs_larger_effects(two: Robot, found: Discrimination) -> None:
    """What a rival leaves goes with the inverse square of the noise: twice the noise, twice the smallest size."""
    noisy = discriminate(two, PAIR, options=DiscriminationOptions(noise=2 * found.noise))
    quiet = {judged.kind: judged.smallest(found.size) for judged in found.ranking}
    loud = {judged.kind: judged.smallest(noisy.size) for judged in noisy.ranking}
    # The same motions: the seed is the same, and no choice before the kind's depends on the noise.
    assert loud["repeat"] == pytest.approx(2 * quiet["repeat"], rel=1e-6)


def test_the_experiment_beats_the_reference_alone(found: Discrimination) -> None:
    """What is proposed separates smaller effects than repeating the reference does."""
    repeated = next(judged for judged in found.ranking if judged.kind == "repeat")
    assert found.ranking[0].energy >= repeated.energy


def test_a_joint_left_out_is_that_of_the_rival(two: Robot) -> None:
    """A joint that only one rival names counts for both."""
    assert parse_rivals("stribeck:2,backlash", two) == [("stribeck", 2), ("backlash", 2)]
    assert parse_rivals(["spring:2", "base_tilt"], two) == [("spring", 2), ("base_tilt", None)]


@pytest.mark.parametrize(
    ("rivals", "part"),
    [
        ("stribec:2,backlash:2", "did you mean 'stribeck'"),
        ("stribeck:3,backlash:2", "1, 2"),
        ("stribeck:x,backlash:2", "1, 2"),
        ("base_tilt:1,spring:1", "whole robot"),
        ("stribeck:2", "two"),
        ("stribeck:2,backlash:2,spring:2", "two"),
        ("stribeck:2,stribeck:2", "the same effect on the same joint"),
    ],
)
def test_wrong_rivals_are_named(rivals: str, part: str, two: Robot) -> None:
    """An unknown effect is refused with the nearest name, a joint with those where the effect can act."""
    with pytest.raises(InputError, match=part):
        parse_rivals(rivals, two)


@pytest.mark.parametrize("noise", [[1.0], [1.0, 0.0], [1.0, np.nan]])
def test_wrong_noise_is_refused(noise: list[float], two: Robot) -> None:
    """The noise is one positive number per joint."""
    with pytest.raises(InputError, match="noise"):
        discriminate(two, PAIR, options=DiscriminationOptions(noise=noise))


def test_rivals_that_nothing_separates_are_refused_with_the_reason() -> None:
    """A pendulum's zero is a sum of two moments of mass while its payload sits on the axis: nothing can show it.

    m g l sin(q + d) = m g l cos(d) sin(q) + m g l sin(d) cos(q).
    """
    with pytest.raises(
        NotIdentifiableError, match=r"encoder_offset of joint 1 .* change of the base model.*known payload"
    ):
        discriminate(pendulum(), "encoder_offset:1,base_tilt")


def test_an_effect_that_its_rival_imitates_everywhere_is_refused() -> None:
    """Where in every kind that can be made the rival leaves nothing, both are named, and the kinds that were tried."""
    pair = (Hypothesis(EFFECTS["spring"], 2), Hypothesis(EFFECTS["base_tilt"], None))
    aliases = [
        DiscriminationScore(
            kind=kind,
            resolves=0.0,
            energy=0.0,
            duration=9.0,
            runs=1,
            shares=(0.3, 1e-12),
            visible=(0.5, 0.5),
            note=note,
        )
        for kind, note in (("sweep", ""), ("payload", ""), ("multisine", "too fast"))
    ]
    with pytest.raises(
        NotIdentifiableError, match=r"distinguishes base_tilt from spring of joint 2.*tried: sweep, payload"
    ):
        require_separable(pair, aliases)
    require_separable(pair, [replace(judged, shares=(0.3, 0.1)) for judged in aliases])


def test_an_effect_that_changes_no_torque_says_what_would_show_it(two: Robot) -> None:
    """The zero of a vertical first axis shows on a tilted base alone, and the message says so."""
    with pytest.raises(NotIdentifiableError, match=r"does not change the torques.*second base pose"):
        discriminate(two, "encoder_offset:1,spring:1")


def test_unknown_dynamics_are_refused(two: Robot) -> None:
    """Without nominal dynamics nothing can be predicted: the first parameter that is not known is named."""
    with pytest.raises(InputError, match="is not known"):
        discriminate(replace(two, inertia=np.full((2, 10), np.nan)), PAIR)


def test_a_robot_too_weak_to_hold_itself_is_refused() -> None:
    """Where gravity alone passes the torque limit, no motion is proposed."""
    from tests.oed.campaigns.conftest import arm

    with pytest.raises(InfeasibleError, match="torque"):
        discriminate(arm(torque=np.full(2, 0.5)), PAIR)


@pytest.mark.slow
def test_page_works_in_a_browser(found: Discrimination, in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    in_browser(discrimination_page(found))


@pytest.mark.slow
def test_motions_meet_neither_the_robot_nor_the_floor() -> None:
    """All runs of an arm that could reach the floor are free, by pinocchio and coal on the capsules of its file."""
    robot = load_robot("er3a")
    found = discriminate(robot, "spring:2,base_tilt")
    assert is_free(found.freedom)
    assert "Do not play" not in found.conclusion
    model = collision_model(robot)
    for run in found.runs:
        assert CoalChecker(model).clearance(run.motion.q[::25]).min() > 0.0
