"""What holds for every trajectory."""

import pickle

import numpy as np
import pytest

from oed.trajectories import (
    BSpline,
    Excitation,
    Family,
    FourierPolynomial,
    FourierSeries,
    PiecewisePolynomial,
    Segment,
    Sequence,
    Sinusoid,
    Sweep,
    Trajectory,
    WarmUp,
    friction_sweep,
    plan_warm_up,
    rest_basis,
)
from robots.common.errors import InputError
from robots.limits import Limits


def _limits(n: int) -> Limits:
    """Joints of three kinds in turn: wide, short and asymmetric, endless."""
    kinds = np.arange(n) % 3
    return Limits(
        lower=np.array([-2.9, -0.2, -np.inf])[kinds],
        upper=np.array([2.9, 1.3, np.inf])[kinds],
        velocity=np.array([4.0, 4.0, 7.0])[kinds],
        acceleration=np.array([16.0, 18.0, 32.0])[kinds],
        jerk=np.array([320.0, 360.0, 640.0])[kinds],
        torque=np.full(n, np.inf),
    )


def _fourier(n: int = 3) -> FourierSeries:
    free = np.random.default_rng(1).normal(size=(n, 9))
    return FourierSeries.from_coefficients(free @ rest_basis(5, 0.5).T, 0.5, periods=2)


def _excitation(family: Family, n: int) -> Excitation:
    free = np.random.default_rng(family.size).normal(size=(n, family.size))
    return Excitation(family=family, free=free, periods=2)


def _fourier_polynomial(n: int = 3) -> Excitation:
    return _excitation(FourierPolynomial(harmonics=4, base_frequency=0.5), n)


def _spline(n: int = 3) -> Excitation:
    return _excitation(BSpline(points=7, length=2.4), n)


def _friction(n: int = 3) -> Sweep:
    return friction_sweep(_limits(n), n, np.full(n, 0.4), period=0.004, pause=0.1)


def _warm_up(n: int = 3) -> WarmUp:
    return plan_warm_up(_limits(n), duration=20.0, period=0.004)


def _pausing_warm_up(n: int = 3) -> WarmUp:
    return plan_warm_up(_limits(n), duration=20.0, period=0.004, duty=0.6, block=7.0)


def _sinusoid(n: int = 3) -> Sinusoid:
    return Sinusoid(start=np.linspace(0.1, 1.0, n), joint=min(2, n), delta=-0.8, stroke_duration=0.4)


def _polynomial(n: int = 3) -> PiecewisePolynomial:
    # Jerk up, down, down and up: the joints move from rest to rest by 0, s, -2 s and so on.
    shape = np.array(
        [[0.0, 0.0, 0.0, 1.0], [0.001, 0.03, 0.3, -1.0], [0.006, 0.06, 0.0, -1.0], [0.011, 0.03, -0.3, 1.0]]
    )
    factors = np.arange(n) * (-2.0) ** np.arange(-1, n - 1)
    return PiecewisePolynomial(
        breakpoints=np.array([0.0, 0.1, 0.2, 0.3, 0.4]), coefficients=shape[:, None, :] * factors[:, None]
    )


def _sequence(n: int = 3) -> Sequence:
    series = _fourier(n)
    rest = PiecewisePolynomial.hold(series.sample([0.0]).q[0], 0.2)
    return Sequence(
        segments=(Segment(kind="move", trajectory=rest), Segment(kind="fourier", trajectory=series)), period=0.004
    )


ALL = [
    _fourier,
    _fourier_polynomial,
    _spline,
    _friction,
    _warm_up,
    _pausing_warm_up,
    _sinusoid,
    _polynomial,
    _sequence,
]


def _kinks(trajectory) -> np.ndarray:
    """Times at which the formula changes."""
    match trajectory:
        case Sinusoid():
            return np.array([trajectory.stroke_duration])
        case PiecewisePolynomial():
            return trajectory.breakpoints
        case Sequence():
            return trajectory.boundaries
        case Excitation(family=BSpline() as family):
            return np.concatenate([family.knots + turn * family.duration for turn in range(trajectory.periods)])
        case Excitation(family=family):
            return family.duration * np.arange(trajectory.periods)
        case Sweep():
            return trajectory.path.breakpoints
        case WarmUp():
            within = [
                cycle.duration * turn + cycle.breakpoints
                for cycle, repeats in zip(trajectory.cycles, trajectory.repeats, strict=True)
                for turn in range(repeats)
            ]
            return (trajectory.starts[:-1, None] + np.concatenate([*within, [trajectory.move]])).ravel()
        case _:
            return np.zeros(0)


