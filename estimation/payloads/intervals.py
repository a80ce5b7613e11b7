"""95 % intervals of mass, centre of mass and inertia, from the covariance of the ten parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.payloads.body import central_inertia
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.common.plain import significant

AXES = "xyz"
MOMENTS = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
_UPPER = np.triu_indices(3)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One number of a payload.

    Attributes:
        name: such as ``mass`` or ``centre_x``.
        unit: of all values.
        value: of the physically consistent body.
        lower: of the 95 % interval; minus infinity where there is none.
        upper: of the 95 % interval; infinity where there is none.
        unconstrained: value of least squares without the constraint that the body can exist.
    """

    name: str
    unit: str
    value: float
    lower: float
    upper: float
    unconstrained: float

    @property
    def text(self) -> str:
        """The value, with the digits that are known."""
        return significant(self.value, self.half_width / NORMAL_95)

    @property
    def interval_text(self) -> str:
        """The 95 % interval, with the digits that are known."""
        error = self.half_width / NORMAL_95
        return f"{significant(self.lower, error)} to {significant(self.upper, error)}"

    @property
    def half_width(self) -> float:
        """Half the interval's width, in the unit."""
        return (self.upper - self.lower) / 2


def quantities(values: Array, covariance: Array, body: Array) -> tuple[Quantity, ...]:
    """Gives mass, centre of mass, and inertia about the centre of mass with their intervals.

    The intervals are those of least squares without constraints, which hold the truth as often as stated. The part
    that no body can have is cut off, which costs no coverage. An interval about a negative moment of inertia is moved
    to zero first, and one that excludes the consistent value is extended to it. The interval of the centre is
    Fieller's, so that a mass near zero makes it infinite.

    Args:
        values: least squares (10,).
        covariance: of the values (10, 10).
        body: the physically consistent parameters (10,); zeros if no payload was found.
    """
    spread = NORMAL_95 * float(np.sqrt(max(covariance[0, 0], 0.0)))
    if not body.any():
        free = [*values[:4], *central_inertia(values)[_UPPER]]
        units = [("mass", "kg"), *((f"centre_{axis}", "m") for axis in AXES), *((name, "kg m2") for name in MOMENTS)]
        none = [_quantity(name, unit, 0.0, own, -np.inf, np.inf) for (name, unit), own in zip(units, free, strict=True)]
        # An estimate below zero is moved to zero: no body has it.
        return _quantity("mass", "kg", 0.0, values[0], 0.0, max(values[0], 0.0) + spread), *none[1:]
    found = [_quantity("mass", "kg", body[0], values[0], values[0] - spread, values[0] + spread, 0.0)]
    for k, axis in enumerate(AXES, start=1):
        lower, upper = fieller(values[k], values[0], covariance[np.ix_([k, 0], [k, 0])])
        found.append(_quantity(f"centre_{axis}", "m", body[k] / body[0], values[k] / values[0], lower, upper))
    inertia, own = central_inertia(body)[_UPPER], central_inertia(values)[_UPPER]
    jacobian = _jacobian(body)
    widths = NORMAL_95 * np.sqrt(np.maximum(np.einsum("ip,pq,iq->i", jacobian, covariance, jacobian), 0.0))
    for name, value, free, width in zip(MOMENTS, inertia, own, widths, strict=True):
        lowest = 0.0 if name[1] == name[2] else -np.inf
        middle = max(free, lowest)
        found.append(_quantity(name, "kg m2", value, free, middle - width, middle + width, lowest))
    return tuple(found)


def fieller(above: float, below: float, covariance: Array) -> tuple[float, float]:
    """Gives the 95 % interval of the ratio of two means.

    It holds all r for which ``above - r below`` is not significant: ``(a - r b)^2 <= z^2 (1, -r) C (1, -r)'``
    (Fieller 1954, 10.1111/j.2517-6161.1954.tb00159.x).

    Args:
        above: a.
        below: b.
        covariance: of a and b (2, 2).

    Returns:
        Lower and upper end; both infinite where b itself is not significant.
    """
    z = NORMAL_95**2
    first = below**2 - z * covariance[1, 1]
    if first <= 0:
        return -np.inf, np.inf
    middle = above * below - z * covariance[0, 1]
    root = np.sqrt(max(middle**2 - first * (above**2 - z * covariance[0, 0]), 0.0))
    return float((middle - root) / first), float((middle + root) / first)


def _quantity(
    name: str, unit: str, value: float, free: float, lower: float, upper: float, lowest: float = -np.inf
) -> Quantity:
    lower, upper = min(max(lower, lowest), float(value)), max(upper, float(value))
    return Quantity(
        name=name, unit=unit, value=float(value), lower=float(lower), upper=float(upper), unconstrained=float(free)
    )


def _jacobian(parameters: Array) -> Array:
    """Derivatives (6, 10) of the inertia about the centre of mass."""
    columns = []
    for k in range(len(parameters)):
        step = np.zeros(len(parameters))
        # Step of the differences by which the inertia about the centre of mass is differentiated, over the mass.
        step[k] = 1e-6 * parameters[0]
        ahead, behind = (central_inertia(parameters + sign * step)[_UPPER] for sign in (1, -1))
        columns.append((ahead - behind) / (2 * step[k]))
    return np.array(columns).T
