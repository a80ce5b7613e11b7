"""Designs whose torque, clearance, prior knowledge or task is what decides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import oed
from oed.criteria import Prior
from oed.experiments import Effort, InteriorPoint, LimitOptions
from oed.experiments.safety_checks.safety import choose_safety
from robots.base_parameters import find_base_parameters
from robots.collision import check_motion, collision_model
from robots.common.errors import InfeasibleError, InputError
from robots.loading import load_robot
from robots.regressor import default_model
from robots.signals import Motion
from tests.oed import flat

TINY = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100)
BRIEF = InteriorPoint(max_iter=25, finish_iter=15)


def design(robot, **options):
    trajectory = {"strokes": False, "periods": 1}
    settings = {"friction": "coulomb-viscous", "effort": TINY, "solver": BRIEF, "workers": 1, **trajectory}
    return flat.design(robot, **{**settings, **options})


@pytest.fixture(scope="module")
def er3a():
    return load_robot("er3a")


@pytest.fixture(scope="module")
def free_design(er3a):
    """A design without any choice, not even that of collisions."""
    return design(er3a, collision=False)


def weaker(robot, share):
    return replace(robot, limits=replace(robot.limits, torque=np.asarray(robot.limits.torque) * share))


def pinocchio_torque(robot, motion):
    """Torque (N, n) of the description's links, rotors and friction, by pinocchio and closed forms."""
    model, parent = pin.Model(), 0
    for joint, row in zip(robot.chain.joints, robot.inertia, strict=True):
        placement = pin.SE3(np.array(joint.rotation), np.array(joint.translation))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(np.array(joint.axis)), placement, joint.name)
        order = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # pinocchio lists Iyy before Ixz
        model.appendBodyToJoint(parent, pin.Inertia.FromDynamicParameters(row[order]), pin.SE3.Identity())
    data = model.createData()
    states = zip(motion.q, motion.dq, motion.ddq, strict=True)
    rigid = np.array([pin.rnea(model, data, *state) for state in states])
    friction = robot.friction[:, 0] * np.tanh(motion.dq / 0.02) + robot.friction[:, 1] * motion.dq
    return rigid + friction + robot.rotor_inertia * motion.ddq


@pytest.mark.slow
def test_the_torque_limit_decides(er3a):
    """Where the free design would pass the torque limit, the limited one stays below 90 % of it, by pinocchio."""
    weak = weaker(er3a, 0.35)
    free = design(weak, torque=False)
    kept = design(weak)
    bound = np.asarray(weak.limits.torque)
    used = np.abs(pinocchio_torque(weak, free.part("fourier"))).max(axis=0) / bound
    assert used.max() > 0.95
    tight = np.abs(pinocchio_torque(weak, kept.motion)).max(axis=0) / bound
    # 10 % are kept for what the description is wrong by; the samples of the solver are not those of the file
    assert 0.8 < tight.max() < 0.905
    assert not kept.violated


@pytest.mark.slow
@pytest.mark.longer
def test_the_rms_torque_decides(er3a):
    """Where the free design is too hard on a motor in the mean, the limited one is not, by pinocchio."""
    free = design(er3a, periods=3)
    hot = np.sqrt(np.square(pinocchio_torque(er3a, free.part("fourier"))).mean(axis=0))
    bound = np.full(6, np.inf)
    bound[0] = hot[0]
    kept = design(replace(er3a, limits=replace(er3a.limits, torque_rms=bound)), periods=3)
    warm = np.sqrt(np.square(pinocchio_torque(er3a, kept.motion)).mean(axis=0))[0]
    # 10 % of the limit are kept; the moves to and from the optimised part are in the mean, too.
    assert 0.8 * bound[0] < warm <= 0.9 * bound[0] * 1.0001
    (margin,) = [m for m in kept.margins if m.quantity == "torque RMS" and m.joint == 1]
    assert margin.value == pytest.approx(warm, rel=1e-6)
    assert kept.success


@pytest.mark.slow
def test_an_rms_limit_below_gravity_is_reported_first(er3a):
    """A joint whose motor cannot hold the home pose for long is named, with the limit that would do."""
    bound = np.full(6, np.inf)
    bound[1] = 1.0
    with pytest.raises(InfeasibleError, match=r"joint 2: holding the pose takes .* RMS torque .* or more"):
        design(replace(er3a, limits=replace(er3a.limits, torque_rms=bound)))


def test_a_limit_below_gravity_is_reported_first(er3a):
    """A joint that cannot hold the home pose is named, with the torque that would do, before any search."""
    with pytest.raises(InfeasibleError, match=r"joint \d: holding the pose takes .* or more"):
        design(weaker(er3a, 0.05), home=np.zeros(6))


def test_another_home_is_taken_where_the_usual_one_cannot_be_held(er3a):
    """Without a stated home the experiment starts where the motors can hold the arm, by pinocchio, and says so."""
    weak = weaker(er3a, 0.12)
    with pytest.raises(InfeasibleError, match="holding the pose takes"):
        design(weak, home=np.zeros(6))
    robot, base = weak, find_base_parameters(default_model(weak))
    found = choose_safety(robot, base, np.zeros(6), LimitOptions(), movable=True)
    assert found.moved
    still = Motion(np.array([0.0, 1.0]), *(np.tile(x, (2, 1)) for x in (found.home, np.zeros(6), np.zeros(6))))
    assert (np.abs(pinocchio_torque(er3a, still)[0]) < 0.9 * np.asarray(weak.limits.torque)).all()


