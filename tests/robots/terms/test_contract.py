"""What every term must do."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.terms import TERMS, FrictionPolynomial, RotorInertia, TorqueOffset, build_term, describe_term


@pytest.fixture(params=list(TERMS))
def term(request):
    return TERMS[request.param]()


def test_columns_match_the_regressor(term, random_robot, states):
    """A term describes each column of its regressor, with names that differ and joints counted from 1."""
    robot = random_robot(4, 5)
    columns = term.columns(robot)
    Y = TorqueModel(robot, (term,)).regressor(*states(robot, 3))
    assert Y.shape == (3, 5, len(columns))
    assert np.isfinite(Y).all()
    assert len({column.name for column in columns}) == len(columns)
    assert all(column.name == f"{column.symbol}_{column.joint}" for column in columns)
    assert {column.joint for column in columns} == set(range(1, 6))
    assert {column.term for column in columns} == {term.name}


def test_nominal_values_come_in_the_columns_order(term, random_robot):
    """A term gives one nominal value per column."""
    robot = random_robot(4, 5)
    assert term.nominal(robot).shape == (len(term.columns(robot)),)


def test_a_term_can_be_written_and_read(term):
    """A term read back from its plain description equals the one written."""
    assert build_term(describe_term(term)) == term


def test_lists_from_a_file_become_settings():
    """Settings that a file holds as lists are accepted."""
    assert build_term({"name": "friction", "powers": [1, 2]}) == FrictionPolynomial(powers=(1, 2))


@pytest.mark.parametrize(
    ("description", "message"),
    [
        ({"name": "magic"}, "unknown term 'magic'; allowed: rigid_body, friction"),
        ({}, "unknown term None"),
        ({"name": "friction", "colour": 1}, "term friction: .*colour"),
        ({"name": "friction", "powers": [9]}, "friction powers"),
    ],
)
def test_a_bad_description_is_refused(description, message):
    """A description of an unknown term, or with unknown or impossible settings, is refused by name."""
    with pytest.raises(InputError, match=message):
        build_term(description)


def test_rotor_and_offset(random_robot, states):
    """A rotor adds Im ddq to its own joint and an offset adds itself, in units that follow the joint."""
    robot = random_robot(5, 5)
    q, dq, ddq = states(robot, 7)
    pi = np.arange(1.0, 11.0)
    model = TorqueModel(robot, (RotorInertia(), TorqueOffset()))
    np.testing.assert_allclose(model.torque(q, dq, ddq, pi), pi[:5] * ddq + pi[5:], rtol=1e-15)  # one sum
    slides = [joint.kind == "prismatic" for joint in robot.chain.joints]
    assert any(slides)
    units = [column.unit for column in model.columns]
    assert units[:5] == ["kg" if slide else "kg m2" for slide in slides]
    assert units[5:] == ["N" if slide else "N m" for slide in slides]
