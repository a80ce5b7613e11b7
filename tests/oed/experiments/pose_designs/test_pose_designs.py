"""Designs of poses: better than random ones, within all limits, with moves that are free."""

from __future__ import annotations

import numpy as np
import pytest

from oed import PoseOptions, design_poses
from oed.experiments.pose_designs import View, load_pose_design, observability_indices
from oed.experiments.pose_designs.exchange import exchanged
from oed.experiments.pose_designs.information import PoseInformation
from oed.experiments.pose_designs.observability import pose_criterion
from oed.experiments.pose_designs.refinement import PoseProblem, refined
from robots import load_robot
from robots.common.errors import InfeasibleError, InputError
from robots.geometry_errors import CameraBoard, Markers, random_positions


@pytest.fixture(scope="module")
def robot():
    return load_robot("er3a")


@pytest.fixture(scope="module")
def design(robot):
    view = View(origin=(1.5, 0.0, 0.5), towards=(0.0, 0.0, 0.4), cone=0.5)
    return design_poses(robot, count=12, options=PoseOptions(view=view))


def test_indices_are_those_of_singular_values():
    """O1 to O5 of a matrix with singular values 4, 2 and 1 and four poses are as by hand."""
    found = observability_indices(np.array([1.0, 4.0, 16.0]), 4)
    expected = {"O1": 2.0 / 2.0, "O2": 0.25, "O3": 1.0, "O4": 0.25, "O5": 1.0 / 1.75}
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("name", ["d", "cond", "a", "e", "o1", "o4", "o5"])
def test_exchange_improves_any_criterion(name):
    """The exchanged set is better than each of a hundred random ones."""
    rng = np.random.default_rng(0)
    rows = rng.standard_normal((200, 2, 5)) * np.array([3.0, 1.0, 1.0, 0.3, 0.1])
    criterion = pose_criterion(name)

    def cost(chosen):
        own = rows[chosen].reshape(-1, 5)
        return criterion.cost(np.linalg.eigvalsh(own.T @ own))

    best = cost(exchanged(rows, 8, criterion))
    assert best <= min(cost(rng.permutation(200)[:8]) for _ in range(100))


@pytest.mark.parametrize("name", ["d", "cond", "o3", "o4", "o5"])
def test_refinement_has_exact_gradients(robot, name):
    """The gradient of each criterion by all positions is that of central differences."""
    information = PoseInformation(robot, Markers(), ("joint_zero",), {"m": 1e-4})
    problem = PoseProblem(information, pose_criterion(name), 6)
    z = random_positions(robot, 6, seed=2).ravel()
    way = np.random.default_rng(0).standard_normal(z.size)
    _, gradient = problem.surrogate(z, 8.0)
    ahead, behind = (problem.surrogate(z + step * way, 8.0)[0] for step in (1e-5, -1e-5))
    # The third derivative times the square of the step.
    assert gradient @ way == pytest.approx((ahead - behind) / 2e-5, rel=1e-5, abs=1e-7)


def test_only_poses_that_show_the_board_are_designed(robot):
    """A pose at which a camera has the board out of its image informs of nothing, and is no candidate."""
    camera = CameraBoard(rows=2, across=2)
    information = PoseInformation(robot, camera, ("joint_zero",), {"px": 0.2})
    q = random_positions(robot, 3000, seed=2)
    seen = information.seen(q)
    assert 0 < seen.sum() < len(q)
    # The board's first corner lies ahead of the camera, and within the image, by plain projection.
    corner = np.linalg.inv(robot.chain.flange(q[seen])) @ np.array([0.5, 0.0, 0.0, 1.0])
    pixels = 1000.0 * corner[:, :2] / corner[:, 2:3] + (640.0, 480.0)
    assert ((pixels >= 0.0) & (pixels <= (1280.0, 960.0)) & (corner[:, 2:3] > 0.0)).all()


def test_refinement_improves_within_limits(robot):
    """Poses that IPOPT moved are better by the criterion, within their ranges and in the cone of view."""
    view = View(origin=(1.5, 0.0, 0.5), towards=(0.0, 0.0, 0.4), cone=0.3)
    information = PoseInformation(robot, Markers(), ("joint_zero",), {"m": 1e-4})
    drawn = random_positions(robot, 2000, seed=2)
    q = drawn[view.sees(robot.chain.flange(drawn))][:6]
    bounds = (q.min(axis=0) - 0.5, q.max(axis=0) + 0.5)
    criterion = pose_criterion("d")
    found = refined(information, q, criterion, bounds, lambda x: view.sees(robot.chain.flange(x)), view=view)
    problem = PoseProblem(information, criterion, 6)
    # Six random poses are far from the best: their determinant grows by much more than a factor of e.
    assert problem.cost(found) < problem.cost(q) - 1.0
    assert view.sees(robot.chain.flange(found)).all()
    assert ((found >= bounds[0]) & (found <= bounds[1])).all()


