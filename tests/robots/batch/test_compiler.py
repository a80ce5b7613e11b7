"""Finding a compiler, doing without, and the cache of what it built."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import OrderedDict
from pathlib import Path

import casadi
import numpy as np
import pytest

from robots.batch import batch_function, compiled
from robots.batch.c_source import c_source
from robots.batch.compiled import CompiledFunction
from robots.batch.factory import VectorisedFunction
from robots.common.errors import InputError

ROOT = Path(__file__).parents[3]
X = np.arange(20.0).reshape(-1, 1)


@pytest.fixture
def square() -> casadi.Function:
    x = casadi.SX.sym("x")
    return casadi.Function("f", [x], [x**2 + 1])


def works(evaluate) -> bool:
    return np.array_equal(evaluate(X)[0].ravel(), X.ravel() ** 2 + 1)


def fake_compiler(folder: Path, script: str) -> str:
    path = folder / "fake-cc"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


def test_auto_compiles_where_a_compiler_works(fresh, needs_compiler, square):
    """With a compiler `auto` compiles, and leaves one library in the cache."""
    evaluate = batch_function(square)
    assert isinstance(evaluate, CompiledFunction)
    assert works(evaluate)
    assert [path.suffix for path in fresh.iterdir()] == [".so"]


def test_a_library_is_built_once(fresh, needs_compiler, square, monkeypatch):
    """A function compiled before is loaded from the cache, without a call of the compiler."""
    batch_function(square, "compiled")
    monkeypatch.setattr(compiled, "_compile", None)
    assert works(batch_function(square, "compiled"))


def test_without_a_compiler_auto_is_vectorised(fresh, square, monkeypatch):
    """Without a compiler on the path `auto` is vectorised, and `compiled` says what is missing."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    evaluate = batch_function(square)
    assert isinstance(evaluate, VectorisedFunction)
    assert works(evaluate)
    with pytest.raises(InputError, match=r"no C compiler .* on the path; install a C compiler or use vectorised"):
        batch_function(square, "compiled")


def test_a_failing_compiler_is_done_without(fresh, square, monkeypatch, tmp_path):
    """A compiler that fails leaves nothing in the cache; `auto` is vectorised, `compiled` shows what it said."""
    monkeypatch.setenv("CC", fake_compiler(tmp_path, "echo out of licences >&2; exit 3"))
    assert isinstance(batch_function(square), VectorisedFunction)
    with pytest.raises(InputError, match="out of licences"):
        batch_function(square, "compiled")
    assert list(fresh.iterdir()) == []


def test_a_library_that_cannot_be_loaded_is_done_without(fresh, square, monkeypatch, tmp_path):
    """A compiler whose library does not load is done without too."""
    script = 'while [ "$1" != -o ]; do shift; done; echo rubbish > "$2"'
    monkeypatch.setenv("CC", fake_compiler(tmp_path, f'[ "$1" = --version ] && exit 0\n{script}'))
    assert isinstance(batch_function(square), VectorisedFunction)
    with pytest.raises(InputError, match="cannot be loaded"):
        batch_function(square, "compiled")


def test_the_environment_chooses(fresh, square, monkeypatch):
    """ROBOT_OED_BACKEND decides what `auto` means; a backend stated in the call wins over it."""
    monkeypatch.setenv("ROBOT_OED_BACKEND", "vectorised")
    assert isinstance(batch_function(square), VectorisedFunction)
    monkeypatch.setenv("ROBOT_OED_BACKEND", "fortran")
    with pytest.raises(InputError, match="backend 'fortran'; allowed: auto, compiled, vectorised"):
        batch_function(square)
    assert isinstance(batch_function(square, "vectorised"), VectorisedFunction)


def test_an_unwritable_cache_is_done_without(fresh, needs_compiler, square, tmp_path):
    """Where the cache folder cannot be made, libraries go to a private temporary folder."""
    fresh.write_text("a file where the folder should be")
    assert works(batch_function(square, "compiled"))
    (private,) = tmp_path.glob("robot-oed-*")
    assert private.stat().st_mode & 0o777 == 0o700
    assert len(list(private.iterdir())) == 1


