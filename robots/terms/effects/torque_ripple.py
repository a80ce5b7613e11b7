"""Torque ripple with the angle of gear or motor."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np
from scipy.ndimage import median_filter

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import AboveBand
from robots.terms.effect_bases.states import best_apart
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


HIGHEST = {"rad": 1000.0, "m": 10_000.0}
"""Highest order per turn, and highest wave number of a linear axis [rad/m]: four waves per turn of a screw with 3 mm
lead."""


class TorqueRipple(StaticJointEffect):
    """tau = (a + c l) cos(h p) + (b + d l) sin(h p), h in periods per turn (wave generator, teeth or motor poles).

    On a linear axis h is a wave number [rad/m] (ball screw, teeth of a rack or motor poles).

    l is the load [N m or N], which increases the ripple of a gear. The ripple of a motor's torque constant is
    proportional to the motor's torque instead, which includes friction. `friction_share` is 0 for the first and 1 for
    the second. p = q - dq T is the position a time T earlier. It matters for a ripple of 50 Hz and more, whose phase a
    delay of the logged torque shifts.

    All orders that the data resolve are searched, also without a known gear. Below an order of 2.5, or two waves over
    the joint's range, ripple resembles gravity and springs.
    """

    name: ClassVar[str] = "torque_ripple"
    title: ClassVar[str] = "torque ripple of gear or motor"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("order", "periods per turn", 2.5, HIGHEST["m"], "linear"),
        Shape("late", "s", -0.01, 0.01, "linear", (0.0,), default=0.0),
        Shape("friction_share", "", 0.0, 1.0, "linear", (0.0,), default=0.0, choices=(0.0, 1.0)),
    )
    rivals: ClassVar[tuple[str, ...]] = ("position_dependent_friction", "spring", "encoder_eccentricity")
    above_band: ClassVar[AboveBand] = AboveBand.COUNTS
    experiments: ClassVar[tuple[str, ...]] = ("sweep",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the amplitudes of cosine and sine, and their increase with the load."""
        assert joint is not None
        force = force_unit(robot, joint - 1)
        units = {"cosine": force, "sine": force, "cosine_per_load": "1", "sine_per_load": "1"}
        return tuple(Coefficient(name, unit) for name, unit in units.items())

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists orders half a resolution apart, up to the highest one that the slowest tenth of the samples resolves.

        The resolution is one period over the joint's range. For a known gear, once, twice and four times per motor
        turn are listed exactly.
        """
        assert joint is not None
        spacing, top = self._resolution(situation, joint)
        if not top:
            return ()
        low = self._lowest(situation, joint)
        # Largest number of orders on the grid: more than a joint resolves over one and a half turns.
        count = int(min(max((top - low) / spacing, 0), 1600))  # orders of a known gear may lie beyond
        orders = set((low + spacing * np.arange(count + 1)).tolist())
        orders |= {order for order in _of_gear(situation.robot, joint) if low <= order <= top}
        # Whole orders are more likely, so each replaces the grid points next to it.
        whole = {float(h) for h in range(3, 13) if low <= h <= top}
        return tuple(
            (order, 0.0, 0.0)
            for order in sorted({o for o in orders if all(abs(o - h) > spacing / 2 for h in whole)} | whole)
        )

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the order to the range that the samples resolve."""
        assert joint is not None
        lowest = self._lowest(situation, joint)
        _, *others = super().bounds(situation, joint)
        return (lowest, max(self._resolution(situation, joint)[1], lowest + 0.5)), *others

    def _lowest(self, situation: Situation, joint: int) -> float:
        """Returns the lowest order; with fewer waves over the joint's range a ripple resembles any smooth function."""
        reach = float(np.ptp(situation.q[:, joint - 1]))
        # Number of waves over the joint's range below which a ripple resembles gravity or a spring.
        fewest = 2 * np.pi * 2.0 / max(reach, 1e-9)
        return float(np.clip(fewest, self.shapes[0].lower, 0.5 * _highest(situation, joint)))

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists whole orders up to 12 near the fitted one and all orders of a known gear, without or with a delay.

        Each is listed for the load and for the motor torque. A periodic motion may not distinguish the order of a known
        gear from a distant one; the known order is then more likely.
        """
        assert joint is not None
        spacing = self._resolution(situation, joint)[0]
        low, high = self.bounds(situation, joint)[0]
        whole = [float(round(shape[0]))] if shape[0] < 12.5 else []
        built = [order for order in dict.fromkeys((*whole, *_of_gear(situation.robot, joint))) if low <= order <= high]
        near = [order for order in built if abs(order - shape[0]) <= spacing]
        far = [order for order in built if order not in near and order not in whole]
        forms = [(None, None), (None, 0.0), *((order, late) for order in near for late in (None, 0.0))]
        forms += [(order, 0.0) for order in far]
        return tuple((*form, share) for share in self.shapes[2].choices for form in forms)

    def _resolution(self, situation: Situation, joint: int) -> tuple[float, float]:
        """Returns the grid's spacing and its highest order; zeros for a joint that does not move."""
        q, speed = situation.q[:, joint - 1], np.abs(situation.dq[:, joint - 1])
        reach = float(np.ptp(q))
        moving = speed[speed > 1e-3 * speed.max(initial=0.0)]
        if reach < 1e-3 or len(moving) < 20:
            return 0.0, 0.0
        slow = float(np.quantile(moving, 0.1))
        # Least number of samples in a period of the ripple.
        top = 2 * np.pi / (2.5 * situation.period * slow)
        return np.pi / reach, float(min(top, _highest(situation, joint)))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks orders by the residual's spectrum over the joint angle, relative to its local level.

        Close neighbours of a proposed order are skipped. The orders of a known gear are always added.
        """
        assert joint is not None
        grid = self.grid(situation, joint)
        if len(grid) <= count:
            return grid
        orders = np.array([order for order, *_ in grid])
        power = angle_spectrum(situation.q[:, joint - 1], residual[:, joint - 1], orders, level=True)
        known = np.flatnonzero(np.isin(orders, _of_gear(situation.robot, joint)))
        # Neighbouring grid points, two per resolution, that belong to the spectral line of a proposed order.
        return tuple(grid[i] for i in dict.fromkeys([*best_apart(power, count, 2), *known.tolist()]))

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds cos(h p) and sin(h p), alone and times the load or the motor's torque."""
        angle = at.shape[0] * (at.q - at.dq * at.shape[1])
        wave = casadi.horzcat(casadi.cos(angle), casadi.sin(angle))
        return casadi.horzcat(wave, wave * (at.rigid + at.shape[2] * (at.torque - at.rigid)))

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        size, share = np.hypot(*coefficients[:2]), 100 * np.hypot(*coefficients[2:])
        often = f"{shape[0]:.4g} times per turn" if length == "rad" else f"every {2000 * np.pi / shape[0]:.4g} mm"
        much = f"{size:.3g} {force} and {share:.2g} % of its {'motor torque' if shape[2] else 'load'}"
        return f"The torque of joint {joint} ripples with an amplitude of {much}, {often}."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the position within the ripple's period."""
        assert joint is not None
        period = 2 * np.pi / shape[0]
        return (
            f"position of joint {joint} within 1/{shape[0]:.4g} turn [{length_unit(situation.robot, joint - 1)}]",
            situation.q[:, joint - 1] % period,
        )