@pytest.mark.parametrize("make", ALL)
def test_each_quantity_is_the_integral_of_the_next(make):
    """Position, velocity and acceleration grow by the integrals of velocity, acceleration and jerk."""
    trajectory = make()
    nodes, weights = np.polynomial.legendre.leggauss(24)
    marks = np.clip([0.0, *_kinks(trajectory), trajectory.duration], 0.0, trajectory.duration)
    edges = np.unique(np.concatenate([np.linspace(0.0, trajectory.duration, 40), marks]))
    a, b = edges[:-1], edges[1:]
    # A hair inside the edges: at a kink of the jerk either side counts, but not both.
    inside = (a + b)[:, None] / 2 + (b - a)[:, None] / 2 * nodes
    values = trajectory.sample(inside.ravel())
    edge_values = trajectory.sample(edges)
    for order in range(3):
        rate = values[order + 1].reshape(*inside.shape, trajectory.n)
        integral = np.einsum("k,ekn,e->en", weights, rate, (b - a) / 2)
        # 24 Gauss points integrate these analytic pieces exactly; what is left is rounding.
        scale = 1.0 + np.abs(edge_values[order]).max()
        np.testing.assert_allclose(np.diff(edge_values[order], axis=0), integral, atol=1e-12 * scale)


@pytest.mark.parametrize("make", ALL)
def test_it_rests_at_both_ends(make):
    """Velocity and acceleration vanish where it starts and where it ends."""
    trajectory = make()
    _, dq, ddq, _ = trajectory.sample([0.0, trajectory.duration])
    # Jerks of up to 1e4 rad/s^3 over the rounding of a time of 20 s.
    np.testing.assert_allclose(dq, 0.0, atol=1e-11)
    np.testing.assert_allclose(ddq, 0.0, atol=1e-10)


@pytest.mark.parametrize("make", ALL)
def test_it_can_be_chained(make):
    """It joins to a rest before and after it without a jump, in one experiment."""
    trajectory = make()
    ends = trajectory.sample([0.0, trajectory.duration]).q
    parts = (PiecewisePolynomial.hold(ends[0], 0.4), trajectory, PiecewisePolynomial.hold(ends[1], 0.4))
    chained = Sequence(segments=tuple(Segment(kind="move", trajectory=part) for part in parts), period=0.004)
    assert chained.duration == pytest.approx(trajectory.duration + 0.8)


@pytest.mark.parametrize("n", [1, 7])
@pytest.mark.parametrize("make", ALL)
def test_it_takes_any_number_of_joints(make, n):
    """One joint and seven joints move as three do, in whole controller periods."""
    trajectory = make(n)
    assert trajectory.n == n
    assert trajectory.motion(0.004).q.shape[1] == n
    assert all(values.shape == (2, n) for values in trajectory.sample([0.0, 0.3]))


@pytest.mark.parametrize("make", ALL)
def test_motion_holds_both_ends_at_the_period(make):
    """A sampled motion starts at zero, is uniform, and ends with the trajectory."""
    trajectory = make()
    motion = trajectory.motion(0.004)
    assert motion.t[0] == 0.0
    assert motion.period == pytest.approx(0.004, rel=1e-9)
    assert motion.t[-1] == pytest.approx(trajectory.duration, abs=1e-12)
    np.testing.assert_array_equal(motion.q, trajectory.sample(motion.t).q)
    assert motion.q.shape == (len(motion), trajectory.n)


@pytest.mark.parametrize("make", ALL)
def test_an_uneven_period_is_refused_with_a_remedy(make):
    """A duration that is no multiple of the period is an error that names the next one that is."""
    with pytest.raises(InputError, match="not a multiple of the sample period"):
        make().motion(0.0033)


@pytest.mark.parametrize("make", ALL)
def test_trajectories_survive_pickling(make):
    """A trajectory can be sent to another process and moves there as here."""
    trajectory = make()
    t = np.linspace(0.0, trajectory.duration, 17)
    for before, after in zip(trajectory.sample(t), pickle.loads(pickle.dumps(trajectory)).sample(t), strict=True):
        np.testing.assert_array_equal(before, after)


def test_all_families_are_in_the_suite():
    """No family of the package is left out of this file."""
    covered = {type(make()) for make in ALL}
    assert {member for member in _descendants(Trajectory) if member.__module__.startswith("oed.")} == covered


def _descendants(kind: type) -> set[type]:
    return {kind} - {Trajectory} | {item for child in kind.__subclasses__() for item in _descendants(child)}


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, np.inf])
def test_a_period_must_be_positive(period):
    """A sample period that is not a positive number is refused."""
    with pytest.raises(InputError, match="sample period"):
        _sinusoid().motion(period)
