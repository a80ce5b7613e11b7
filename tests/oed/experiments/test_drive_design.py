"""Commands that determine drives, and the errors that they promise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.actuators_parts.plants import MACHINES, mjcf
from oed.experiments.drives import DriveDesign, DriveDesignOptions, design_drive_motion
from oed.reports.pages.drives.design_report import drive_design_page
from robots.collision import CoalChecker, Surroundings
from robots.common.errors import InputError
from robots.drives import Drive, DriveDynamics, HeldCommand, Start, described_drives, load_branches, simulate_drives
from robots.robot import Robot

LEG = MACHINES["leg"]()
OPTIONS = DriveDesignOptions(duration=5.0, segment=1.25, period=0.005, candidates=14, refinements=3)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> tuple[tuple[Robot, ...], tuple[Drive, ...]]:
    """A leg with its drives."""
    path = tmp_path_factory.mktemp("leg") / "leg.xml"
    path.write_text(mjcf(LEG))
    chains = load_branches(path)
    return chains, described_drives(chains).drives


@pytest.fixture(scope="module")
def design(leg: tuple[tuple[Robot, ...], tuple[Drive, ...]]) -> DriveDesign:
    """A motion of five seconds."""
    return design_drive_motion(*leg, options=OPTIONS)


def test_the_motion_stays_within_the_limits(
    leg: tuple[tuple[Robot, ...], tuple[Drive, ...]], design: DriveDesign
) -> None:
    """Commands begin and end at home, and positions stay within the description's range."""
    (chain,), drives = leg
    assert np.allclose(design.command[0], design.command[-1], atol=0.05)
    dynamics = DriveDynamics(chain, drives)
    held, start = HeldCommand(design.t, design.command), Start(design.command[0], np.zeros(3))
    q = simulate_drives(dynamics, held, design.t, start, dynamics.values).measured
    assert (q >= chain.limits.lower).all()
    assert (q <= chain.limits.upper).all()


def test_errors_are_those_of_refits(leg: tuple[tuple[Robot, ...], tuple[Drive, ...]], design: DriveDesign) -> None:
    """The promised standard error of a parameter is the scatter of linear refits of noisy motions, within a third."""
    (chain,), drives = leg
    dynamics = DriveDynamics(chain, drives)
    names = ["delay", "armature", "viscous", "coulomb", "torque_offset"]
    columns = [
        np.eye(dynamics.size)[dynamics.layout.of(name)].sum(axis=0)
        if name == "delay"
        else np.eye(dynamics.size)[dynamics.layout.place(j, name)]
        for name in names
        for j in range(1 if name == "delay" else 3)
    ]
    held, start = HeldCommand(design.t, design.command), Start(design.command[0], np.zeros(3))
    found = simulate_drives(dynamics, held, design.t, start, dynamics.values, directions=np.array(columns).T)
    assert found.sensitivity is not None
    J = found.sensitivity.reshape(-1, len(columns))
    noise = design.noise * np.random.default_rng(0).standard_normal((len(J), 60))
    scatter = np.linalg.lstsq(J, noise, rcond=None)[0].std(axis=1)
    promised = {(e.parameter, e.group): e.standard_error for e in design.expected}
    k = 1 + 3 * names[1:].index("coulomb")
    # The scatter of 60 draws is known to a tenth; a third is three and a half of these.
    assert scatter[k] == pytest.approx(promised["coulomb", "hip_joint"], rel=0.35)


def test_refinement_beats_a_chirp(leg: tuple[tuple[Robot, ...], tuple[Drive, ...]]) -> None:
    """Standard errors are smaller than those of a chirp of the same time, frequencies and limits, by a fifth at least.

    Constant offsets show alike in every motion.
    """
    options = replace(OPTIONS, segment=2.5, candidates=28, home=LEG.home, fastest=LEG.fastest)
    design = design_drive_motion(*leg, options=options)
    assert design.ratio < 0.8
    assert min(item.ratio for item in design.expected) < 0.7
    assert all(item.ratio < 1.1 for item in design.expected)


def test_a_colliding_pose_is_left(leg: tuple[tuple[Robot, ...], tuple[Drive, ...]], tmp_path: Path) -> None:
    """An arm whose usual home folds into its own base starts elsewhere, and its motion stays clear of itself."""
    path = tmp_path / "folded.xml"
    link = '<geom type="capsule" fromto="0 0 0 {0} 0 0" size="0.03"/>'
    bodies = "".join(
        f'<body name="l{k}" pos="{0.3 if k else 0} 0 0"><joint name="j{k}" axis="0 0 1" range="{low} {high}" '
        f'armature="0.05" damping="0.5" frictionloss="0.2"/>{link.format(0.3)}'
        for k, (low, high) in enumerate(((-3, 3), (-3.1, 3.1), (2.0, 3.1)))
    )
    actuators = "".join(f'<position joint="j{k}" kp="50" kv="3"/>' for k in range(3))
    path.write_text(
        f'<mujoco><compiler angle="radian"/><worldbody><body name="base"><geom size="0.04"/>{bodies}'
        f"{'</body>' * 4}</worldbody><actuator>{actuators}</actuator></mujoco>"
    )
    chains = load_branches(path)
    options = DriveDesignOptions(duration=2.5, segment=1.25, period=0.005, candidates=14, refinements=1)
    motion = design_drive_motion(chains, described_drives(chains).drives, options=options)
    assert not motion.collides
    dynamics = DriveDynamics(chains[0], described_drives(chains).drives)
    held, start = HeldCommand(motion.t, motion.command), Start(motion.command[0], np.zeros(3))
    q = simulate_drives(dynamics, held, motion.t, start, dynamics.values).measured
    assert CoalChecker(Surroundings().model(chains[0])).clearance(q[::10]).min(initial=np.inf) > 0


def test_a_design_survives_its_files(design: DriveDesign, tmp_path: Path) -> None:
    """Commands and expected errors read back as they were written, and the page shows them."""
    design.save(tmp_path)
    again = DriveDesign.load(tmp_path)
    assert again.summary() == design.summary()
    assert np.array_equal(again.command, design.command)
    assert len(drive_design_page(design).sections[1].tables[0].rows) == len(design.expected)


def test_wrong_options_are_named(leg: tuple[tuple[Robot, ...], tuple[Drive, ...]]) -> None:
    """A home outside of the limits, and times that do not fit, are refused."""
    with pytest.raises(InputError, match="the home is outside of the limits"):
        design_drive_motion(*leg, options=DriveDesignOptions(home=(0.0, 0.8, 0.0)))
    with pytest.raises(InputError, match="duration -1"):
        DriveDesignOptions(duration=-1.0)


def test_the_files_say_what_was_checked_for_collisions(
    leg: tuple[tuple[Robot, ...], tuple[Drive, ...]], design: DriveDesign, tmp_path: Path
) -> None:
    """Summary, design.json and the head of the commands state the check; the capsules are judged by coal besides."""
    (chain,), drives = leg
    dynamics = DriveDynamics(chain, drives)
    held, start = HeldCommand(design.t, design.command), Start(design.command[0], np.zeros(3))
    q = simulate_drives(dynamics, held, design.t, start, dynamics.values).measured
    closest = CoalChecker(Surroundings().model(chain)).clearance(q[::20]).min(initial=np.inf)
    assert design.collisions.startswith("COLLIDES") == (closest < 0.0)
    assert design.collisions in design.summary()
    design.save(tmp_path)
    assert design.collisions in (tmp_path / "commands.csv").read_text().replace("\n# ", "")
    assert DriveDesign.load(tmp_path).collisions == design.collisions
