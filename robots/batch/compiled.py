"""Evaluation by compiled C: the machine's compiler builds it, a cache keeps it."""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import platform
import shutil
import subprocess
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import casadi

from robots.batch.base import Array, BatchFunction, row_major
from robots.batch.building import builds_expressions
from robots.batch.c_source import c_source

log = logging.getLogger(__name__)

FLAGS = ("-march=native", "-fno-math-errno", "-fPIC", "-shared")
# Sines of whole vectors: tried first, and done without where the compiler, the C library or the processor lacks them.
VECTOR_LIBM = ("-DVECTOR_LIBM", "-Wl,--no-undefined", "-lmvec")
# A robot that is loaded again has the same functions: their sources are kept, the last ones of a process.
KEPT_SOURCES = 64


class CompilerError(RuntimeError):
    """No compiler is at hand, or it refused."""


class CompiledFunction(BatchFunction):
    """Compiled C: well under a microsecond a sample for a six-joint regressor.

    Raises:
        CompilerError: no compiler, or it failed.
    """

    def __init__(self, function: casadi.Function) -> None:
        super().__init__(function)
        library = _build(_source(function))
        try:
            loaded = ctypes.CDLL(str(library))
            self._all, self._sums = loaded.batch_all, loaded.batch_sums
            self._steps = getattr(loaded, "batch_steps", None)
        except (OSError, AttributeError) as error:
            raise CompilerError(f"{library} cannot be loaded: {error}") from error
        self._all.restype = self._sums.restype = None

    def _evaluate(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        self._all(ctypes.c_longlong(samples), _pointers(arguments), _pointers(outputs))

    def _bound(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> Callable[[], None]:
        call, count = self._all, ctypes.c_longlong(samples)
        pointers = _pointers(arguments), _pointers(outputs)

        def run(_kept: tuple[object, ...] = (arguments, outputs)) -> None:
            call(count, *pointers)

        return run

    def _advance(self, samples: int, arguments: list[Array], inputs: Array, states: Array) -> None:
        counts = ctypes.c_longlong(samples), ctypes.c_longlong(len(inputs))
        assert self._steps is not None
        self._steps(*counts, _pointers([arguments[0], inputs, *arguments[2:]]), _pointers([states]))

    def _sum(self, groups: int, size: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        counts = ctypes.c_longlong(groups), ctypes.c_longlong(size)
        self._sums(*counts, _pointers(arguments), _pointers(outputs))


_SOURCES: OrderedDict[bytes, str] = OrderedDict()


@builds_expressions
def _source(function: casadi.Function) -> str:
    key = hashlib.sha256(function.serialize().encode()).digest()
    source = _SOURCES.pop(key, None) or c_source(row_major(function))
    _SOURCES[key] = source
    if len(_SOURCES) > KEPT_SOURCES:
        _SOURCES.popitem(last=False)
    return source


def _pointers(arrays: Sequence[Array]) -> ctypes.Array[ctypes.c_void_p]:
    return (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))


def default_backend() -> str:
    """Gives ROBOT_OED_BACKEND, or ``auto``."""
    return os.environ.get("ROBOT_OED_BACKEND", "auto")


def cache_folder() -> Path:
    """The folder of built libraries: ROBOT_OED_CACHE, or ``robot-oed`` in the user's cache folder."""
    stated = os.environ.get("ROBOT_OED_CACHE")
    if stated:
        return Path(stated)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "robot-oed"


@cache
def compiler() -> tuple[str, str]:
    """Finds the C compiler: its path, and a text that changes with its file and this machine.

    Raises:
        CompilerError: none is on the path.
    """
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        path = shutil.which(name) if name else None
        if path:
            # Not its own words: to ask it takes longer than to load what it has built.
            file = Path(path).resolve()
            state = file.stat()
            return path, f"{file}|{state.st_size}|{state.st_mtime_ns}|{_libc()}|{platform.machine()}|{_processor()}"
    raise CompilerError("no C compiler (cc, gcc, clang) on the path")


def _libc() -> str:
    # A library built with a newer one does not load with an older.
    try:
        return os.confstr("CS_GNU_LIBC_VERSION") or ""
    except (AttributeError, ValueError):  # Windows; macOS
        return ""


def _processor() -> str:
    # -march=native code must not be reused on another processor that shares this home folder.
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), "")


def _build(source: str) -> Path:
    path, identity = compiler()
    key = hashlib.sha256("\0".join((source, identity, *FLAGS, *VECTOR_LIBM)).encode()).hexdigest()[:32]
    # Windows has no numbers of users, and a temporary folder for each of them.
    user = os.getuid() if hasattr(os, "getuid") else None
    for folder in (cache_folder(), Path(tempfile.gettempdir()) / f"robot-oed-{'user' if user is None else user}"):
        library = folder / f"{key}.so"
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            if user is not None and folder.stat().st_uid != user:
                raise PermissionError(f"{folder} belongs to another user")  # who could leave any code there
            if not library.exists():
                _compile(path, source, library)
        except OSError as error:
            log.info("cannot keep compiled code in %s: %s", folder, error)
            continue
        return library
    raise CompilerError("no writable folder for compiled code")


def _compile(path: str, source: str, library: Path) -> None:
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        code, built = Path(folder) / "batch.c", Path(folder) / "batch.so"
        code.write_text(source, encoding="utf-8")
        # Optimisation pays, up to a length at which it would take minutes: a chain of ten oblique joints,
        # differentiated.
        effort = "-O3" if len(source) < 600_000 else "-O1"
        for extra in (VECTOR_LIBM, ()):
            command = [path, effort, *FLAGS, str(code), "-o", str(built), *extra, "-lm"]
            result = subprocess.run(command, capture_output=True, text=True, check=False)
            if not result.returncode:
                break
        else:
            raise CompilerError(f"{path} failed: {result.stderr.strip()[:500]}")
        # Another process may have built the same file meanwhile: replacing it is atomic and harmless.
        os.replace(built, library)
