"""The independent plant shares no code with the packages under test, and its logs obey mechanics."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from oed.benchmarks.truth.cases import Hidden, draw_case
from oed.benchmarks.truth.description import urdf_of, write_description
from oed.benchmarks.truth.dynamics import rigid_torque
from oed.benchmarks.truth.effects import KNOWN, UNLISTED
from oed.benchmarks.truth.effects.friction import LoadDependent, LuGre, Stribeck, _bristles
from oed.benchmarks.truth.effects.surroundings import Payload
from oed.benchmarks.truth.effects.transmission import Backlash, Balancer, Elastic
from oed.benchmarks.truth.effects.unlisted_joint_effects import CrossWave
from oed.benchmarks.truth.experiments import KnownChange, Stage
from oed.benchmarks.truth.kinds import KINDS
from oed.benchmarks.truth.machines import draw_machine
from oed.benchmarks.truth.oracle import ask_oracle
from oed.benchmarks.truth.plant import measure, open_loop
from oed.benchmarks.truth.references import draw_aperiodic, draw_moves, draw_periodic

ALLOWED = {"numpy", "scipy", "pinocchio", "oed"} | set(sys.stdlib_module_names)


def test_imports_numpy_scipy_and_pinocchio_alone() -> None:
    """Files of the plant import only numpy, scipy, pinocchio and each other."""
    files = list(Path(draw_case.__code__.co_filename).parent.rglob("*.py"))
    assert len(files) > 10
    for path in files:
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, path
                names = [node.module or ""]
            for name in names:
                assert name.split(".")[0] in ALLOWED, f"{path.name} imports {name}"
                assert not name.startswith("oed") or name.startswith("oed.benchmarks.truth"), f"{path.name}: {name}"


@pytest.mark.parametrize("kind", KINDS)
def test_description_is_the_known_robot_and_not_the_true_one(kind: str, tmp_path: Path) -> None:
    """The user's URDF has the robot's described dynamics, which differ from the true dynamics."""
    machine = draw_machine(kind, np.random.default_rng(1))
    write_description(machine, tmp_path)
    read = pin.buildModelFromXML(urdf_of(machine.known, kind))
    rng = np.random.default_rng(2)
    q, v, a = rng.normal(size=(3, 20, machine.n))
    reported = rigid_torque(read, q, v, a)
    # The file holds 9 to 12 digits.
    np.testing.assert_allclose(
        reported, rigid_torque(machine.known, q, v, a), rtol=1e-6, atol=1e-6 * np.abs(reported).max()
    )
    off = rigid_torque(machine.model, q, v, a) - reported
    assert 0.005 < np.sqrt((off**2).mean() / (reported**2).mean()) < 0.15


@pytest.mark.parametrize("draw", [draw_periodic, draw_aperiodic, draw_moves])
def test_references_are_smooth_and_within_limits(draw: object) -> None:
    """Velocity and acceleration of a reference are its derivatives, and it stays within the robot's limits."""
    machine = draw_machine("er3a", np.random.default_rng(3))
    reference = draw(machine, np.random.default_rng(4))
    t = np.arange(5.0, 15.0, 1e-3)
    q, v, a = reference.at(t)
    # The error of central differences is h^2/6 times the third derivative, which is below 1e3 here.
    np.testing.assert_allclose(np.gradient(q, t, axis=0)[1:-1], v[1:-1], atol=1e-3)
    # The jerk jumps by some 50 rad/s3 where a move begins or ends; the error is this times half a step.
    np.testing.assert_allclose(np.gradient(v, t, axis=0)[1:-1], a[1:-1], atol=5e-2 if draw is draw_moves else 1e-2)
    assert (np.abs(v) < machine.speed).all()
    assert (q > machine.lower - 0.1).all()
    assert (q < machine.upper + 0.1).all()


@pytest.mark.slow
def test_log_obeys_inverse_dynamics() -> None:
    """Without effects and noise the logged torque is the true robot's inverse dynamics."""
    case = draw_case(1, kind="er3a", periodic=False, duration=10.0, unseen=0.0)
    record, machine = case.logs[0], case.machine
    wanted = rigid_torque(machine.model, record.q_true, record.v_true, record.a_true) + machine.rotor * record.a_true
    friction = machine.friction
    v = record.v_true
    wanted += friction[:, 0] * record.sign + friction[:, 1] * v + friction[:, 2] * v * np.abs(v) + friction[:, 3] * v**3
    np.testing.assert_allclose(record.clean, wanted + machine.offset, rtol=1e-9, atol=1e-9)
    # The logged position is only quantised.
    assert np.abs(record.q - record.q_true).max() <= 1.01 * np.pi / case.noise.counts.min()
    # The velocity is the position's derivative to second order of the control step, except at jumps of friction.
    numeric = np.gradient(record.q_true, record.t, axis=0)
    assert np.median(np.abs(numeric - record.v_true)) < 1e-3 * np.abs(record.v_true).max()


