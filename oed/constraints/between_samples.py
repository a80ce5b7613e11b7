"""What a trigonometric polynomial does between its samples: bounds for all times from finitely many values.

A series p(x) = mean + sum_l cosine_l cos(l x) + sine_l sin(l x) of degree N, sampled at M > 2N equidistant points of
its period, satisfies about any centre c

    max_x |p(x) - c| <= max_samples |p - c| / cos(pi N / M)

(Ehlich and Zeller, Schwankung von Polynomen zwischen Gitterpunkten, 1964). Limits that are tightened by that factor
and hold at the samples therefore hold always.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class TrigonometricPolynomial:
    """p_i(x) = mean_i + sum_l cosine_il cos(l x) + sine_il sin(l x), for several quantities i at once.

    Args:
        mean: (n,).
        cosine: (n, N).
        sine: (n, N).
    """

    mean: Array
    cosine: Array
    sine: Array

    @property
    def degree(self) -> int:
        """The number N of harmonics."""
        return self.cosine.shape[1]

    def __call__(self, x: ArrayLike) -> Array:
        """Evaluates all quantities at the angles x: (..., ) -> (n, ...)."""
        angle = np.asarray(x, dtype=np.float64)[..., None] * np.arange(1, self.degree + 1)
        shape = (-1,) + (1,) * (angle.ndim - 1)
        waves = np.cos(angle) @ self.cosine.T + np.sin(angle) @ self.sine.T
        return self.mean.reshape(shape) + np.moveaxis(waves, -1, 0)

    def derivative(self) -> TrigonometricPolynomial:
        """The derivative with respect to x."""
        order = np.arange(1, self.degree + 1)
        return TrigonometricPolynomial(
            mean=np.zeros_like(self.mean), cosine=order * self.sine, sine=-order * self.cosine
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Extremes:
    """The range of each quantity over its period.

    Args:
        lowest: (n,).
        highest: (n,).
        lowest_at: where, as a fraction 0..1 of the period, (n,).
        highest_at: where, as a fraction 0..1 of the period, (n,).
    """

    lowest: Array
    highest: Array
    lowest_at: Array
    highest_at: Array


def overshoot_factor(degree: int, samples: int) -> float:
    """The factor cos(pi N / M) by which limits shrink so that holding at the samples means holding always.

    Args:
        degree: N of the polynomial.
        samples: M, equidistant over the period.

    Returns:
        A number above 0 and at most 1.

    Raises:
        InputError: M <= 2N: the samples do not even determine the polynomial.
    """
    if samples <= 2 * degree:
        raise InputError(
            f"found {samples} samples a period for {degree} harmonics", allowed=f"at least {2 * degree + 1} samples"
        )
    return float(np.cos(np.pi * degree / samples))


def tightened_bounds(lower: ArrayLike, upper: ArrayLike, share: float) -> tuple[Array, Array]:
    """Shrinks bounds about their middle so that what keeps them at its samples keeps the given ones always.

    Args:
        lower: lower bounds, (n,); -inf where there is none.
        upper: upper bounds, (n,); +inf where there is none.
        share: of half their distance that is left, such as `overshoot_factor`.

    Returns:
        The bounds to impose at the samples, (n,) each.

    Raises:
        InputError: a quantity with only one bound, for which no such bound exists.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    lonely = np.isfinite(low) != np.isfinite(high)
    if np.any(lonely):
        raise InputError(
            "has a limit on one side only, which cannot be guaranteed between samples",
            joint=int(np.argmax(lonely)) + 1,
            allowed="a limit on both sides, or none",
        )
    bounded = np.isfinite(low)
    centre = np.where(bounded, (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)) / 2.0, 0.0)
    return centre + share * (low - centre), centre + share * (high - centre)


def sampled_bounds(values: ArrayLike, degree: int) -> tuple[Array, Array]:
    """Bounds for all times from the samples alone, without the coefficients.

    Args:
        values: samples at M equidistant points of the period, (M, n).
        degree: N of the polynomial.

    Returns:
        Guaranteed lower and upper bounds, (n,) each.
    """
    samples = np.asarray(values, dtype=np.float64)
    low, high = samples.min(axis=0), samples.max(axis=0)
    centre = (low + high) / 2.0
    factor = overshoot_factor(degree, samples.shape[0])
    return centre + (low - centre) / factor, centre + (high - centre) / factor


