"""Evaluating one CasADi function on many samples at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError


class BatchFunction(ABC):
    """A CasADi function of vectors and matrices, called with arrays whose first axis counts samples.

    CasADi's own call converts numbers one by one, which costs more than the arithmetic; these evaluators read and
    write numpy memory directly.

    Args:
        function: a function of SX inputs; inputs are column vectors (k,), outputs matrices (r, c).
    """

    def __init__(self, function: casadi.Function) -> None:
        self.input_sizes = tuple(function.numel_in(i) for i in range(function.n_in()))
        self.output_shapes = tuple(function.size_out(i) for i in range(function.n_out()))

    def __call__(self, *arguments: Array, out: tuple[Array, ...] | None = None) -> tuple[Array, ...]:
        """Evaluates all samples.

        Args:
            *arguments: one array (N, k) per input; further axes may split k.
            out: arrays to write into, as an earlier call of as many samples returned them. Fresh memory costs as
                much as the arithmetic.

        Returns:
            One C-ordered array (N, r, c) per output.

        Raises:
            InputError: arrays of the wrong shape.
        """
        arrays, samples = self._checked(arguments)
        outputs = self._outputs(samples, out)
        self._evaluate(samples, arrays, outputs)
        return outputs

    def sums(self, *arguments: Array, size: int) -> tuple[Array, ...]:
        """Sums each output over groups of so many samples that follow each other.

        What a fit needs of samples much faster than the motion: none of the outputs is written, only their sums.

        Args:
            *arguments: one array (N, k) per input; further axes may split k.
            size: samples of a group, 1 or more; the last N modulo `size` are left out.

        Returns:
            One C-ordered array (N // size, r, c) per output.

        Raises:
            InputError: arrays of the wrong shape.
        """
        arrays, samples = self._checked(arguments)
        outputs = self._outputs(samples // size, None)
        self._sum(samples // size, size, arrays, outputs)
        return outputs

    def run(self, state: Array, inputs: Array, *constants: Array) -> Array:
        """Evaluates a step function (state, inputs, constants) -> state again and again.

        Args:
            state: at the start (N, s), of N simulations at once.
            inputs: of all K steps (K, N, k).
            *constants: one array (N, c) per further input, the same in all steps.

        Returns:
            The states after each step (K, N, s).

        Raises:
            InputError: arrays of the wrong shape, or a function that is no step.
        """
        steps, size = len(inputs), self.input_sizes[0]
        if len(self.output_shapes) != 1 or self.output_shapes[0] != (size, 1) or len(self.input_sizes) < 2:
            raise InputError("the function is not a step", allowed="(state, inputs, ...) -> state")
        if not steps:
            return np.empty((0, len(state), size))
        arrays, samples = self._checked((state, inputs[0], *constants))
        series = np.ascontiguousarray(inputs, dtype=np.float64)
        if series.shape != (steps, samples, self.input_sizes[1]):
            raise InputError(f"inputs of shape {series.shape}", allowed=f"({steps}, {samples}, {self.input_sizes[1]})")
        states = np.empty((steps, samples, size))
        self._advance(samples, arrays, series, states)
        return states

    def _advance(self, samples: int, arguments: list[Array], inputs: Array, states: Array) -> None:
        """Fills the states step by step; `arguments` are those of the first step."""
        now = list(arguments)
        for k in range(len(inputs)):
            now[1] = inputs[k]
            self._evaluate(samples, now, (states[k][:, :, None],))
            now[0] = states[k]

    def bound(self, arguments: tuple[Array, ...], out: tuple[Array, ...]) -> Callable[[], None]:
        """Checks arrays once, and gives a call that evaluates them where they lie: for one sample many times.

        Args:
            arguments: one C-ordered array (N, k) of float64 per input.
            out: arrays (N, r, c) to write into.

        Returns:
            Reads the arguments as they are now and fills the outputs.

        Raises:
            InputError: arrays of the wrong shape, or that would have to be copied.
        """
        arrays, samples = self._checked(arguments)
        for position, (array, given) in enumerate(zip(arrays, arguments, strict=True)):
            if array is not given:
                raise InputError(f"argument {position + 1} is not a C-ordered array of float64")
        outputs = self._outputs(samples, out)
        return self._bound(samples, arrays, outputs)

    def _bound(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> Callable[[], None]:
        return lambda: self._evaluate(samples, arguments, outputs)

    def _checked(self, arguments: tuple[Array, ...]) -> tuple[list[Array], int]:
        """The arguments as C-ordered arrays, and how many samples they hold."""
        arrays = [np.ascontiguousarray(argument, dtype=np.float64) for argument in arguments]
        if len(arrays) != len(self.input_sizes):
            raise InputError(f"{len(arrays)} arguments", allowed=f"{len(self.input_sizes)}")
        samples = arrays[0].shape[0] if arrays and arrays[0].ndim else 0
        for position, (array, size) in enumerate(zip(arrays, self.input_sizes, strict=True)):
            if array.shape[:1] != (samples,) or array.size != samples * size:
                raise InputError(f"argument {position + 1} has shape {array.shape}", allowed=f"({samples}, {size})")
        return arrays, samples

    def _outputs(self, samples: int, out: tuple[Array, ...] | None) -> tuple[Array, ...]:
        """Fresh arrays for the outputs, or those given."""
        shapes = tuple((samples, *shape) for shape in self.output_shapes)
        outputs = tuple(np.empty(shape) for shape in shapes) if out is None else out
        if len(outputs) != len(shapes):
            raise InputError(f"{len(outputs)} arrays in out", allowed=f"{len(shapes)}")
        for array, shape in zip(outputs, shapes, strict=True):
            if array.shape != shape or array.dtype != np.float64 or not array.flags.c_contiguous:
                raise InputError(f"out has shape {array.shape}", allowed=f"{shape}, C-ordered float64")
        return outputs

    @abstractmethod
    def _evaluate(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        """Fills the outputs."""

    @abstractmethod
    def _sum(self, groups: int, size: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        """Fills the outputs with sums over groups."""


def row_major(function: casadi.Function) -> casadi.Function:
    """Rewrites a function so that its outputs, dense and transposed, lie in memory as numpy rows."""
    symbols = function.sx_in()
    outputs = function.call(symbols)
    return casadi.Function("batch", symbols, [casadi.densify(casadi.vec(output.T)) for output in outputs])
