"""The page of a calibration: the mean error of each session shows a base that moved."""

from __future__ import annotations

import numpy as np

from estimation import calibrate
from estimation.calibrations import CalibrationOptions
from oed.reports.pages.calibrations.calibration_report import calibration_page
from robots import load_robot
from robots.geometry_errors import Markers, random_positions, simulate_poses


def pictures(poses):
    robot = load_robot("ur10")
    result = calibrate(robot, poses, options=CalibrationOptions(kinds=("joint_zero",), diagnose=False))
    return {picture.name: picture for section in calibration_page(result).sections for picture in section.pictures}


def test_a_moved_base_is_a_step_between_sessions():
    """A base that moves by 1 mm along x is half a millimetre off in each of two sessions, along x and no other axis."""
    robot = load_robot("ur10")
    q, session = random_positions(robot, 40, seed=1), np.arange(40) // 20
    moved = simulate_poses(robot, q, Markers(count=2), {"base_1_x": 1e-3}, noise={"m": 2e-5}, session=session)
    panels = pictures(moved)["sessions"].panels
    steps = np.array([np.diff(panel.series[0].y)[0] for panel in panels])
    # Twenty random poses a session are not placed alike: turns of the registration take up a part.
    np.testing.assert_allclose(np.abs(steps), [1.0, 0.0, 0.0], atol=0.2)


def test_one_session_has_no_steps():
    """Without a second session there is nothing to compare."""
    robot = load_robot("ur10")
    poses = simulate_poses(robot, random_positions(robot, 20, seed=1), Markers(), {}, noise={"m": 2e-5})
    assert "sessions" not in pictures(poses)