@pytest.mark.slow
def test_clearance_decides_and_is_proved(er3a, free_design):
    """A design that watches collisions keeps its clearance at all times; without, the same seed collides."""
    model = collision_model(er3a)
    assert check_motion(model, free_design.motion, confirm=False).collides
    kept = design(er3a)
    report = check_motion(model, kept.motion)
    assert report.certified
    assert report.confirmed
    assert kept.freedom is not None
    assert kept.freedom["certified"]
    assert "proved at all times" in kept.summary()
    assert kept.success


@pytest.mark.slow
@pytest.mark.longer
def test_strokes_that_would_collide_are_left_out_or_free():
    """With strokes the whole experiment is still free; joints without a stroke are named."""
    robot = load_robot("panda")
    kept = design(robot, collision=True, strokes=True)
    assert check_motion(collision_model(robot), kept.motion, confirm=False).certified
    stroked = {segment["joint"] for segment in kept.segments if segment["kind"] == "sinusoid"}
    assert stroked | set(kept.strokes_left_out) == set(range(1, 8))
    assert stroked.isdisjoint(kept.strokes_left_out)


@pytest.mark.slow
def test_a_home_in_collision_is_refused(er3a, free_design):
    """A start pose that the user states and that collides is reported with the pair and the depth."""
    motion = free_design.motion
    report = check_motion(collision_model(er3a), motion, confirm=False)
    home = motion.q[np.argmin(np.abs(motion.t - report.time[report.worst]))]
    with pytest.raises(InfeasibleError, match="mm"):
        design(er3a, collision=True, home=home)


@pytest.mark.slow
def test_a_second_experiment_adds_what_the_first_lacks(er3a):
    """After a model that knows all but one joint's friction, D-optimality gains more from that joint's motion."""
    first = design(er3a, criterion="d")
    names = first.base.names
    known = np.diag(np.where([name in ("f1_6", "f2_6") for name in names], 1e6, 1e-6))
    prior = Prior(names=names, covariance=known, noise=np.ones(6))
    second = design(er3a, criterion="d", after=prior)
    part = second.qualities[1]
    assert "after an earlier model" in part.part
    assert part.value("d") > first.optimised.value("d")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scaling": "odd"}, "none, nominal, unit"),
        ({"noise": [1.0, 2.0]}, "6 positive numbers"),
        ({"noise": [1.0, 1.0, 1.0, 1.0, 1.0, 0.0]}, "6 positive numbers"),
        ({"criterion": "i"}, "needs a task"),
        ({"torque_margin": 1.0}, "0 to below 1"),
    ],
)
def test_options_out_of_range_are_refused(er3a, options, message):
    """Each wrong option is reported with what is allowed."""
    with pytest.raises(InputError, match=message):
        design(er3a, **options)


@pytest.mark.slow
@pytest.mark.parametrize("scaling", ["nominal", "unit"])
def test_scaling_is_reported_beside_the_plain_numbers(er3a, scaling):
    """A scaled design says both: the plain regressor's numbers and those that it was optimised for."""
    made = design(er3a, scaling=scaling, noise=[1.0, 1.0, 1.0, 0.5, 0.5, 0.5])
    assert made.qualities[1].part == f"fourier (columns by {scaling}, rows by noise)"
    assert made.qualities[1].value("cond") != pytest.approx(made.optimised.value("cond"))
    assert made.islands[0].final == pytest.approx(made.qualities[1].value("cond"), rel=1e-6)


@pytest.mark.slow
def test_essential_parameters_only(er3a, free_design, tmp_path):
    """With a share stated, columns whose torque is below it are left out, and what is left is easier to separate."""
    whole, part = free_design, design(er3a, essential=0.02)
    assert set(part.base.names) < set(whole.base.names)
    assert part.optimised.value("cond") < whole.optimised.value("cond")
    # By the description itself: each column left out is below the share of every joint's torque on the design.
    motion, nominal = whole.part("fourier"), whole.base.from_standard(whole.base.model.nominal)
    own = whole.base.regressor(motion.q, motion.dq, motion.ddq) * nominal
    share = np.sqrt(np.square(own).mean(axis=0)) / np.sqrt(np.square(own.sum(axis=2)).mean(axis=0))[:, None]
    for name, most in zip(whole.base.names, share.max(axis=0), strict=True):
        # The shares that decide are those on random motions: a factor of two between them and this one.
        assert most < 0.04 or name in part.base.names
    part.save(tmp_path)
    assert oed.Design.load(tmp_path).to_dict() == part.to_dict()


@pytest.mark.parametrize("share", [-0.1, 1.0])
def test_essential_share_out_of_range(er3a, share):
    """A share that is none is refused."""
    with pytest.raises(InputError, match="0 to below 1"):
        design(er3a, essential=share)
