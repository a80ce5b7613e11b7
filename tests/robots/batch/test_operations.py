"""The translation of each of CasADi's operations."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

from robots.batch import batch_function
from robots.batch.operations import OPERATIONS, operation
from robots.common.errors import InputError

NAMES = {getattr(casadi, name): name for name in dir(casadi) if name.startswith("OP_")}
VALUES = np.array([-2.5, -1.0, -0.5, -0.0, 0.0, 0.3, 1.0, 2.0, 700.0])
# CasADi removes copies before they reach an evaluator.
REWRITTEN = {casadi.OP_ASSIGN}


def of_all_operations() -> tuple[casadi.Function, list[int]]:
    """A function of (x, y) that returns each operation's value, and the operations."""
    x, y = casadi.SX.sym("x"), casadi.SX.sym("y")
    known = [identifier for identifier in OPERATIONS if identifier not in REWRITTEN]
    results = []
    for identifier in known:
        template = OPERATIONS[identifier]
        binary = "{1}" in template.numpy
        results.append(casadi.SX.binary(identifier, x, y) if binary else casadi.SX.unary(identifier, x))
    return casadi.Function("f", [x, y], [casadi.vertcat(*results)]), known


@pytest.mark.parametrize("backend", ["compiled", "vectorised"])
def test_every_operation_is_casadis(backend, request):
    """Every translated operation gives CasADi's own value: signs, zeros, and where it is infinite or undefined too."""
    if backend == "compiled":
        request.getfixturevalue("needs_compiler")
    function, known = of_all_operations()
    x, y = (grid.reshape(-1, 1) for grid in np.meshgrid(VALUES, VALUES))
    ours = batch_function(function, backend)(x, y)[0][:, :, 0]
    theirs = np.array([function(a, b).full().ravel() for a, b in zip(x, y, strict=True)])
    for column, identifier in enumerate(known):
        # Two libraries' elementary functions differ in the last digits; sinh(700) is 1e303.
        np.testing.assert_allclose(ours[:, column], theirs[:, column], rtol=1e-12, err_msg=NAMES[identifier])


def test_every_operation_reaches_the_evaluators():
    """The function of the test above really holds the operations that it is meant to test."""
    function, known = of_all_operations()
    present = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert set(known) - present <= {casadi.OP_CONSTPOW}


def test_an_unknown_operation_is_refused():
    """An operation without translation is refused, with what to do."""
    with pytest.raises(InputError, match="no translation; add it to"):
        operation(-1)
