"""Each limit where it is the one that decides: left out, the same design passes it; kept, the design uses it up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oed.constraints.geometric import GeometricLimit
from oed.constraints.singularity import SingularityLimit
from oed.constraints.tool import PlaneLimit, ToolBox
from oed.experiments import Design, Effort, InteriorPoint
from robots.common.errors import InfeasibleError
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed import flat

EFFORT = Effort(islands=1, starts=1, screened=20, hops=0, finish_samples=60)
SOLVER = InteriorPoint(max_iter=40, finish_iter=15)


def design(robot: Robot, **options: object) -> Design:
    settings = {
        "friction": "coulomb-viscous",
        "harmonics": 3,
        "periods": 1,
        "effort": EFFORT,
        "solver": SOLVER,
        "strokes": False,
        "velocity_fraction": 1.0,
        "workers": 1,
    }
    return flat.design(robot, **{**settings, **options})


def used(design: Design, quantity: str) -> np.ndarray:
    """The largest value (n,) of a quantity in the optimised part, from its samples alone."""
    motion = design.part("fourier")
    if quantity == "jerk":
        return np.abs(np.diff(motion.ddq, axis=0)).max(axis=0) / design.robot.period
    return np.abs({"velocity": motion.dq, "acceleration": motion.ddq}[quantity]).max(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(("quantity", "bound"), [("velocity", 0.8), ("acceleration", 0.8), ("jerk", 0.8)])
def test_derivatives(quantity: str, bound: float, make_robot) -> None:
    """Where one derivative's limit is far lower than the others', the design goes to it, and would pass it without."""
    tight = make_robot("RR", "tight", **{quantity: np.full(2, bound)})
    assert used(design(make_robot("RR", "loose")), quantity).max() > 1.2 * bound
    reached = used(design(tight), quantity)
    assert reached.max() <= bound
    # What the certificate keeps between 250 samples, the reserve and the barrier's last parameter come to below 3 %.
    assert reached.max() > 0.97 * bound


@pytest.mark.slow
def test_position(make_robot) -> None:
    """A narrow range is used to its ends, and never left."""
    lower, upper = np.array([-0.4, -0.5]), np.array([0.6, 0.3])
    loose = design(make_robot("RR", "loose")).part("fourier").q
    assert (loose < lower).any()
    assert (loose > upper).any()
    tight = design(make_robot("RR", "tight", lower=lower, upper=upper)).part("fourier").q
    assert (tight >= lower).all()
    assert (tight <= upper).all()
    # Both ends of a range of 1 rad, less what is kept between samples.
    assert min((tight.min(axis=0) - lower).min(), (upper - tight.max(axis=0)).min()) < 0.02


@pytest.mark.slow
def test_motor_speed(make_robot) -> None:
    """A motor's speed over its gear ratio bounds the joint, and the margin is stated at the motor."""
    loose = make_robot("RR", "geared")
    geared = replace(loose, gear_ratio=np.array([50.0, -100.0]), motor_speed=np.array([40.0, np.inf]))
    assert used(design(loose), "velocity")[0] > 1.0
    made = design(geared)
    assert 0.97 * 0.8 < used(made, "velocity")[0] <= 0.8
    stated = {margin.joint: margin for margin in made.margins if margin.quantity == "motor speed"}
    assert stated[1].limit == 40.0
    assert abs(stated[1].value) == pytest.approx(50 * np.abs(made.motion.dq[:, 0]).max())
    assert not made.violated


ARM = """
name: arm
geometry:
  convention: modified
  joints:
    - {alpha: 0.0, a: 0.0, d: 0.4}
    - {alpha: 1.5707963267948966, a: 0.0, d: 0.0}
    - {alpha: 0.0, a: 0.5, d: 0.0}
flange: {xyz: [0.4, 0.0, 0.0]}
limits:
  position: {lower: [-2.5, -0.3, -2.2], upper: [2.5, 2.5, 2.2], unit: rad}
  velocity: {values: [2, 2, 2], unit: rad/s}
  acceleration: {values: [10, 10, 10], unit: rad/s2}
  jerk: {values: [100, 100, 100], unit: rad/s3}
collision:
  links:
    - {link: 2, start: [0.0, 0.0, 0.0], end: [0.5, 0.0, 0.0], radius: 0.06}
    - {link: 3, start: [0.0, 0.0, 0.0], end: [0.4, 0.0, 0.0], radius: 0.05}
  boxes:
    - {name: post, size: [0.2, 0.2, 1.6], xyz: [0.5, 0.45, 0.8]}
"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    file = tmp_path_factory.mktemp("arm") / "arm.yaml"
    file.write_text(ARM)
    return load_robot(str(file))


@pytest.fixture(scope="module")
def free(arm: Robot) -> Design:
    return design(arm, home=[0.0, 0.6, 0.9], collision=False)


def tool(motion_q: np.ndarray) -> np.ndarray:
    """The flange's place (N, 3) of the arm above, in closed form."""
    q1, q2, q3 = motion_q.T
    reach = 0.5 * np.cos(q2) + 0.4 * np.cos(q2 + q3)
    height = 0.4 + 0.5 * np.sin(q2) + 0.4 * np.sin(q2 + q3)
    return np.column_stack([np.cos(q1) * reach, np.sin(q1) * reach, height])


