import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from estimation import identify
from estimation.exports import c_code, export_c
from robots.common.errors import InputError


@pytest.fixture(scope="module")
def model(arm, arm_log):
    return identify(arm, arm_log()).model


def compiled(source, folder):
    compiler = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    if compiler is None:
        pytest.skip("no C compiler on the path")
    code, library = folder / "model.c", folder / "model.so"
    code.write_text(source)
    flags = ["-std=c99", "-Wall", "-Wno-unused", "-O2", "-ffp-contract=off", "-fPIC", "-shared"]
    subprocess.run([compiler, *flags, str(code), "-o", str(library), "-lm"], check=True, capture_output=True)
    return ctypes.CDLL(str(library))


def call(function, *arrays):
    n = arrays[0].shape[1]
    tau = np.empty_like(arrays[0])
    for k in range(len(tau)):
        rows = [(ctypes.c_double * n)(*array[k]) for array in arrays]
        out = (ctypes.c_double * n)()
        function(*rows, out)
        tau[k] = out[:]
    return tau


@pytest.mark.slow
def test_compiled_torque_and_gravity_equal_the_model(model, tmp_path):
    """The C code gives the model's torque, and the gravity of its links alone, to 1e-9."""
    library = compiled(c_code(model, prefix="arm"), tmp_path)
    rng = np.random.default_rng(0)
    q, dq, ddq = rng.uniform(-3, 3, (3, 50, 2))
    expected = model.torque(q, dq, ddq)
    # Sums of some hundred products of order ten, in another order.
    np.testing.assert_allclose(call(library.arm_torque, q, dq, ddq), expected, rtol=1e-9, atol=1e-9)
    values = np.where([column.term == "rigid_body" for column in model.parameters], model.values, 0.0)
    still = np.zeros_like(q)
    gravity = model.torque_model.torque(q, still, still, values, columns=model.columns)
    assert np.abs(gravity).max() > 1
    np.testing.assert_allclose(call(library.arm_gravity, q), gravity, rtol=1e-9, atol=1e-9)


def test_an_existing_file_is_kept(model, tmp_path):
    """A file that is there is replaced on request only."""
    path = tmp_path / "model.c"
    export_c(model, path)
    first = path.read_text()
    with pytest.raises(InputError, match="force"):
        export_c(model, path)
    export_c(model, path, prefix="other", force=True)
    assert "other_torque" in path.read_text()
    assert "robot_torque" in first