@pytest.mark.slow
def test_size_is_what_shows_beyond_the_base_model() -> None:
    """An effect with a size of 1 % leaves 1 % of its joint's torque after a least-squares fit of the base model."""
    case = draw_case(7, hide=[Stribeck], size=0.01, kind="ur10", periodic=True, duration=20.0, unseen=0.0)
    assert case.visible()[0] == pytest.approx(0.01, rel=0.1)
    # It is larger before the fit, because the base model absorbs part of it.
    effect = case.effects[0]
    whole = np.sqrt((case.logs[0].parts[0][:, effect.j] ** 2).mean()) / case.level()[effect.j]
    assert whole > 0.012


@pytest.mark.slow
def test_every_effect_changes_the_log_and_is_reproducible() -> None:
    """Every effect can be drawn and adds torque, and the same seed gives the same log."""
    machine = draw_machine("panda", np.random.default_rng(5))
    reference = draw_periodic(machine, np.random.default_rng(6), cycles=2)
    for choice in (*KNOWN, *UNLISTED):
        joints = choice.joints(machine)
        effect = choice.draw(machine, np.random.default_rng(8), joints[-1], 10.0)
        effect = effect.of(min(effect.largest / 4, 1.0))
        ride = open_loop(machine, [reference], [effect], step=0.01)
        assert np.isfinite(ride.parts[0]).all(), choice
        assert np.abs(ride.parts[0]).max() > 0.0, choice
    first, second = (draw_case(11, hide=1, kind="er3a", duration=10.0, unseen=0.0) for _ in range(2))
    np.testing.assert_array_equal(first.logs[0].tau, second.logs[0].tau)


@pytest.mark.slow
def test_too_large_a_size_is_refused() -> None:
    """A size that no plausible value reaches raises `Hidden`."""
    with pytest.raises(Hidden):
        draw_case(2, hide=[Elastic], size=0.5, kind="er3a", periodic=True, duration=20.0, unseen=0.0)


@pytest.mark.slow
def test_elastic_gear_obeys_both_inertias() -> None:
    """The link of an elastic joint agrees with an independent integration behind the motor's logged motion."""
    machine = draw_machine("heavy", np.random.default_rng(9))
    reference = draw_periodic(machine, np.random.default_rng(10))
    effect = Elastic(joint=6, amount=1e-5)
    ride = open_loop(machine, [reference], [effect], step=0.001)
    rows = slice(2000, 2600)
    t, motor = ride.t[rows], ride.q[rows, 5]

    def link(time: float, state: np.ndarray) -> list[float]:
        q, v, a = (np.array([np.interp(time, t, x[rows, j]) for j in range(6)]) for x in _link(ride))
        q[5], v[5] = state
        through = (np.interp(time, t, motor) - state[0]) / effect.amount
        a[5] = 0.0
        data = machine.model.createData()
        still = pin.rnea(machine.model, data, q, v, a)[5]
        inertia = pin.crba(machine.model, data, q)[5, 5]
        return [state[1], (through - still) / inertia]

    start = [ride.link_q[2000, 5], ride.link_v[2000, 5]]
    # A step of 0.2 ms is a tenth of the shortest period of vibration over 2 pi.
    solved = solve_ivp(link, (t[0], t[-1]), start, max_step=2e-4, t_eval=t[::50])
    twist = np.abs(ride.link_q[:, 5] - ride.q[:, 5]).max()
    # Linear interpolation of the motor's motion excites the undamped spring by a fraction of the deflection.
    assert np.abs(solved.y[0] - ride.link_q[rows, 5][::50]).max() < 0.03 * twist


