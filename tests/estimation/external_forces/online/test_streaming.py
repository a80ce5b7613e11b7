"""The observer sample by sample, and as C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from estimation.external_forces import ForceObserver, ForceOptions, estimate_forces
from estimation.external_forces.online.c_export import export_observer, observer_code
from estimation.models.extension import Extension
from robots.common.errors import InputError
from robots.thermal import FirstOrder

pytestmark = pytest.mark.slow
PUSH = (6.0, -5.0, 4.0)


@pytest.fixture(scope="module")
def banded(exact):
    """The exact model with a band, so that the parameters' errors count."""
    b = len(exact.values)
    band = {"band_covariance": (1e-4 * np.eye(b)).tolist(), "band_growth": [2.0] * 3, "band_reach": [0.02] * 3}
    return replace(exact, provenance={**exact.provenance, **band, "band95": [1.0] * 3})


@pytest.fixture(scope="module")
def touched(pushed_log):
    return pushed_log(2, ((8.0, 0.2, PUSH),), 12.0)


@pytest.fixture(scope="module")
def found(banded, pushed_log, touched):
    return estimate_forces(
        banded, touched, healthy=[pushed_log(11, duration=60.0)], options=ForceOptions(velocity="logged")
    )


@pytest.fixture(scope="module")
def readings(banded, found, touched):
    """The stream, with the friction level with which the log began."""
    observer = ForceObserver(banded, found.calibration)
    return observer, [observer.update(*sample) for sample in zip(*samples(touched), strict=True)]


def samples(log):
    return log.t.tolist(), log.q, log.dq, log.tau


def test_stream_finds_what_the_log_has(found, readings):
    """A stream flags the push within 30 ms of the log, nothing else, and gives its force.

    The log's friction level begins with its own first half minute, the stream's with none: the rest agrees.
    """
    _, stream = readings
    flagged = np.array([reading.contact for reading in stream])
    t = np.array([reading.t for reading in stream])
    assert t[flagged].min() == pytest.approx(found.contacts[0].detected, abs=0.03)
    assert ((t[flagged] > 7.9) & (t[flagged] < 8.5)).all()
    # One event: the flag rises once, and falls an observer's memory after the last exceedance.
    assert (np.diff(flagged.astype(int)) == 1).sum() == 1
    last = max(reading.t for reading in stream if reading.statistic > 1)
    assert t[flagged].max() == pytest.approx(last + found.calibration.memory, abs=0.01)
    at = int(np.searchsorted(t, 8.19))
    force, covariance = stream[at].force
    assert (np.abs(force - PUSH) < 5 * np.sqrt(np.diag(covariance)) + 0.2).all()
    np.testing.assert_allclose(stream[at].deviation, found.deviation[at], rtol=1e-6)
    np.testing.assert_allclose(stream[at].torque, found.torque[at], atol=0.05)
    assert stream[at].wrench[0].shape == (6,)


def test_level_of_friction_goes_on_after_a_restart(banded, found, readings, touched):
    """The level that one run left is where the next one begins."""
    observer, _ = readings
    level = observer.friction_excess.copy()
    other = ForceObserver(banded, found.calibration)
    other.reset(friction_excess=level)
    np.testing.assert_allclose(other.friction_excess, level)


def test_warm_friction_is_followed(banded, found, touched):
    """With a thermal model the stream has the friction of the temperature: alpha (T - T0) times what the model has.

    The robot starts 20 K warm with alpha = -0.01/K and hardly cools in a second, so the difference of the two streams'
    torque is 20 % of the friction, filtered; less what a second of the friction level follows, a thirtieth.
    """
    thermal = FirstOrder(alpha=-0.01, beta=1.0, K=5.0, C=50_000.0)
    cold, warm = (
        ForceObserver(banded, found.calibration),
        ForceObserver(banded, found.calibration, thermal=[thermal] * 3),
    )
    warm.reset(temperatures=[[40.0]] * 3)
    for sample in list(zip(*samples(touched), strict=True))[:125]:
        a, b = cold.update(*sample), warm.update(*sample)
    friction = cold._before
    moving = np.abs(touched.dq[60:125]).min(axis=0) > 0.05
    assert moving.any()
    ratio = (b.torque - a.torque)[moving] / friction[moving]
    np.testing.assert_allclose(ratio, -0.2, atol=0.04)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"dq": None}, "no velocities"),
        ({"q": [1.0, 2.0]}, "q is"),
        ({"tau": [1.0, np.nan, 0.0]}, "tau is"),
        ({"t": 0.5}, "times that increase"),
    ],
)
def test_bad_samples_are_named(banded, found, change, words):
    """Missing velocities, another number of joints, what is no number, and a clock that stands."""
    observer = ForceObserver(banded, found.calibration)
    sample = {"t": 1.0, "q": [0.1] * 3, "dq": [0.2] * 3, "tau": [1.0] * 3}
    observer.update(**sample)
    with pytest.raises(InputError, match=words):
        observer.update(**{**sample, "t": 1.1, **change})


