"""Evaluation without a compiler: the function's instructions, each run by numpy on a whole chunk of samples."""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi
import numpy as np

from robots.batch.base import Array, BatchFunction, row_major

# Long enough that numpy's cost per call vanishes, short enough that the registers stay in the cache.
CHUNK = 2048
# Columns transposed at a time: numpy's copy of a whole transposed chunk is ten times as slow.
BAND = 8

_BINARY = {
    casadi.OP_ADD: "{0} + {1}",
    casadi.OP_SUB: "{0} - {1}",
    casadi.OP_MUL: "{0} * {1}",
    casadi.OP_DIV: "{0} / {1}",
    casadi.OP_POW: "{0} ** {1}",
    casadi.OP_CONSTPOW: "{0} ** {1}",
    casadi.OP_FMIN: "np.minimum({0}, {1})",
    casadi.OP_FMAX: "np.maximum({0}, {1})",
    casadi.OP_ATAN2: "np.arctan2({0}, {1})",
    casadi.OP_COPYSIGN: "np.copysign({0}, {1})",
    casadi.OP_LT: "np.less({0}, {1}).astype(float)",
    casadi.OP_LE: "np.less_equal({0}, {1}).astype(float)",
    casadi.OP_EQ: "np.equal({0}, {1}).astype(float)",
    casadi.OP_NE: "np.not_equal({0}, {1}).astype(float)",
    casadi.OP_IF_ELSE_ZERO: "np.where({0} != 0, {1}, 0.0)",
}
_UNARY = {
    casadi.OP_ASSIGN: "{0}",
    casadi.OP_NEG: "-{0}",
    casadi.OP_SQ: "{0} * {0}",
    casadi.OP_TWICE: "{0} + {0}",
    casadi.OP_INV: "1.0 / {0}",
    casadi.OP_SQRT: "np.sqrt({0})",
    casadi.OP_EXP: "np.exp({0})",
    casadi.OP_LOG: "np.log({0})",
    casadi.OP_SIN: "np.sin({0})",
    casadi.OP_COS: "np.cos({0})",
    casadi.OP_TAN: "np.tan({0})",
    casadi.OP_ASIN: "np.arcsin({0})",
    casadi.OP_ACOS: "np.arccos({0})",
    casadi.OP_ATAN: "np.arctan({0})",
    casadi.OP_SINH: "np.sinh({0})",
    casadi.OP_COSH: "np.cosh({0})",
    casadi.OP_TANH: "np.tanh({0})",
    casadi.OP_FABS: "np.abs({0})",
    casadi.OP_SIGN: "np.sign({0})",
    casadi.OP_NOT: "np.equal({0}, 0).astype(float)",
}


class VectorisedFunction(BatchFunction):
    """Numpy on chunks of samples: about a microsecond a sample for a six-joint regressor."""

    def __init__(self, function: casadi.Function) -> None:
        super().__init__(function)
        self._run = _translate(row_major(function))

    def _evaluate(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        flat = [output.reshape(samples, -1) for output in outputs]
        with np.errstate(all="ignore"):
            for start in range(0, samples, CHUNK):
                rows = slice(start, min(start + CHUNK, samples))
                # Registers are contiguous rows; the transpositions at both ends cost less than strided arithmetic.
                inputs = [np.ascontiguousarray(a.reshape(samples, -1)[rows].T) for a in arguments]
                results = [np.empty((f.shape[1], rows.stop - rows.start)) for f in flat]
                self._run(inputs, results)
                for target, result in zip(flat, results, strict=True):
                    for band in range(0, result.shape[0], BAND):
                        target[rows, band : band + BAND] = result[band : band + BAND].T


def _translate(function: casadi.Function) -> Callable[[list[Array], list[Array]], None]:
    """Writes the instruction list as the body of a Python function and compiles that."""
    lines = ["def run(inputs, outputs):"]
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        into, source = function.instruction_output(k), function.instruction_input(k)
        if operation == casadi.OP_CONST:
            lines.append(f"    w{into[0]} = {_literal(function.instruction_constant(k))}")
        elif operation == casadi.OP_INPUT:
            lines.append(f"    w{into[0]} = inputs[{source[0]}][{source[1]}]")
        elif operation == casadi.OP_OUTPUT:
            lines.append(f"    outputs[{into[0]}][{into[1]}] = w{source[0]}")
        else:
            template = _BINARY.get(operation) or _UNARY[operation]
            lines.append(f"    w{into[0]} = " + template.format(*(f"w{index}" for index in source)))
    namespace: dict[str, object] = {"np": np, "inf": math.inf, "nan": math.nan}
    exec(compile("\n".join(lines), "<casadi function>", "exec"), namespace)
    return namespace["run"]  # type: ignore[return-value]


def _literal(value: float) -> str:
    return repr(float(value))