@pytest.mark.slow
def test_a_loose_link_flies_lands_and_settles() -> None:
    """The link of a joint with backlash agrees with an integration of its full equation of motion on damped teeth."""
    machine = draw_machine("heavy", np.random.default_rng(9))
    reference = draw_periodic(machine, np.random.default_rng(10))
    effect = Backlash(joint=5, amount=1e-3, swing=30.0, damping=0.4)
    ride = open_loop(machine, [reference], [effect], step=0.001)
    behind = ride.q[:, 4] - ride.link_q[:, 4]
    leaves = np.flatnonzero(np.diff(np.abs(behind) < 0.5e-3 * (1 - 1e-9)) > 0) + 1
    first = int(leaves[0]) - 1
    rows = slice(first, first + 250)
    t, data = ride.t[rows], machine.model.createData()
    inertia = pin.crba(machine.model, data, ride.q[first])[4, 4]
    stiff, damp = inertia * (2 * np.pi * 30.0) ** 2, 2 * 0.4 * inertia * 2 * np.pi * 30.0

    def link(time: float, state: np.ndarray) -> list[float]:
        q, v, a = (np.array([np.interp(time, t, x[rows, j]) for j in range(6)]) for x in (ride.q, ride.v, ride.a))
        motor, rate = q[4], v[4]
        q[4], v[4], a[4] = state[0], state[1], 0.0
        ahead = motor - state[0]
        deep = np.sign(ahead) * max(abs(ahead) - 0.5e-3, 0.0)
        push = stiff * deep + damp * (rate - state[1]) if deep else 0.0
        through = push if push * deep > 0 else 0.0
        still = pin.rnea(machine.model, data, q, v, a)[4]
        return [state[1], (through - still) / pin.crba(machine.model, data, q)[4, 4]]

    start = [ride.q[first, 4] - behind[first], ride.v[first, 4]]
    solved = solve_ivp(link, (t[0], t[-1]), start, max_step=5e-4, t_eval=t)
    off = solved.y[0] - ride.link_q[rows, 4]
    assert np.ptp(behind[rows]) > 0.9e-3, "the link does not cross"
    # The plant uses the inertia at the pose in which the link leaves its flank.
    assert np.abs(off).max() < 0.05 * 1e-3


@pytest.mark.slow
def test_two_effects_that_part_links_act_once() -> None:
    """With an elastic gear and backlash the parts of both add up to the torque difference by the link's motion."""
    machine = draw_machine("heavy", np.random.default_rng(9))
    reference = draw_periodic(machine, np.random.default_rng(10))
    both = [Elastic(joint=4, amount=1e-5), Backlash(joint=4, amount=1e-3)]
    ride = open_loop(machine, [reference], both, step=0.004)
    needed = rigid_torque(machine.model, *_link(ride)) - rigid_torque(machine.model, ride.q, ride.v, ride.a)
    np.testing.assert_allclose(sum(ride.parts), needed, atol=1e-9 * np.abs(needed).max())
    spring = open_loop(machine, [reference], both[:1], step=0.004).parts[0]
    np.testing.assert_allclose(ride.parts[0], spring, atol=1e-9 * np.abs(needed).max())


