"""The Jacobian as an expression is that of the numeric model."""

from __future__ import annotations

import numpy as np
import pytest

from oed.experiments.pose_designs.information import UNSUITED
from robots import load_robot
from robots.common.errors import InputError
from robots.geometry_errors import (
    TERMS,
    BodyPoses,
    CameraBoard,
    Distances,
    GeometryModel,
    Inclinometer,
    Markers,
    MeasuredPoses,
    Planes,
    random_positions,
)
from robots.geometry_errors.symbolic import symbolic_jacobian

STATIC = tuple(term for term in TERMS if term.kind not in UNSUITED)


@pytest.mark.parametrize(
    "measurement",
    [
        Markers(count=2),
        BodyPoses(),
        Distances(count=2, offset=True),
        Inclinometer(),
        CameraBoard(rows=2, across=2, distortion=(-0.2, 0.05, 1e-3, -2e-3, 0.01), fit="distortion"),
        CameraBoard(rows=2, across=2, on_flange=False),
    ],
    ids=lambda m: f"{m.kind}-{getattr(m, 'on_flange', '')}",
)
def test_expression_is_the_numeric_jacobian(measurement):
    """By all errors that depend on the pose alone, and by the setup, at a nominal arm."""
    robot = load_robot("ur10")
    q = random_positions(robot, 4, seed=3)
    setup = measurement.example
    observed = measurement.simulate([robot.chain.flange(q)], setup, {}, 0)
    model = GeometryModel([robot], STATIC, MeasuredPoses(q=q, measurement=measurement, observed=observed))
    numeric = model.evaluate(np.zeros(len(model.errors)), setup).jacobian
    function = symbolic_jacobian(robot, STATIC, measurement, setup)
    own = np.array([np.array(function(x)) for x in q])
    # A board behind the camera is not in the image: its rows are zero in the numeric model.
    seen = np.abs(numeric).max(axis=(1, 2)) > 0.0
    assert seen.any()
    scale = np.abs(numeric[seen]).max()
    np.testing.assert_allclose(own[seen], numeric[seen], atol=1e-11 * scale)


def test_touched_planes_have_no_expression():
    """A measurement for which no poses are designed says so."""
    robot = load_robot("ur10")
    with pytest.raises(InputError, match="no poses are designed"):
        symbolic_jacobian(robot, STATIC, Planes(), {})
