"""How numpy and C say each of CasADi's elementary operations."""

from __future__ import annotations

from typing import NamedTuple

import casadi

from robots.common.errors import InputError


class Operation(NamedTuple):
    """One operation on arguments ``{0}`` and ``{1}``.

    Attributes:
        numpy: on arrays.
        c: on numbers; None where C's arithmetic on whole vectors says it as numpy does.
        vector: name of the C function of one argument, where libraries have it for whole vectors too.
    """

    numpy: str
    c: str | None = None
    vector: str | None = None


OPERATIONS = {
    casadi.OP_ASSIGN: Operation("{0}"),
    casadi.OP_ADD: Operation("{0} + {1}"),
    casadi.OP_SUB: Operation("{0} - {1}"),
    casadi.OP_MUL: Operation("{0} * {1}"),
    casadi.OP_DIV: Operation("{0} / {1}"),
    casadi.OP_NEG: Operation("-{0}"),
    casadi.OP_SQ: Operation("{0} * {0}"),
    casadi.OP_TWICE: Operation("{0} + {0}"),
    casadi.OP_INV: Operation("1.0 / {0}"),
    casadi.OP_POW: Operation("np.power({0}, {1})", "pow({0}, {1})"),
    casadi.OP_CONSTPOW: Operation("np.power({0}, {1})", "pow({0}, {1})"),
    casadi.OP_SQRT: Operation("np.sqrt({0})", "sqrt({0})"),
    casadi.OP_EXP: Operation("np.exp({0})", "exp({0})"),
    casadi.OP_EXPM1: Operation("np.expm1({0})", "expm1({0})"),
    casadi.OP_LOG: Operation("np.log({0})", "log({0})"),
    casadi.OP_LOG1P: Operation("np.log1p({0})", "log1p({0})"),
    casadi.OP_SIN: Operation("np.sin({0})", "sin({0})", "sin"),
    casadi.OP_COS: Operation("np.cos({0})", "cos({0})", "cos"),
    casadi.OP_TAN: Operation("np.tan({0})", "tan({0})"),
    casadi.OP_ASIN: Operation("np.arcsin({0})", "asin({0})"),
    casadi.OP_ACOS: Operation("np.arccos({0})", "acos({0})"),
    casadi.OP_ATAN: Operation("np.arctan({0})", "atan({0})"),
    casadi.OP_ATAN2: Operation("np.arctan2({0}, {1})", "atan2({0}, {1})"),
    casadi.OP_SINH: Operation("np.sinh({0})", "sinh({0})"),
    casadi.OP_COSH: Operation("np.cosh({0})", "cosh({0})"),
    casadi.OP_TANH: Operation("np.tanh({0})", "tanh({0})", "tanh"),
    casadi.OP_ASINH: Operation("np.arcsinh({0})", "asinh({0})"),
    casadi.OP_ACOSH: Operation("np.arccosh({0})", "acosh({0})"),
    casadi.OP_ATANH: Operation("np.arctanh({0})", "atanh({0})"),
    casadi.OP_ERF: Operation("erf({0})", "erf({0})"),
    casadi.OP_HYPOT: Operation("np.hypot({0}, {1})", "hypot({0}, {1})"),
    casadi.OP_FABS: Operation("np.abs({0})", "fabs({0})"),
    casadi.OP_SIGN: Operation("np.sign({0})", "({0} > 0) - ({0} < 0)"),
    casadi.OP_COPYSIGN: Operation("np.copysign({0}, {1})", "copysign({0}, {1})"),
    casadi.OP_FLOOR: Operation("np.floor({0})", "floor({0})"),
    casadi.OP_CEIL: Operation("np.ceil({0})", "ceil({0})"),
    casadi.OP_FMOD: Operation("np.fmod({0}, {1})", "fmod({0}, {1})"),
    casadi.OP_FMIN: Operation("np.fmin({0}, {1})", "fmin({0}, {1})"),
    casadi.OP_FMAX: Operation("np.fmax({0}, {1})", "fmax({0}, {1})"),
    casadi.OP_LT: Operation("np.less({0}, {1}) * 1.0", "{0} < {1}"),
    casadi.OP_LE: Operation("np.less_equal({0}, {1}) * 1.0", "{0} <= {1}"),
    casadi.OP_EQ: Operation("np.equal({0}, {1}) * 1.0", "{0} == {1}"),
    casadi.OP_NE: Operation("np.not_equal({0}, {1}) * 1.0", "{0} != {1}"),
    casadi.OP_NOT: Operation("np.logical_not({0}) * 1.0", "!{0}"),
    casadi.OP_AND: Operation("np.logical_and({0}, {1}) * 1.0", "{0} && {1}"),
    casadi.OP_OR: Operation("np.logical_or({0}, {1}) * 1.0", "{0} || {1}"),
    casadi.OP_IF_ELSE_ZERO: Operation("np.where({0}, {1}, 0.0)", "{0} ? {1} : 0"),
}


def operation(identifier: int) -> Operation:
    """Looks an operation up.

    Raises:
        InputError: one that no term has needed yet.
    """
    if identifier not in OPERATIONS:
        raise InputError(
            f"CasADi operation {identifier} has no translation", remedy="add it to robots/batch/operations.py"
        )
    return OPERATIONS[identifier]
