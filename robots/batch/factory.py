"""The choice of the evaluator of a CasADi function."""

from __future__ import annotations

import casadi

from robots.batch.base import BatchFunction
from robots.batch.compiled import CompiledFunction, CompilerError, default_backend
from robots.batch.vectorised import VectorisedFunction
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