@pytest.mark.slow
def test_poses_keep_all_limits(robot, design):
    """Poses lie within limits and in view, and the whole motion is proved free of collisions."""
    limits = robot.limits
    assert ((design.q >= limits.lower) & (design.q <= limits.upper)).all()
    way = robot.chain.flange(design.q)[:, :3, 3] - (1.5, 0.0, 0.5)
    axis = np.array([-1.5, 0.0, -0.1]) / np.linalg.norm([1.5, 0.0, 0.1])
    assert (way @ axis / np.linalg.norm(way, axis=1) >= np.cos(0.5) - 1e-9).all()
    assert design.success
    assert design.freedom["certified"]
    assert not [m for m in limits.margins(design.motion) if m.violated]


@pytest.mark.slow
def test_poses_are_rests_of_the_motion(design):
    """The motion rests at each pose for as long as is asked for."""
    rests = [segment for segment in design.segments if segment["kind"] == "pose"]
    assert len(rests) == len(design.q)
    for pose, rest in zip(design.q, rests, strict=True):
        rows = (design.motion.t >= rest["start"] - 1e-9) & (design.motion.t <= rest["end"] + 1e-9)
        np.testing.assert_allclose(design.motion.q[rows], np.tile(pose, (rows.sum(), 1)), atol=1e-9)
        assert rest["end"] - rest["start"] == pytest.approx(2.0)


@pytest.mark.slow
def test_designed_poses_beat_random_ones(design):
    """O1 of the designed poses is above that of as many random ones, and so is what they determine."""
    other = observability_indices(design.random_eigenvalues, len(design.q))
    assert design.observability["O1"] > 1.1 * other["O1"]
    assert np.isfinite(design.expected).all()
    # IPOPT moves the exchanged poses to better ones.
    assert design.observability["O1"] > design.compared["by exchange alone"]["O1"]


@pytest.mark.slow
def test_expected_errors_are_those_of_calibrations(robot):
    """Standard errors before anything moves are those that a calibration of the poses has afterwards."""
    from estimation import calibrate
    from estimation.calibrations import CalibrationOptions
    from robots.geometry_errors import simulate_poses

    options = PoseOptions(noise={"m": 5e-5}, collision=False, refine=False)
    design = design_poses(robot, count=25, options=options)
    poses = simulate_poses(robot, design.q, Markers(count=3), {"zero_2": 0.003}, noise={"m": 5e-5}, seed=1)
    kinds = CalibrationOptions(kinds=("joint_zero", "link_placement"), diagnose=False)
    found = {item.name: item.standard_error for item in calibrate(robot, poses, options=kinds).parameters}
    ratios = [
        found[item.name] / error
        for item, error in zip(design.parameters, design.expected, strict=True)
        if item.kind == "joint_zero"
    ]
    # The noise is estimated from 200 numbers: to 5 %; the prior of the sizes makes errors a little smaller.
    assert np.median(ratios) == pytest.approx(1.0, abs=0.25)


@pytest.mark.slow
def test_designs_are_saved_and_read_back(design, robot, tmp_path):
    """A saved design reads back, and its table holds the poses with empty cells for the measurement."""
    design.save(tmp_path)
    assert load_pose_design(tmp_path, robot).to_dict() == design.to_dict()
    text = (tmp_path / "poses.csv").read_text()
    assert "x1,y1,z1" in text


def test_impossible_designs_are_refused(robot):
    """Too few poses, unknown criteria, kinds that no pose shows and a view of nothing are refused."""
    with pytest.raises(InputError, match="or more"):
        design_poses(robot, count=2)
    with pytest.raises(InputError, match="o1 to o5"):
        design_poses(robot, criterion="i")
    with pytest.raises(InputError, match="backlash"):
        design_poses(robot, options=PoseOptions(kinds=("backlash",)))
    behind = View(origin=(0.0, 0.0, 5.0), towards=(0.0, 0.0, 9.0), cone=0.1)
    with pytest.raises(InfeasibleError, match="in view"):
        design_poses(robot, options=PoseOptions(view=behind, collision=False))
    with pytest.raises(InputError, match="looks at itself"):
        View(origin=(0, 0, 0), towards=(0, 0, 0))


def test_markers_that_face_away_are_not_seen(robot):
    """A marker along the flange's axis is seen if it points at the instrument, and not if it points away."""
    q = random_positions(robot, 200, seed=1)
    flange = robot.chain.flange(q)
    origin = np.array([2.0, 0.0, 0.5])
    seen = View(origin=origin, axis=(0, 0, 1), facing=np.pi / 3).sees(flange)
    towards = origin - flange[:, :3, 3]
    cosine = np.sum(flange[:, :3, 2] * towards, axis=1) / np.linalg.norm(towards, axis=1)
    np.testing.assert_array_equal(seen, cosine >= 0.5)
