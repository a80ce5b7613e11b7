"""Terms and effects of users: what is wrong with one is one message that names it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi
import numpy as np
import pytest

from robots import default_model, load_robot
from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.terms import TERMS, FrictionTerm
from robots.terms.effects import EFFECTS, Coefficient, StaticJointEffect, check_effect


@dataclass(frozen=True, kw_only=True)
class Odd(FrictionTerm):
    name: ClassVar[str] = "odd_friction"
    fault: str = ""

    def units(self, force: str, length: str) -> dict[str, str]:
        return {"f1" if self.fault == "name" else "o": "" if self.fault == "unit" else force}

    def row(self, dq, sign, scale):
        return casadi.horzcat(sign, dq) if self.fault == "shape" else sign


@pytest.fixture(scope="module")
def er3a():
    return load_robot("er3a")


def test_an_own_friction_term_makes_a_model(er3a):
    """It brings one column a joint, with the scale that the model is built with."""
    model = default_model(er3a, friction=Odd(), velocity_scale=0.02)
    assert [name for name in model.names if name.startswith("o_")] == [f"o_{joint}" for joint in range(1, 7)]
    dq = np.full((1, 6), 0.01)
    Y = model.regressor(np.zeros((1, 6)), dq, np.zeros((1, 6)))[0]
    np.testing.assert_allclose(np.diag(Y[:, [model.names.index(f"o_{j}") for j in range(1, 7)]]), np.tanh(0.5))


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("unit", "the parameter o_1 of the term 'odd_friction' has no unit"),
        ("shape", r"the term 'odd_friction' gives columns of shape \(6, 12\); allowed: \(6, 6\)"),
    ],
)
def test_an_own_friction_term_with_a_fault(er3a, fault, message):
    """No unit and columns of a wrong shape are named."""
    model = default_model(er3a, friction=Odd(fault=fault))
    with pytest.raises(InputError, match=message):
        model.regressor(*np.zeros((3, 1, 6)), columns=range(len(model.columns)))


def test_a_parameter_that_exists(er3a):
    """Two terms with one parameter name are refused by name."""
    terms = (*default_model(er3a).terms, Odd(fault="name"))
    with pytest.raises(InputError, match="the term 'odd_friction' has a parameter f1_1, which exists already"):
        assert TorqueModel(er3a, terms).columns


def test_friction_by_name(er3a):
    """A registered term is found by its name; a term that is no friction, and an unknown one, are refused."""
    TERMS.register(Odd)
    try:
        assert any(isinstance(term, Odd) for term in default_model(er3a, friction="odd_friction").terms)
    finally:
        TERMS.unregister("odd_friction")
    for name in ("rigid_body", "odd_friction"):
        with pytest.raises(InputError, match=f"{name}'.*allowed: polynomial, coulomb-viscous"):
            default_model(er3a, friction=name)


class Drag(StaticJointEffect):
    name: ClassVar[str] = "drag"
    title: ClassVar[str] = "drag"
    fault: str = ""

    def __init__(self, fault: str = "") -> None:
        self.fault = fault

    def parameters(self, robot, joint):
        return (Coefficient("drag", "" if self.fault == "unit" else "N m"),)

    def row(self, robot, joint, at):
        match self.fault:
            case "shape":
                return casadi.horzcat(at.dq, at.q)
            case "infinite":
                return at.dq / 0.0
            case "exception":
                raise KeyError("own table")
        return at.dq * casadi.fabs(at.dq)

    def describe(self, joint, coefficients, shape=(), *, force="N m", length="rad"):
        return f"Joint {joint} drags."


def test_a_good_effect_passes(er3a):
    """An effect without a fault passes the check."""
    check_effect(Drag(), er3a)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("unit", "the effect 'drag' has a parameter 'drag' without a unit"),
        ("shape", r"the effect 'drag' gives columns of shape \(200, 6, 2\); allowed: \(200, 6, 1\)"),
        ("infinite", "the effect 'drag' gives columns that are not finite"),
        ("exception", "the effect 'drag' fails: KeyError: 'own table'"),
    ],
)
def test_an_effect_with_a_fault(er3a, fault, message):
    """A missing unit, columns of a wrong shape or not finite, and an exception of its own are named."""
    with pytest.raises(InputError, match=message):
        check_effect(Drag(fault), er3a)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "stribeck"}, "the effect 'stribeck' exists already"),
        ({"name": ""}, "has no name"),
        ({"title": None}, "the effect 'drag' has no title"),
        ({"experiments": ("dance",)}, "names the experiment 'dance'; allowed: sweep"),
    ],
)
def test_an_effect_that_cannot_be_registered(changes, message):
    """A name that exists, no name, no title and an unknown experiment are refused; the catalogue stays."""
    before = list(EFFECTS)
    with pytest.raises(InputError, match=message):
        EFFECTS.register(type("Own", (Drag,), changes))
    assert list(EFFECTS) == before
