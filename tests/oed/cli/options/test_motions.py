"""Limits in space from the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from oed.cli.options.motions import tool_limits
from oed.exports import read_trajectory
from robots.common.errors import InputError
from robots.common.options import box
from robots.loading import load_robot


def test_options_state_a_box_and_a_distance() -> None:
    """The six numbers are from and to in x, y and z; the singular value is kept as stated."""
    space, distance = tool_limits(box("--tool-box", "0.1,0.6,-0.5,0.5,0.05,inf"), 0.03)
    assert (space.lower, space.upper) == ((0.1, -0.5, 0.05), (0.6, 0.5, np.inf))
    assert distance.smallest == 0.03
    assert tool_limits(None, None) == ()


@pytest.mark.parametrize(
    ("tool_box", "singularity"), [("0,1", None), ("a,b,c,d,e,f", None), ("1,0,0,1,0,1", None), (None, 0.0)]
)
def test_nonsense_is_refused(tool_box: str | None, singularity: float | None) -> None:
    """Other than six numbers, a box without inside, and a distance of zero are refused."""
    with pytest.raises(InputError):
        tool_limits(None if tool_box is None else box("--tool-box", tool_box), singularity)


@pytest.mark.slow
def test_designed_flange_stays_in_its_box(run, robot: Path, tmp_path: Path) -> None:
    """The designed trajectory's flange keeps the box by the chain's own kinematics."""
    low, high = -0.08, 0.08
    out = tmp_path / "boxed"
    options = ("--tool-box", f"{low},{high},-inf,inf,-inf,inf", "--effort", "quick", "--workers", "1", "--no-strokes")
    done = run("design", "--robot", robot, *options, "--out", out)
    assert done.code == 0, done.err
    chain = load_robot(robot).chain
    q = read_trajectory(out / "trajectory.csv")[0].q
    x = chain.flange(q)[..., 0, 3]
    assert low - 1e-6 <= x.min()
    assert x.max() <= high + 1e-6
    assert np.ptp(x) > 0.5 * (high - low)