def test_unsuitable_models_are_named(banded, found, touched):
    """Extensions and smoothed velocities do not go with a stream or C; a name in C has letters and digits."""
    effect = Extension(effect="stribeck", joint=1, shape=(0.1, 1.0), coefficients=np.array([1.0]), covariance=np.eye(3))
    smoothed = replace(found.calibration, velocity="smoothed")
    for build in (ForceObserver, observer_code):
        with pytest.raises(InputError, match="extensions"):
            build(replace(banded, extensions=(effect,)), found.calibration)
        with pytest.raises(InputError, match="smoothed velocities"):
            build(banded, smoothed)
    with pytest.raises(InputError, match="no name in C"):
        observer_code(banded, found.calibration, prefix="2nd")
    short = replace(found.calibration, errors=replace(found.calibration.errors, level=np.ones(2)))
    with pytest.raises(InputError, match="2 joints"):
        ForceObserver(banded, short)


def test_compiled_step_equals_python(banded, found, touched, tmp_path):
    """The C step, by the system's compiler, gives torque, deviation, statistic, flag and force of Python to 1e-9.

    It is asked with a gap in the clock, and with a friction factor of one.
    """
    compiler = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    if compiler is None:
        pytest.skip("no C compiler on the path")
    code, library = tmp_path / "observer.c", tmp_path / "observer.so"
    export_observer(banded, found.calibration, code, prefix="arm")
    with pytest.raises(InputError, match="force"):
        export_observer(banded, found.calibration, code)
    assert "malloc" not in code.read_text()
    flags = ["-std=c99", "-Wall", "-Wno-unused", "-O1", "-ffp-contract=off", "-fPIC", "-shared"]
    subprocess.run([compiler, *flags, str(code), "-o", str(library), "-lm"], check=True, capture_output=True)
    step, state = ctypes.CDLL(str(library)), ctypes.create_string_buffer(4096)
    step.arm_observer_reset(state)
    observer, flags_seen, known = ForceObserver(banded, found.calibration), 0, 0
    rows = [k for k in range(len(touched)) if not 300 <= k < 400]
    for k in rows[:1200]:
        arrays = [np.ascontiguousarray(x[k]) for x in (touched.q, touched.dq, touched.tau)]
        torque, deviation, force, statistic = np.empty(3), np.empty(3), np.empty(3), ctypes.c_double()
        factor = np.ones(3).ctypes.data_as(ctypes.c_void_p) if k % 2 else None
        outputs = [x.ctypes.data_as(ctypes.c_void_p) for x in (torque, deviation)]
        contact = step.arm_observer_step(
            state,
            ctypes.c_double(touched.t[k]),
            *(x.ctypes.data_as(ctypes.c_void_p) for x in arrays),
            factor,
            *outputs,
            ctypes.byref(statistic),
            force.ctypes.data_as(ctypes.c_void_p),
        )
        reading = observer.update(float(touched.t[k]), *arrays)
        flags_seen += contact
        assert bool(contact) == reading.contact
        np.testing.assert_allclose(torque, reading.torque, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(deviation, reading.deviation, rtol=1e-9)
        assert statistic.value == pytest.approx(reading.statistic, rel=1e-9, abs=1e-9)
        if not np.isnan(force).any():
            # Where the arm is nearly stretched a direction is felt ten thousand times less than the others.
            np.testing.assert_allclose(force, reading.force[0], rtol=1e-6, atol=1e-9)
            known += 1
    assert flags_seen > 20
    assert known > 1100