def certified_extremes(polynomial: TrigonometricPolynomial, samples: int = 4096) -> Extremes:
    """Encloses the range of a polynomial by Taylor's theorem, without any root finding.

    The largest sample is at most h/2 = pi/M away from the true extreme, where p' vanishes, so that it falls short by at
    most h^2/8 max|p''| <= (pi/M)^2 / 2 sum_l l^2 amplitude_l.

    Args:
        polynomial: of any degree.
        samples: M.

    Returns:
        Bounds that are never exceeded, and where the samples came closest.
    """
    x = 2.0 * np.pi * np.arange(samples) / samples
    values = polynomial(x)
    order = np.arange(1, polynomial.degree + 1)
    gap = (np.pi / samples) ** 2 / 2.0 * (np.hypot(polynomial.cosine, polynomial.sine) @ order**2)
    return Extremes(
        lowest=values.min(axis=1) - gap,
        highest=values.max(axis=1) + gap,
        lowest_at=values.argmin(axis=1) / samples,
        highest_at=values.argmax(axis=1) / samples,
    )


def exact_extremes(polynomial: TrigonometricPolynomial) -> Extremes:
    """Finds the range of a polynomial to rounding, from the roots of its derivative on the unit circle.

    With z = exp(i x), z^N p'(x) is an algebraic polynomial of degree 2N. The angles of all its roots (eigenvalues of
    the companion matrix) are candidates, improved by Newton's method; a false candidate does no harm, for p is
    evaluated there.

    Args:
        polynomial: of any degree.

    Returns:
        The range of each quantity, and where it is attained.
    """
    slope = polynomial.derivative()
    rows = []
    for number in range(polynomial.mean.size):
        one = TrigonometricPolynomial(
            mean=polynomial.mean[[number]], cosine=polynomial.cosine[[number]], sine=polynomial.sine[[number]]
        )
        half = (slope.cosine[number] - 1j * slope.sine[number]) / 2.0
        # Rounding errors in front would make the companion matrix useless. Newton's method corrects what is left out.
        half[np.abs(half) < 1e-14 * np.abs(half).max()] = 0.0
        roots = np.roots(np.concatenate([half[::-1], [0.0], half.conj()]))
        x = _polished(one, np.concatenate([[0.0], np.angle(roots)]))
        values = one(x)[0]
        low, high = int(values.argmin()), int(values.argmax())
        turns = np.mod(x / (2.0 * np.pi), 1.0)
        rows.append((values[low], values[high], turns[low], turns[high]))
    lowest, highest, lowest_at, highest_at = np.array(rows).T
    return Extremes(lowest=lowest, highest=highest, lowest_at=lowest_at, highest_at=highest_at)


def _polished(polynomial: TrigonometricPolynomial, x: Array, steps: int = 3) -> Array:
    """Newton steps towards p' = 0, short ones only: near a flat stretch a long step would leave for elsewhere."""
    slope = polynomial.derivative()
    curvature = slope.derivative()
    for _ in range(steps):
        rise, bend = slope(x)[0], curvature(x)[0]
        step = np.divide(-rise, bend, out=np.zeros_like(x), where=bend != 0.0)
        x = x + np.where(np.abs(step) < 0.1 / polynomial.degree, step, 0.0)
    return x


def series_polynomials(coefficients: ArrayLike, base_frequency: float) -> dict[str, TrigonometricPolynomial]:
    """Writes a joint-space Fourier series and its derivatives as trigonometric polynomials of x = w t.

    Args:
        coefficients: one row [q0, a1..aN, b1..bN] per joint as in thesis eq. 78, (n, 2N+1) [rad, rad/s].
        base_frequency: frequency of the first harmonic [Hz].

    Returns:
        The polynomials of `q`, `dq`, `ddq` and `dddq`, in rad and s.
    """
    rows = np.asarray(coefficients, dtype=np.float64)
    order = rows.shape[1] // 2
    w = 2.0 * np.pi * base_frequency * np.arange(1, order + 1)  # [rad/s]
    offset, a, b = rows[:, 0], rows[:, 1 : order + 1], rows[:, order + 1 :]
    zero = np.zeros_like(offset)
    return {
        "q": TrigonometricPolynomial(mean=offset, cosine=-b / w, sine=a / w),
        "dq": TrigonometricPolynomial(mean=zero, cosine=a, sine=b),
        "ddq": TrigonometricPolynomial(mean=zero, cosine=b * w, sine=-a * w),
        "dddq": TrigonometricPolynomial(mean=zero, cosine=-a * w**2, sine=-b * w**2),
    }


def series_extremes(coefficients: ArrayLike, base_frequency: float) -> dict[str, Extremes]:
    """Finds the exact range of position, velocity, acceleration and jerk of a joint-space Fourier series.

    Args:
        coefficients: one row [q0, a1..aN, b1..bN] per joint as in thesis eq. 78, (n, 2N+1) [rad, rad/s].
        base_frequency: frequency of the first harmonic [Hz].

    Returns:
        The ranges of `q`, `dq`, `ddq` and `dddq`, in rad and s.
    """
    polynomials = series_polynomials(coefficients, base_frequency)
    return {quantity: exact_extremes(polynomial) for quantity, polynomial in polynomials.items()}
