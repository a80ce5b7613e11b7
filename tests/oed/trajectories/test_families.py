"""What holds for every family of optimised motions, and what each of them is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories import (
    FAMILIES,
    BSpline,
    Excitation,
    Family,
    Fourier,
    FourierPolynomial,
    Kinematics,
    check_family,
    family,
)
from robots.common.errors import InputError

NAMES = ("bspline", "fourier", "fourier-polynomial")
EACH = pytest.mark.parametrize("name", NAMES)


def test_these_are_the_families():
    """The command line offers these three."""
    assert tuple(FAMILIES) == NAMES


@EACH
@settings(deadline=None, max_examples=20)
@given(harmonics=st.integers(2, 9), frequency=st.floats(0.05, 2.0), seed=st.integers(0, 99))
def test_any_coefficients_rest_where_they_started(name, harmonics, frequency, seed):
    """Whatever the coefficients, a motion starts and ends in one pose, with no velocity and no acceleration."""
    made = family(name, harmonics=harmonics, base_frequency=frequency)
    free = np.random.default_rng(seed).normal(size=(2, made.size))
    motion = made.trajectory(free, periods=2)
    assert motion.duration == pytest.approx(2 / frequency)
    # Just inside the ends, too: a rate that only holds at the very end would be no rest.
    t = made.duration * np.array([0.0, 1e-9, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 2.0])
    q, dq, ddq, _ = motion.sample(t)
    steep = np.abs(motion.sample(np.linspace(0.0, motion.duration, 400)).dddq).max()
    np.testing.assert_allclose(q, np.broadcast_to(q[0], q.shape), atol=1e-8)
    assert np.abs(dq).max() <= 2e-9 * made.duration * steep * made.duration + 1e-9
    assert np.abs(ddq).max() <= 2e-9 * made.duration * steep + 1e-8


@pytest.mark.slow
@EACH
@settings(deadline=None, max_examples=25)
@given(harmonics=st.integers(2, 8), seed=st.integers(0, 10_000), order=st.integers(0, 3))
def test_shares_kept_at_the_samples_are_limits_kept_always(name, harmonics, seed, order):
    """A motion that reaches its share of a limit at the samples passes the limit nowhere between them."""
    made = family(name, harmonics=harmonics, base_frequency=0.3)
    samples = 40 * harmonics
    free = np.random.default_rng(seed).normal(size=made.size)
    free[0] = 0.0
    coarse = made.basis(made.limit_times(samples))[order] @ free
    fine = made.basis(np.linspace(0.0, made.duration, 20_001))[order] @ free
    share = made.shares(samples)[order]
    assert 0.9 < share < 1.0
    assert np.abs(fine).max() <= np.abs(coarse).max() / share


def test_the_measured_share_is_near_the_known_one_for_a_series():
    """Of a Fourier series both ways to a share exist: the measured one is the more cautious, by little."""
    made = Fourier(harmonics=5)
    (known, *_), measured = made.shares(250), Family.shares(made, 250)
    assert all(0.996 < share < known < 0.999 for share in measured)


@EACH
def test_families_have_about_as_many_coefficients(name):
    """All families of one size have 2 N - 1 coefficients a joint, the one with a polynomial two more."""
    made = family(name, harmonics=5, base_frequency=0.1)
    assert made.size == (11 if name == "fourier-polynomial" else 9)
    assert made.settings()["name"] == name
    check_family(made)


@EACH
def test_scale_brings_a_joint_to_its_limits(name):
    """Coefficients of one scale use some of the range and of the velocity, and are no hundred times either."""
    made = family(name, harmonics=5, base_frequency=0.1)
    scale = made.scale(np.array([2.0, np.pi]), np.array([3.0, 4.0]))
    assert scale.shape == (2, made.size)
    q, dq, *_ = made.basis(np.linspace(0.0, 10.0, 500))
    used = np.maximum(np.abs(q * scale[0]).max(axis=0) / 2.0, np.abs(dq * scale[0]).max(axis=0) / 3.0)
    assert np.all((used > 0.1) & (used < 100))


def test_spline_values_are_those_of_another_implementation():
    """Positions are those of casadi's own B-splines, and derivatives those of its automatic differentiation."""
    made = BSpline(points=6, length=3.0)
    free = np.random.default_rng(5).normal(size=made.size)
    controls = np.concatenate([[free[0]] * 3, free[0] + free[1:], [free[0]] * 3])
    t = casadi.MX.sym("t")
    q = casadi.bspline(t, casadi.DM(controls), [made.knots.tolist()], [5], 1, {})
    dq = casadi.jacobian(q, t)
    ddq = casadi.jacobian(dq, t)
    oracle = casadi.Function("f", [t], [q, dq, ddq, casadi.jacobian(ddq, t)])
    times = np.linspace(0.011, 2.987, 37)
    values = [matrix @ free for matrix in made.basis(times)]
    for index, time in enumerate(times):
        expected = [float(value) for value in oracle(time)]
        # Jerks of up to 1e4 rad/s^3 in double precision.
        np.testing.assert_allclose([value[index] for value in values], expected, rtol=1e-11, atol=1e-10)


