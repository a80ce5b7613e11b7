"""Rigid links in a serial chain, against pinocchio."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.regressor import TorqueModel
from robots.terms import RigidBody

# Both sides round some thousand operations: 1e-13 of the largest value is usual, 1e-9 is what the design asks for.
ACCURACY = 1e-9


def agree(robot, twin, state):
    model = TorqueModel(robot, (RigidBody(),))
    Y = model.regressor(*state, backend="vectorised")
    expected = twin(robot).regressor(*state)
    np.testing.assert_allclose(Y, expected, rtol=0, atol=ACCURACY * np.abs(expected).max())
    torque = twin(robot).torque(*state, robot.inertia)
    ours = Y @ model.nominal
    np.testing.assert_allclose(ours, torque, rtol=0, atol=ACCURACY * np.abs(torque).max())


@pytest.mark.parametrize("name", ["er3a", "ur10", "panda"])
def test_robots_of_the_catalogue(name, catalogue_robot, twin, states):
    """Regressor and torque of the catalogue's robots are pinocchio's."""
    robot = catalogue_robot(name)
    agree(robot, twin, states(robot, 50))


@pytest.mark.slow
@settings(max_examples=80 if os.environ.get("LONGER") else 30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 8))
def test_any_chain(seed, n, random_robot, twin, states):
    """Any chain of sliding and turning joints about oblique axes, under any gravity, gives pinocchio's torques."""
    robot = random_robot(seed, n)
    agree(robot, twin, states(robot, 5, seed))


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), n=st.integers(2, 8))
def test_a_joint_feels_only_the_links_it_carries(seed, n, random_robot):
    """The regressor is block upper triangular: its lower blocks are structurally zero."""
    robot = random_robot(seed, n)
    sparsity = np.array(TorqueModel(robot, (RigidBody(),)).symbolic().sparsity_out(0))
    for joint in range(n):
        assert not sparsity[joint, : 10 * joint].any()


def test_the_er3a_has_exact_zeros(catalogue_robot, states):
    """Right angles leave exact zeros: joint 1 of the ER3A, which turns about gravity, feels only Izz of link 1."""
    robot = catalogue_robot("er3a")
    model = TorqueModel(robot, (RigidBody(),))
    Y = model.regressor(*states(robot, 20))
    acting = [name for name, column in zip(model.names[:10], Y[:, 0, :10].T, strict=True) if column.any()]
    assert acting == ["Izz_1"]


def test_parameters_are_named_link_after_link(catalogue_robot):
    """The ten parameters of each link come as m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, with SI units."""
    columns = RigidBody().columns(catalogue_robot("er3a"))
    symbols = ["m", "mPx", "mPy", "mPz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]
    assert [column.name for column in columns[10:20]] == [f"{symbol}_2" for symbol in symbols]
    assert [column.unit for column in columns[:10]] == ["kg"] + ["kg m"] * 3 + ["kg m2"] * 6
    assert {column.joint for column in columns[50:]} == {6}
