"""Rotors that a description leaves out, or shows as datasheets do: what passes a gear is without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robots.terms.effect_bases.unknown_rotor import is_sure, rotor_bounds, rotor_grid, rotors_between
from robots.terms.effects import EFFECTS, situation


def _held(now):
    """The same motion where the base model's one parameter holds the first rotor and link together."""
    parameters = now.parameters.copy()
    parameters[list(now.model.names).index("Im_1")] = 0.0
    merged = situation(now.model, parameters, now.t, now.q, now.dq, now.ddq)
    # As a fit does, the link's own torque takes the rotor's on.
    rotor = float(now.robot.rotor_inertia[0])
    return replace(merged, rigid=merged.rigid + rotor * np.outer(now.ddq[:, 0], np.arange(now.robot.n) == 0))


def test_a_rotor_within_its_link_is_distinguished_from_it(seen):
    """Where one base parameter holds rotor and link, the gear's load is without the rotor that the maker describes."""
    now = seen(4, seed=1)
    rotor = float(now.robot.rotor_inertia[0])
    held = _held(now)
    np.testing.assert_allclose(held.load[:, 0], now.load[:, 0], atol=1e-9)
    np.testing.assert_array_equal(now.rotors[:, 0], [rotor, 0.0])
    np.testing.assert_array_equal(held.rotors[:, 0], [0.0, rotor])


def test_a_rotor_is_as_sure_as_what_tells_it(seen):
    """One that a log shows is sure; a datasheet's may err by 30 %; one that nothing shows is some of the inertia."""
    now = seen(4, seed=1)
    rotor = float(now.robot.rotor_inertia[0])
    held, bare = _held(now), seen(4, seed=1, robot=replace(now.robot, rotor_inertia=np.zeros(4)))
    whole = float(bare.sensitivity("inertia")[:, 0, 0].min())
    assert whole > 0
    for at, bounds, grid in (
        (now, (0.0, 0.0), (0.0,)),
        (held, (-0.3 * rotor, min(0.3 * rotor, max(held.sensitivity("inertia")[:, 0, 0].min() - rotor, 0))), (0.0,)),
        (bare, (0.0, whole), (0.0, 0.5 * whole)),
    ):
        assert rotor_bounds(at, 1) == pytest.approx(bounds)
        assert rotor_grid(at, 1) == pytest.approx(grid)
        assert is_sure(at, 1) is (bounds[0] == bounds[1])
        for name in ("backlash", "joint_elasticity", "load_dependent_friction"):
            own = [shape.name for shape in EFFECTS[name].shapes].index("rotor_inertia")
            assert EFFECTS[name].bounds(at, 1)[own] == rotor_bounds(at, 1)
        along = rotors_between(at, 1)
        assert (along[0], along[-1]) == rotor_bounds(at, 1) if along else is_sure(at, 1)
        np.testing.assert_allclose(np.diff(along, 2), 0.0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["backlash", "joint_elasticity"])
def test_a_rotor_that_is_reported_is_as_one_that_is_described(effect, seen):
    """A first joint's gear and link are without the rotor, whether the description has it or the shape."""
    robot = seen(5, seed=4).robot
    assert robot.chain.joints[0].kind == "revolute"
    rotor = float(robot.rotor_inertia[0])
    described = seen(5, robot=robot)
    # About its own axis the first link turns alone: to a log its inertia is one with the rotor's.
    axis = np.array(robot.chain.joints[0].axis) / np.linalg.norm(robot.chain.joints[0].axis)
    heavier = robot.inertia.copy()
    heavier[0, 4:] += rotor * np.outer(axis, axis)[np.triu_indices(3)]
    lumped = seen(5, robot=replace(robot, inertia=heavier, rotor_inertia=robot.rotor_inertia * (np.arange(5) > 0)))
    np.testing.assert_allclose(lumped.torque, described.torque, atol=1e-9 * np.abs(lumped.torque).max())
    shape, after = {"backlash": ((1e-3, 0.0), (0.02,)), "joint_elasticity": ((1e4,), (0.05,))}[effect]
    cases = ((described, 0.0), (lumped, rotor), (lumped, 0.0))
    known, reported, taken = (EFFECTS[effect].columns(now, 1, (*shape, b, *after)) for now, b in cases)
    np.testing.assert_allclose(reported, known, atol=1e-6 * np.abs(known).max())
    assert np.abs(taken - known).max() > 0.1 * np.abs(known).max()