def _of_gear(robot: Robot, joint: int) -> tuple[float, ...]:
    """Returns the orders of once, twice and four times per motor turn; none without a known gear."""
    ratio = abs(float(robot.gear_ratio[joint - 1]))
    return tuple(h * ratio for h in (1, 2, 4)) if ratio > 1 else ()


def _highest(situation: Situation, joint: int) -> float:
    return HIGHEST[length_unit(situation.robot, joint - 1)]


def angle_spectrum(q: Array, values: Array, orders: Array, *, level: bool = False) -> Array:
    """Computes the spectrum of values over the joint angle, |sum(values exp(-i h q))|^2, for each order h.

    The angle is binned, so that one fast Fourier transform gives all orders.

    Args:
        q: positions (N,) [rad or m].
        values: the series (N,).
        orders: the orders h (K,).
        level: whether to divide by the local level, a running median.

    Returns:
        The spectrum at the orders (K,).
    """
    reach = float(np.ptp(q)) or 1.0
    # With eight bins per period the highest order loses at most 5 % of its power; zero padding refines the resolution.
    bins = int(2 ** np.ceil(np.log2(max(8 * float(orders.max()) * reach / (2 * np.pi), 256))))
    sums = np.bincount(np.minimum(((q - q.min()) / reach * bins).astype(int), bins - 1), weights=values, minlength=bins)
    spectrum = np.abs(np.fft.rfft(sums, 4 * bins)) ** 2
    frequencies = 2 * np.pi * np.arange(len(spectrum)) / (4 * reach)
    if level:
        # Number of spectrum points, four per resolution, in the median that gives the local level around an order.
        spectrum /= np.maximum(median_filter(spectrum, 201, mode="nearest"), 1e-300)
    return np.interp(orders, frequencies, spectrum)