def test_a_control_point_acts_locally():
    """A coefficient of a spline is exactly zero outside six knot intervals, in all derivatives."""
    made = BSpline(points=14, length=5.0)
    t = np.linspace(0.0, 5.0, 1001)
    interval = np.unique(made.knots)[1]
    for matrix in made.basis(t):
        for column in range(5, 10):
            busy = t[matrix[:, column] != 0.0]
            assert busy.max() - busy.min() <= 6 * interval + 1e-12


def test_the_polynomial_is_that_of_its_boundary_conditions():
    """Series and polynomial, solved from the six conditions and differentiated by casadi, give all four quantities."""
    rng = np.random.default_rng(0)
    offset, a, b, frequency = 0.3, rng.normal(size=4), rng.normal(size=4), 0.21
    made = FourierPolynomial(harmonics=4, base_frequency=frequency)
    t, w, duration = casadi.SX.sym("t"), 2 * np.pi * frequency, 1 / frequency

    def derivatives(q):
        dq = casadi.jacobian(q, t)
        ddq = casadi.jacobian(dq, t)
        return [q, dq, ddq, casadi.jacobian(ddq, t)]

    series = sum(
        a[k - 1] / (w * k) * casadi.sin(w * k * t) - b[k - 1] / (w * k) * casadi.cos(w * k * t) for k in range(1, 5)
    )
    ends = casadi.Function("s", [t], derivatives(series)[:3])
    x = casadi.SX.sym("x", 6)
    powers = sum(x[k] * t**k for k in range(6))
    rows = casadi.Function("r", [t], [casadi.jacobian(value, x) for value in derivatives(powers)[:3]])
    matrix = np.vstack([np.array(row) for time in (0.0, duration) for row in rows(time)])
    wanted = np.array([offset, 0.0, 0.0, offset, 0.0, 0.0])
    waves = np.array([float(value) for time in (0.0, duration) for value in ends(time)])
    solved = np.linalg.solve(matrix, wanted - waves)
    oracle = casadi.Function("f", [t], derivatives(series + sum(solved[k] * t**k for k in range(6))))
    times = np.linspace(0.0, duration, 41)
    values = [basis @ np.array([offset, *a, *b]) for basis in made.basis(times)]
    for index, time in enumerate(times):
        expected = [float(value) for value in oracle(time)]
        # The oracle's 6 by 6 system has a condition number of some 1e4.
        np.testing.assert_allclose([value[index] for value in values], expected, atol=1e-9)


@EACH
def test_the_basis_has_full_rank(name):
    """No coefficient is redundant: the columns are independent, the constant included."""
    made = family(name, harmonics=5, base_frequency=0.1)
    values = np.linalg.svd(made.basis(np.linspace(0.0, 10.0, 200)).q, compute_uv=False)
    # A quintic nearly is a slow wave; what is left of it is far above the rounding of 1e-16.
    assert values[-1] > 1e-5 * values[0]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: family("chirp"), "trajectory family 'chirp'.*bspline, fourier"),
        (lambda: Fourier(harmonics=1), "harmonics is 1"),
        (lambda: FourierPolynomial(base_frequency=0.0), "base frequency is 0"),
        (lambda: BSpline(points=0), "0 inner control points"),
        (lambda: BSpline(length=-1.0), "length of -1"),
        (lambda: Excitation(family=BSpline(), free=np.zeros((2, 3))), r"\(2, 3\).*allowed: \(n, 9\)"),
        (lambda: Excitation(family=BSpline(), free=np.zeros((2, 9)), periods=0), "0 periods"),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    """An unknown family and numbers out of range are errors that say what would do."""
    with pytest.raises(InputError, match=message):
        make()


@dataclass(frozen=True, kw_only=True)
class Broken(Family):
    """A spline whose basis is spoilt."""

    name: ClassVar[str] = "broken"
    fault: str = ""

    @classmethod
    def of_size(cls, harmonics: int, base_frequency: float) -> Broken:
        return cls()

    @property
    def size(self) -> int:
        return 9

    @property
    def duration(self) -> float:
        return 0.0 if self.fault == "duration" else 10.0

    def basis(self, t):
        q, dq, ddq, dddq = (matrix.copy() for matrix in BSpline().basis(t))
        x = np.asarray(t)[:, None] / 10.0
        match self.fault:
            case "shape":
                q = q[:, :-1]
            case "constant":
                q[:, 0] = 2.0
            case "end":
                q[:, 1:] += x
            case "moving":
                dq[:, 1:] += 1.0
            case "wrong derivative":
                ddq *= 2.0
            case "not finite":
                dddq[3] = np.nan
        return Kinematics(q, dq, ddq, dddq)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("duration", "lasts 0"),
        ("shape", r"shapes .*\(101, 8\).*allowed: four of \(101, 9\)"),
        ("constant", "first function of .* is not constant"),
        ("end", "does not end where it starts"),
        ("moving", "not at rest at both ends: its velocity"),
        ("wrong derivative", "the acceleration of .* is not the derivative"),
        ("not finite", "not finite"),
    ],
)
def test_an_own_family_with_a_fault_is_refused(fault, message):
    """Each fault of a basis is one message that names the family and the fault, before any search."""
    check_family(Broken())
    with pytest.raises(InputError, match=f"'broken'.*{message}|{message}.*"):
        check_family(Broken(fault=fault))