@pytest.mark.slow
def test_tool_box(arm: Robot, free: Design) -> None:
    """The tool stays in its box, touches a wall of it nearly, and leaves it where there is none."""
    box = ToolBox(lower=(-0.2, -0.6, 0.3), upper=(0.85, 0.6, 1.2))
    sides = np.array([box.lower]), np.array([box.upper])
    assert ((tool(free.motion.q) < sides[0]) | (tool(free.motion.q) > sides[1])).any(axis=0).any()
    made = design(arm, home=[0.0, 0.6, 0.9], space=[box])
    place = tool(made.motion.q)
    room = np.minimum(place - sides[0], sides[1] - place).min()
    assert 0.0 <= room < 0.02  # 5 mm are kept between the samples
    assert made.success
    assert min(margin.value for margin in made.space) == pytest.approx(room, abs=1e-9)


@pytest.mark.slow
def test_plane(arm: Robot, free: Design) -> None:
    """A link's frame stays on its side of a plane, and comes near it."""
    plane = PlaneLimit(link=3, normal=(0.0, 0.0, 1.0), offset=0.55, name="elbow above the table")

    def height(made: Design) -> float:
        return float((0.4 + 0.5 * np.sin(made.motion.q[:, 1])).min())

    assert height(free) < 0.5
    made = design(arm, home=[0.0, 0.9, 0.5], space=[plane])
    assert 0.55 <= height(made) < 0.57
    assert "elbow above the table" in made.summary()


@pytest.mark.slow
def test_singularity(arm: Robot, free: Design) -> None:
    """The distance to singular poses is kept: the elbow no longer stretches."""
    limit = SingularityLimit(smallest=0.45, length=0.65)
    assert min(smallest_singular_value(q) for q in free.motion.q[::25]) < 0.4
    made = design(arm, home=[0.0, 0.6, 1.2], space=[limit])
    (margin,) = made.space
    assert 0.0 <= margin.value < 0.04  # of 0.45; a brief search ends a little inside
    least = min(smallest_singular_value(q) for q in made.motion.q[::25])
    assert least >= 0.45


def smallest_singular_value(q: np.ndarray) -> float:
    """Of the Jacobian of place over 0.65 m, by differences, and of turn, by the axes."""
    half, step = 0.65, 1e-6
    linear = np.column_stack([(tool((q + d)[None])[0] - tool((q - d)[None])[0]) / (2 * step) for d in step * np.eye(3)])
    side = np.array([np.sin(q[0]), -np.cos(q[0]), 0.0])
    return float(np.linalg.svd(np.vstack([linear / half, np.column_stack([[0, 0, 1], side, side])]))[1][-1])


@pytest.mark.slow
def test_obstacle(arm: Robot, free: Design) -> None:
    """The arm keeps its clearance from a box beside it; without watching, the same design runs into the box."""
    centre, half = np.array([0.5, 0.45, 0.8]), np.array([0.1, 0.1, 0.8])

    def nearest(made: Design) -> float:
        outside = np.maximum(np.abs(tool(made.motion.q) - centre) - half, 0.0)
        return float(np.linalg.norm(outside, axis=1).min())

    assert nearest(free) == 0.0
    made = design(arm, home=[0.0, 0.6, 0.9], collision=True, clearance=0.02)
    assert made.freedom is not None
    assert made.freedom["certified"]
    assert 0.02 <= made.freedom["clearance"] < 0.05
    assert nearest(made) > 0.07  # its radius and the clearance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("space", "message"),
    [
        (ToolBox(lower=(1.5, -0.1, 0.0), upper=(1.8, 0.1, 0.2)), "cannot reach its box"),
        (PlaneLimit(link=3, normal=(0.0, 0.0, 1.0), offset=0.95), "start pose violates"),
    ],
)
def test_space_without_room(arm: Robot, space: GeometricLimit, message: str) -> None:
    """A box that the tool cannot enter, and a plane that no pose can keep, are reported before any search."""
    with pytest.raises(InfeasibleError, match=message):
        design(arm, space=[space])


@pytest.mark.slow
def test_home_is_moved_where_nobody_stated_it(arm: Robot) -> None:
    """If the usual home pose violates a workspace limit, the nearest valid pose is used, and the design says so."""
    plane = PlaneLimit(link=3, normal=(0.0, 0.0, 1.0), offset=0.55)
    made = design(arm, space=[plane])
    assert made.home_moved
    assert 0.4 + 0.5 * np.sin(made.home[1]) > 0.55
    assert "the usual home pose violates a workspace limit" in made.summary()
    np.testing.assert_allclose(made.motion.q[[0, -1]], [made.home, made.home], atol=1e-9)


def test_period_too_short(make_robot) -> None:
    """A period in which a joint can hardly move is refused, with the joint and the period that would do."""
    robot = make_robot("RR", "slow", velocity=np.array([3.0, 0.1]))
    with pytest.raises(InfeasibleError, match=r"joint 2: a period of 0\.4 s is too short.*1\.41 s or longer") as caught:
        design(robot, base_frequency=2.5)
    assert caught.value.joint == 2


@pytest.mark.slow
def test_every_start_is_reported(make_robot) -> None:
    """The outcome of each random start is in the design and its file."""
    made = design(make_robot("RR", "two"), effort=Effort(islands=1, starts=3, screened=5, hops=0, finish_samples=60))
    (island,) = made.islands
    assert len(island.starts) == 3
    assert all(after <= before for before, after in island.starts)
    assert made.to_dict()["solver"]["islands"][0]["starts"] == [list(pair) for pair in island.starts]


@pytest.mark.slow
def test_files_of_designs_in_space(arm: Robot, tmp_path: Path) -> None:
    """What the limits in space came to is saved and loaded."""
    made = design(arm, home=[0.0, 0.6, 0.9], space=[ToolBox(lower=(-0.2, -0.6, 0.3), upper=(0.85, 0.6, 1.2))])
    made.save(tmp_path)
    assert Design.load(tmp_path, robot=arm).to_dict() == made.to_dict()