def _link(ride: object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return ride.link_q, ride.link_v, ride.link_a


def test_bristles_follow_their_equation() -> None:
    """The presliding state agrees with an adaptive integration of z' = v - |v| z / reach."""
    t = np.arange(0.0, 2.0, 1e-3)
    v = 0.2 * np.cos(2 * np.pi * t)
    reach = 5e-3
    solved = solve_ivp(
        lambda time, z: 0.2 * np.cos(2 * np.pi * time) * np.ones(1) - abs(0.2 * np.cos(2 * np.pi * time)) * z / reach,
        (0.0, t[-1]),
        [reach],
        t_eval=t,
        rtol=1e-8,
        atol=1e-12,
    )
    # The error of four sub-steps of 0.25 ms is of first order in v.
    assert np.abs(_bristles(v, 1e-3, reach) - solved.y[0] / reach).max() < 0.01


def test_payload_acts_on_all_joints_from_its_moment() -> None:
    """A payload's torque is zero before it is picked up, and that of a heavier last link afterwards."""
    machine = draw_machine("ur10", np.random.default_rng(12))
    reference = draw_periodic(machine, np.random.default_rng(13), cycles=1)
    ride = open_loop(machine, [reference], [Payload(amount=3.0, moment=4.0)], step=0.01)
    torque = ride.parts[0]
    assert np.abs(torque[ride.t < 4.0]).max() == 0.0
    heavier = pin.Model(machine.model)
    tool = pin.Inertia.FromBox(3.0, 0.1, 0.1, 0.1)
    tool.lever = np.array([0.0, 0.0, 0.1])
    heavier.inertias[6] += tool
    after = ride.t > 4.1
    wanted = rigid_torque(heavier, ride.q[after], ride.v[after], ride.a[after]) - ride.rigid[after]
    np.testing.assert_allclose(torque[after], wanted, atol=1e-9)


def test_gears_feel_what_a_user_changes() -> None:
    """The load of a tilted base and a payload acts on load-dependent friction and on an elastic gear."""
    machine = draw_machine("ur10", np.random.default_rng(12))
    reference = draw_periodic(machine, np.random.default_rng(13), cycles=1)
    stage = Stage(t=np.zeros(1), q=np.zeros((1, 6)), payload=5.0, gravity=np.array([3.0, 0.0, -9.3]))
    change = KnownChange(stage=stage, start=2.0, end=8.0, turn=np.eye(3))
    lossy = LoadDependent(joint=1, amount=0.1, back=1.0)
    ride, plain = (open_loop(machine, [reference], effects, step=0.01) for effects in ([lossy, change], [lossy]))
    added = change.torque(ride)[:, 0]
    wanted = 0.1 * np.abs(ride.rigid[:, 0] + added) * ride.sign[:, 0]
    np.testing.assert_allclose(ride.parts[0][:, 0], wanted, atol=1e-12)
    # Gravity does not load a vertical first joint unless the base is tilted.
    assert np.abs(ride.parts[0]).max() > 1.5 * np.abs(plain.parts[0]).max()
    before = ride.t < 2.0
    np.testing.assert_allclose(ride.parts[0][before], plain.parts[0][before], atol=1e-12)
    twists = []
    for effects in ([change], []):
        ride = open_loop(machine, [reference], [Elastic(joint=2, amount=1e-5), *effects], step=0.01)
        twists.append((ride.q - ride.link_q)[:, 1])
    middle = (ride.t > 2.5) & (ride.t < 7.5)
    np.testing.assert_allclose(
        (twists[0] - twists[1])[middle], 1e-5 * change.torque(ride)[middle, 1], rtol=0.01, atol=1e-6
    )


def test_gears_bear_a_spring() -> None:
    """The load of load-dependent friction includes the torque of a spring behind the gear."""
    machine = draw_machine("er3a", np.random.default_rng(14))
    reference = draw_periodic(machine, np.random.default_rng(15), cycles=1)
    lossy, spring = LoadDependent(joint=2, amount=0.1, back=1.0), Balancer(joint=2, amount=2e4)
    ride = open_loop(machine, [reference], [lossy, spring], step=0.01)
    pull = spring.torque(ride)[:, 1]
    assert np.std(pull) > 0.1 * np.std(ride.rigid[:, 1])
    np.testing.assert_allclose(ride.parts[0][:, 1], 0.1 * np.abs(ride.rigid[:, 1] + pull) * ride.sign[:, 1], atol=1e-12)


@pytest.mark.slow
def test_a_stranger_shows_beyond_the_base_model_and_its_own_column_brings_a_gain() -> None:
    """An effect outside the catalogue has the wanted visible size, and its true column improves held-out prediction."""
    case = draw_case(17, hide=[CrossWave], size=0.03, kind="er3a", periodic=True, duration=20.0, unseen=20.0)
    assert case.visible()[0] == pytest.approx(0.03, rel=0.15)
    reported = ask_oracle(case, logged=True)
    # 3 % squared is 9e-4 in the logs. Another motion shows more or less, and 20 s of noise change it by 1e-4.
    gain = ((reported.before - reported.after) / case.level() ** 2)[case.effects[0].j]
    assert 3e-4 < gain < 5e-3
    # A function of joint positions is known as well from the encoders.
    assert reported.as_measured is not None
    assert ((reported.before - reported.as_measured) / case.level() ** 2)[case.effects[0].j] == pytest.approx(
        gain, rel=0.05
    )


def test_presliding_starts_where_it_slips() -> None:
    """In steady sliding LuGre friction equals Coulomb friction."""
    machine = draw_machine("er3a", np.random.default_rng(16))
    reference = draw_periodic(machine, np.random.default_rng(17), cycles=1)
    ride = open_loop(machine, [reference], [LuGre(joint=1, amount=1e-3, damping=0.0)], step=0.001)
    measure(ride, [LuGre(joint=1, amount=1e-3, damping=0.0)])
    fast = np.abs(ride.v[:, 0]) > 0.7 * np.abs(ride.v[:, 0]).max()
    coulomb = machine.friction[0, 0]
    # Ten presliding travels after a reversal, a fraction e^-10 of the difference is left.
    assert np.abs(ride.parts[0][fast, 0]).max() < 1e-4 * coulomb
