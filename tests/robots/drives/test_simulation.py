"""The simulated loop of drives against MuJoCo, and its sensitivities against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.actuators_parts.plants import MACHINES, Truth, mjcf, multisine, play, random_truth
from robots.common.errors import InputError, SolverError
from robots.drives import (
    LAWS,
    CascadeLaw,
    Drive,
    DriveDynamics,
    HeldCommand,
    PdLaw,
    ServoLaw,
    Start,
    VelocityLaw,
    simulate_drives,
)
from robots.drives.branches import load_branches
from robots.robot import Robot

LEG = replace(MACHINES["leg"](), encoder=1e-12)


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A leg of three joints, from an MJCF."""
    path = tmp_path_factory.mktemp("leg") / "leg.xml"
    path.write_text(mjcf(LEG))
    return load_branches(path)[0]


def drives_of(truth: Truth) -> list[Drive]:
    """The drives of a plant as it is."""
    return [
        Drive.usual(
            PdLaw(),
            values={
                "kp": LEG.kp[j],
                "kd": LEG.kd[j],
                "armature": truth.armature[j],
                "viscous": truth.viscous[j],
                "coulomb": truth.coulomb[j],
                "delay": truth.delay,
                "torque_limit": LEG.limit[j],
            },
        )
        for j in range(LEG.n)
    ]


@pytest.mark.slow
def test_the_motion_is_mujocos(leg: Robot) -> None:
    """With stick friction and a delay the motion is MuJoCo's to 0.03 mrad, which its own soft friction leaves open."""
    rng = np.random.default_rng(3)
    truth = random_truth(LEG, rng)
    t, command = multisine(LEG, 2.0, rng)
    measured = play(LEG, truth, t, command)
    dynamics = DriveDynamics(leg, drives_of(truth))
    found = simulate_drives(dynamics, HeldCommand(t, command), t, Start(command[0], np.zeros(3)), dynamics.values)
    # The first half second is MuJoCo's settling under gravity.
    assert np.sqrt(np.mean((found.measured - measured)[500:] ** 2, axis=0)).max() < 3e-5


@pytest.mark.slow
@pytest.mark.parametrize("law", [PdLaw(), CascadeLaw()], ids=lambda law: law.name)
def test_sensitivities_are_derivatives(leg: Robot, law: PdLaw) -> None:
    """Derivatives by all kinds of parameters agree with central differences to 2 % of the largest."""
    values = {"coulomb": 0.3, "stribeck": 0.2, "load_coulomb": 0.1, "armature": 0.02, "viscous": 0.1, "delay": 0.0043}
    values |= {"kp": 20.0, "kd": 1.0} if law.name == "pd" else {"kr": 20.0, "kv": 1.5, "ki": 3.0}
    dynamics = DriveDynamics(leg, [Drive.usual(law, values=values)] * 3)
    t, command = multisine(LEG, 1.5, np.random.default_rng(0), 0.002)
    held, start = HeldCommand(t, command), Start(command[0], np.zeros(3))
    steps = {"armature": 1e-5, "viscous": 1e-4, "coulomb": 1e-4, "load_coulomb": 1e-4, "mass_factor": 1e-4}
    steps |= {"encoder_zero": 1e-5, "torque_offset": 1e-4, "friction_sine": 1e-4}
    steps |= {"kp": 1e-3} if law.name == "pd" else {"kr": 1e-3, "kv": 1e-4, "ki": 1e-3}
    for name, step in steps.items():
        direction = np.zeros((dynamics.size, 1))
        direction[dynamics.layout.of(name)] = 1.0
        found = simulate_drives(dynamics, held, t, start, dynamics.values, directions=direction)
        there, back = (
            simulate_drives(dynamics, held, t, start, dynamics.values + sign * step * direction[:, 0]).measured
            for sign in (1, -1)
        )
        difference = (there - back) / (2 * step)
        assert found.sensitivity is not None
        # Where a joint starts to slip, the difference of two motions has a spike that a derivative has not; and a step
        # is solved in two passes, which leave a per cent of what changes within it.
        error = np.quantile(np.abs(found.sensitivity[:, :, 0] - difference), 0.95)
        assert error < 0.02 * np.abs(difference).max(), name


def test_a_held_command_keeps_its_integral() -> None:
    """The means over steps of a delayed command add up to its integral, wherever its edges fall."""
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 1, 40))
    command = rng.normal(size=(40, 2))
    edges = np.linspace(0.2, 0.9, 301)
    means, _ = HeldCommand(t, command).means(edges, np.array([0.013, 0.1]))
    fine = np.linspace(0.2, 0.9, 2_000_001)
    for j, delay in enumerate((0.013, 0.1)):
        held = command[np.clip(np.searchsorted(t, fine - delay, side="right") - 1, 0, 39), j]
        # Sampling errs by a step at each of the forty edges.
        assert means[:, j] @ np.diff(edges) == pytest.approx(held[:-1].sum() * np.diff(fine)[0], abs=1e-4)


def test_a_command_of_a_servo_has_steps() -> None:
    """A servo's command is rounded to its resolution."""
    t = np.arange(5.0)
    command = np.array([[0.0], [0.06], [0.14], [0.16], [0.26]])
    held = HeldCommand(t, command, np.array([ServoLaw(0.1).steps()]))
    assert held.command[:, 0] == pytest.approx([0.0, 0.1, 0.1, 0.2, 0.3])


def test_a_joint_sticks_below_its_friction(leg: Robot) -> None:
    """A joint that gravity and its drive load less than its dry friction stays where it is."""
    drives = [Drive.usual(PdLaw(), values={"kp": 20.0, "kd": 1.0, "coulomb": 50.0})] * 3
    dynamics = DriveDynamics(leg, drives)
    t = np.arange(0, 2.0, 0.002)
    command = np.tile(LEG.home, (len(t), 1)) + 0.1
    start = Start(np.array(LEG.home), np.zeros(3))
    found = simulate_drives(dynamics, HeldCommand(t, command), t, start, dynamics.values)
    # Friction fades below 0.1 mrad/s, so a joint creeps by a part of that.
    assert np.abs(found.measured - start.measured).max() < 1e-4


def test_an_unstable_loop_is_refused(leg: Robot) -> None:
    """A loop that a delay makes unstable ends with an error that says so."""
    values = {"kp": 200.0, "kd": 0.0, "delay": 0.0}
    dynamics = DriveDynamics(leg, [Drive.usual(PdLaw(), values=values)] * 3)
    t = np.arange(0, 1.0, 0.002)
    start = Start(np.full(3, np.nan), np.zeros(3))
    with pytest.raises(SolverError, match="not stable"):
        simulate_drives(dynamics, HeldCommand(t, np.zeros((len(t), 3))), t, start, dynamics.values)


def test_wrong_values_are_refused() -> None:
    """A parameter of no member and a value that is not possible are named."""
    with pytest.raises(InputError, match=r"drive parameter 'kq'.*kp, kd"):
        Drive.usual(PdLaw(), values={"kq": 1.0})
    with pytest.raises(InputError, match=r"coulomb -1 N m; allowed: 0 to inf"):
        Drive.usual(PdLaw(), values={"coulomb": -1.0})


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_all_laws_have_described_parameters(law: type[PdLaw | VelocityLaw]) -> None:
    """Each law states unit, default and bounds of its parameters, and a drive takes the defaults."""
    drive = Drive.usual(law())
    for parameter in law().parameters():
        assert parameter.unit
        assert parameter.lower <= drive.values[parameter.name] <= parameter.upper
