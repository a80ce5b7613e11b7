from __future__ import annotations

import casadi
import numpy as np
import pytest

from robots.batch import compiled


@pytest.fixture
def function() -> casadi.Function:
    """Two inputs, two outputs; structural zeros, a constant and operations of several kinds."""
    x, y = casadi.SX.sym("x", 3), casadi.SX.sym("y", 2)
    first = casadi.SX(2, 3)
    first[0, 1] = casadi.sin(x[0]) * y[1] + 1.5
    first[1, 2] = casadi.tanh(x[2] / 0.1) / (2 + x[1] ** 2)
    return casadi.Function("f", [x, y], [first, casadi.vertcat(x[1] - y[0], 7)])


@pytest.fixture
def expected(function):
    """CasADi's own values, sample by sample."""

    def evaluate(x, y):
        rows = [function(*sample) for sample in zip(x, y, strict=True)]
        return [np.array([row[k].full() for row in rows]) for k in range(2)]

    return evaluate


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """An empty cache of libraries, and no memory of a compiler found before; gives the cache's folder."""
    monkeypatch.setenv("ROBOT_OED_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.delenv("ROBOT_OED_BACKEND", raising=False)
    monkeypatch.setattr(compiled.tempfile, "tempdir", None)
    compiled.compiler.cache_clear()
    yield tmp_path / "cache"
    compiled.compiler.cache_clear()


@pytest.fixture
def needs_compiler():
    try:
        compiled.compiler()
    except compiled.CompilerError as error:
        pytest.skip(str(error))