def test_no_folder_at_all_is_done_without(fresh, needs_compiler, square, tmp_path):
    """Where no folder can be written, `auto` is vectorised."""
    fresh.write_text("")
    (tmp_path / f"robot-oed-{os.getuid()}").write_text("")
    assert isinstance(batch_function(square), VectorisedFunction)
    with pytest.raises(InputError, match="no writable folder for compiled code"):
        batch_function(square, "compiled")


def test_a_folder_of_another_user_is_not_trusted(fresh, needs_compiler, square, monkeypatch):
    """Libraries are not loaded from a folder that another user made."""
    fresh.mkdir()
    monkeypatch.setattr(os, "getuid", lambda: fresh.stat().st_uid + 1)
    assert isinstance(batch_function(square), VectorisedFunction)


def test_a_system_without_user_numbers_compiles(fresh, needs_compiler, square, monkeypatch):
    """Where the system has neither numbers of users nor `confstr`, as Windows, libraries are built and kept."""
    compiled.compiler.cache_clear()
    monkeypatch.delattr(os, "getuid")
    monkeypatch.delattr(os, "confstr")
    assert works(batch_function(square, "compiled"))
    assert [path.suffix for path in fresh.iterdir()] == [".so"]


@pytest.mark.slow
def test_another_compiler_builds_anew(fresh, needs_compiler, square, monkeypatch, tmp_path):
    """A library is used again only with the compiler, the processor and the source it was built for."""
    batch_function(square, "compiled")
    path, _ = compiled.compiler()
    compiled.compiler.cache_clear()
    monkeypatch.setenv("CC", fake_compiler(tmp_path, f'[ "$1" = --version ] && echo other || exec {path} "$@"'))
    batch_function(square, "compiled")
    assert len(list(fresh.glob("*.so"))) == 2


@pytest.mark.slow
def test_sines_of_vectors_are_done_without(fresh, needs_compiler, function, expected, monkeypatch, tmp_path):
    """Where the C library has no sines of whole vectors, they are taken one by one."""
    path, _ = compiled.compiler()
    compiled.compiler.cache_clear()
    script = f'case "$*" in *-lmvec*) echo no such library >&2; exit 1;; esac\nexec {path} "$@"'
    monkeypatch.setenv("CC", fake_compiler(tmp_path, script))
    x, y = (np.random.default_rng(0).normal(size=(19, k)) for k in (3, 2))
    for found, wanted in zip(batch_function(function, "compiled")(x, y), expected(x, y), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_two_processes_may_build_the_same(fresh, needs_compiler, monkeypatch, tmp_path):
    """Processes that build the same function at once all get a whole library."""
    path, _ = compiled.compiler()
    # Slow enough that the builds overlap.
    monkeypatch.setenv("CC", fake_compiler(tmp_path, f'[ "$1" = --version ] || sleep 0.5\nexec {path} "$@"'))
    script = (
        "import casadi, numpy as np; from robots.batch import batch_function; x = casadi.SX.sym('x');"
        "f = batch_function(casadi.Function('f', [x], [x**2 + 1]), 'compiled'); print(f(np.full((5, 1), 3.0))[0].sum())"
    )
    command = [sys.executable, "-c", script]
    processes = [subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert [process.communicate(timeout=60)[0].strip() for process in processes] == ["50.0", "50.0"]
    assert [path.suffix for path in fresh.iterdir()] == [".so"]


def test_a_function_that_is_built_again_is_not_written_again(needs_compiler, monkeypatch, tmp_path: Path) -> None:
    """An equal function takes the source of the first; one that differs by a constant has its own."""
    monkeypatch.setenv("ROBOT_OED_CACHE", str(tmp_path))
    written = []
    monkeypatch.setattr(compiled, "c_source", lambda function: written.append(function) or c_source(function))
    monkeypatch.setattr(compiled, "_SOURCES", OrderedDict())
    monkeypatch.setattr(compiled, "KEPT_SOURCES", 2)

    def value(constant: float) -> float:
        x = casadi.SX.sym("x")
        return float(CompiledFunction(casadi.Function("f", [x], [constant - x]))(X)[0].ravel()[3])

    assert [value(constant) for constant in (1.0, 1.0, 2.0, 1.0)] == [-2.0, -2.0, -1.0, -2.0]
    assert len(written) == 2
    # Two are kept, those used last.
    assert [value(constant) for constant in (3.0, 1.0, 2.0)] == [0.0, -2.0, -1.0]
    assert len(written) == 4
