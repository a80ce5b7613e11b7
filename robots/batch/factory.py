"""The choice of the evaluator of a CasADi function."""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi
import numpy as np
from scipy.special import erf

from robots.batch.base import Array, BatchFunction, row_major
from robots.batch.compiled import CompiledFunction, CompilerError, default_backend
from robots.batch.operations import operation
from robots.common.errors import InputError


def batch_function(function: casadi.Function, backend: str = "auto") -> BatchFunction:
    """Chooses the fastest evaluator that this machine has.

    Args:
        function: see `BatchFunction`.
        backend: ``compiled`` (C, by the machine's compiler, cached), ``vectorised`` (numpy) or ``auto``: compiled
            where a compiler works. The environment variable ROBOT_OED_BACKEND overrides ``auto``.

    Raises:
        InputError: an unknown backend, or ``compiled`` without a working compiler.
    """
    chosen = default_backend() if backend == "auto" else backend
    if chosen not in ("auto", "compiled", "vectorised"):
        raise InputError(f"backend {chosen!r}", allowed="auto, compiled, vectorised")
    if chosen != "vectorised":
        try:
            return CompiledFunction(function)
        except CompilerError as error:
            if chosen == "compiled":
                raise InputError(f"cannot compile: {error}", remedy="install a C compiler or use vectorised") from error
    return VectorisedFunction(function)


# Long enough that numpy's cost per call vanishes, short enough that the registers stay in the cache.
BATCH_ROWS = 2048


class VectorisedFunction(BatchFunction):
    """Numpy on chunks of samples: about a microsecond a sample for a six-joint regressor."""

    def __init__(self, function: casadi.Function) -> None:
        super().__init__(function)
        self._run = _translate(row_major(function))

    def _evaluate(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        wide = [argument.reshape(samples, size) for argument, size in zip(arguments, self.input_sizes, strict=True)]
        flat = [output.reshape(samples, math.prod(output.shape[1:])) for output in outputs]
        # Columns transposed at a time: numpy's copy of a whole transposed chunk is ten times as slow.
        band_width = 8
        with np.errstate(all="ignore"):
            for start in range(0, samples, BATCH_ROWS):
                rows = slice(start, min(start + BATCH_ROWS, samples))
                # Registers are contiguous rows; the transpositions at both ends cost less than strided arithmetic.
                inputs = [np.ascontiguousarray(a[rows].T) for a in wide]
                results = [np.empty((f.shape[1], rows.stop - rows.start)) for f in flat]
                self._run(inputs, results)
                for target, result in zip(flat, results, strict=True):
                    for band in range(0, result.shape[0], band_width):
                        target[rows, band : band + band_width] = result[band : band + band_width].T

    def _sum(self, groups: int, size: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        step = max(1, BATCH_ROWS // size)
        for start in range(0, groups, step):
            stop = min(start + step, groups)
            rows = [argument[start * size : stop * size] for argument in arguments]
            for target, values in zip(outputs, self(*rows), strict=True):
                target[start:stop] = values.reshape(stop - start, size, *values.shape[1:]).sum(axis=1)


def _translate(function: casadi.Function) -> Callable[[list[Array], list[Array]], None]:
    """Writes the instruction list as the body of a Python function and compiles that."""
    lines = ["def run(inputs, outputs):"]
    for k in range(function.n_instructions()):
        identifier = function.instruction_id(k)
        into, source = function.instruction_output(k), function.instruction_input(k)
        if identifier == casadi.OP_CONST:
            lines.append(f"    w{into[0]} = {_literal(function.instruction_constant(k))}")
        elif identifier == casadi.OP_INPUT:
            lines.append(f"    w{into[0]} = inputs[{source[0]}][{source[1]}]")
        elif identifier == casadi.OP_OUTPUT:
            lines.append(f"    outputs[{into[0]}][{into[1]}] = w{source[0]}")
        else:
            text = operation(identifier).numpy.format(*(f"w{index}" for index in source))
            lines.append(f"    w{into[0]} = {text}")
    namespace: dict[str, object] = {"np": np, "erf": erf, "inf": math.inf, "nan": math.nan}
    exec(compile("\n".join(lines), "<casadi function>", "exec"), namespace)
    return namespace["run"]  # type: ignore[return-value]


def _literal(value: float) -> str:
    return repr(float(value))
