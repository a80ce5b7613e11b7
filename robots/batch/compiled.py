"""Evaluation by compiled C: CasADi writes the code, the machine's compiler builds it, a cache keeps it."""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import platform
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import casadi

from robots.batch.base import Array, BatchFunction, row_major

log = logging.getLogger(__name__)

FLAGS = ("-O2", "-march=native", "-fno-math-errno", "-fPIC", "-shared")

# One call for all samples: strides are the lengths of one sample's arguments and results.
_LOOP = """
CASADI_SYMBOL_EXPORT void batch_all(long long samples, const double** in, const long long* in_size,
                                    double** out, const long long* out_size) {
  const double* arg[%(n_in)d]; double* res[%(n_out)d];
  casadi_int iw[%(iw)d]; double w[%(w)d];
  for (long long k = 0; k < samples; ++k) {
    for (int i = 0; i < %(n_in)d; ++i) arg[i] = in[i] + k * in_size[i];
    for (int i = 0; i < %(n_out)d; ++i) res[i] = out[i] + k * out_size[i];
    batch(arg, res, iw, w, 0);
  }
}
"""


class CompilerError(RuntimeError):
    """No compiler is at hand, or it refused."""


class CompiledFunction(BatchFunction):
    """Compiled C: well under a microsecond a sample for a six-joint regressor.

    Raises:
        CompilerError: no compiler, or it failed.
    """

    def __init__(self, function: casadi.Function) -> None:
        super().__init__(function)
        inner = row_major(function)
        self._library = ctypes.CDLL(str(_build(_source(inner))))
        self._call = self._library.batch_all
        self._call.restype = None
        self._in_sizes = (ctypes.c_longlong * len(self.input_sizes))(*self.input_sizes)
        sizes = [rows * columns for rows, columns in self.output_shapes]
        self._out_sizes = (ctypes.c_longlong * len(sizes))(*sizes)

    def _evaluate(self, samples: int, arguments: list[Array], outputs: tuple[Array, ...]) -> None:
        pointers_in = (ctypes.c_void_p * len(arguments))(*(a.ctypes.data for a in arguments))
        pointers_out = (ctypes.c_void_p * len(outputs))(*(a.ctypes.data for a in outputs))
        self._call(ctypes.c_longlong(samples), pointers_in, self._in_sizes, pointers_out, self._out_sizes)


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
    """Finds the C compiler: its path, and a text that changes with its version and this machine.

    Raises:
        CompilerError: none is on the path.
    """
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        path = shutil.which(name) if name else None
        if path:
            version = subprocess.run([path, "--version"], capture_output=True, text=True, check=False).stdout
            return path, f"{version}|{platform.machine()}|{_processor()}"
    raise CompilerError("no C compiler (cc, gcc, clang) on the path")


def _processor() -> str:
    # -march=native code must not be reused on another processor that shares this home folder.
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), "")


def _source(function: casadi.Function) -> str:
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator("batch.c", {"with_header": False})
        generator.add(function)
        generator.generate(folder + os.sep)
        text = (Path(folder) / "batch.c").read_text(encoding="utf-8")
    sizes = {"n_in": function.n_in(), "n_out": function.n_out()}
    return text + _LOOP % {**sizes, "iw": max(1, function.sz_iw()), "w": max(1, function.sz_w())}


def _build(source: str) -> Path:
    path, identity = compiler()
    key = hashlib.sha256("\0".join((source, identity, *FLAGS)).encode()).hexdigest()[:32]
    for folder in (cache_folder(), Path(tempfile.gettempdir()) / f"robot-oed-{os.getuid()}"):
        library = folder / f"{key}.so"
        if library.exists():
            return library
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            _compile(path, source, library)
        except OSError as error:
            log.info("cannot keep compiled code in %s: %s", folder, error)
            continue
        return library
    raise CompilerError("no folder for compiled code can be written")


def _compile(path: str, source: str, library: Path) -> None:
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        code, built = Path(folder) / "batch.c", Path(folder) / "batch.so"
        code.write_text(source, encoding="utf-8")
        command = [path, *FLAGS, str(code), "-o", str(built), "-lm"]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode:
            raise CompilerError(f"{path} failed: {result.stderr.strip()[:500]}")
        # Another process may have built the same file meanwhile: replacing it is atomic and harmless.
        os.replace(built, library)

