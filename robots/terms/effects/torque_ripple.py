"""Torque that ripples with the angle of gear or motor."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.states import best_apart
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]

SAMPLES_PER_PERIOD = 2.5
"""A ripple that passes in fewer samples is not resolved."""
WAVES = 2.0
"""Waves over the joint's range below which a ripple looks like gravity or a spring."""
HIGHEST = {"rad": 1000.0, "m": 10_000.0}
"""Highest order per turn, and wave number of a linear axis [rad/m]: four waves a turn of a screw with 3 mm of lead."""
LARGEST = 1600
"""Largest number of orders on the grid: more than a joint resolves over one and a half turns."""
ABOUT = 201
"""Points of the spectrum, four per resolution, for the usual level around an order."""
APART = 2
"""Orders of the grid, two a resolution, beside one that is scanned: they are the same line."""


class TorqueRipple(StaticJointEffect):
    """tau = (a + c l) cos(h p) + (b + d l) sin(h p), h periods per turn: a wave generator's, the teeth's, the poles'.

    Of a linear axis h is a wave number [rad/m]: a ball screw's, a rack's teeth's, the poles' of its motor.

    l is the load [N m or N]: teeth mesh harder under it. A motor's constant ripples by a share of the motor's torque,
    which has all of the friction in it (`friction_share` 1, else 0: machines have the one or the other).
    p = q - dq T is the position a moment T before: a ripple of 50 Hz and more turns with what delays the torque's log.

    Orders are those that the data resolve, known gear or not. Below 3 per turn, or two waves over the joint's range,
    gravity and springs look alike.
    """

    name: ClassVar[str] = "torque_ripple"
    title: ClassVar[str] = "torque ripple of gear or motor"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("order", "periods per turn", 2.5, HIGHEST["m"], "linear"),
        Shape("late", "s", -0.01, 0.01, "linear", (0.0,), default=0.0),
        Shape("friction_share", "", 0.0, 1.0, "linear", (0.0,), default=0.0, choices=(0.0, 1.0)),
    )
    rivals: ClassVar[tuple[str, ...]] = ("position_dependent_friction", "spring", "encoder_eccentricity")
    independent_of_acceleration: ClassVar[bool] = True
    oscillates_over_range: ClassVar[bool] = True
    experiments: ClassVar[tuple[str, ...]] = ("sweep",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the two phases' amplitudes, and their growth with the load."""
        assert joint is not None
        force = force_unit(robot, joint - 1)
        units = {"cosine": force, "sine": force, "cosine_per_load": "1", "sine_per_load": "1"}
        return tuple(Coefficient(name, unit) for name, unit in units.items())

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists orders half a resolution apart, up to what a tenth of the samples is slow enough for.

        The resolution is a period over the joint's range. Of a known gear, once, twice and four times per motor turn
        are listed exactly.
        """
        assert joint is not None
        spacing, top = self._resolution(situation, joint)
        if not top:
            return ()
        low = self._lowest(situation, joint)
        count = int(min(max((top - low) / spacing, 0), LARGEST))  # a known gear's orders may lie beyond
        orders = set((low + spacing * np.arange(count + 1)).tolist())
        orders |= {order for order in _of_gear(situation.robot, joint) if low <= order <= top}
        # Whole orders are the likely ones: the nearest point of the grid moves to each.
        whole = {float(h) for h in range(3, 13) if low <= h <= top}
        return tuple(
            (order, 0.0, 0.0)
            for order in sorted({o for o in orders if all(abs(o - h) > spacing / 2 for h in whole)} | whole)
        )

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Keeps the order within what the samples resolve."""
        assert joint is not None
        lowest = self._lowest(situation, joint)
        _, *others = super().bounds(situation, joint)
        return (lowest, max(self._resolution(situation, joint)[1], lowest + 0.5)), *others

    def _lowest(self, situation: Situation, joint: int) -> float:
        """Gives the least order: fewer waves over the joint's range are no ripple but any smooth function."""
        reach = float(np.ptp(situation.q[:, joint - 1]))
        fewest = 2 * np.pi * WAVES / max(reach, 1e-9)
        return float(np.clip(fewest, self.shapes[0].lower, 0.5 * _highest(situation, joint)))

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists whole orders up to 12 within the resolution of an order, and those of a known gear; none is late.

        Each with the load and with the motor torque. A periodic motion may not distinguish a known gear's order from
        distant ones; the known one is more likely.
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
        """Gives the grid's spacing and its highest order; zeros for a joint that does not move."""
        q, speed = situation.q[:, joint - 1], np.abs(situation.dq[:, joint - 1])
        reach = float(np.ptp(q))
        moving = speed[speed > 1e-3 * speed.max(initial=0.0)]
        if reach < 1e-3 or len(moving) < 20:
            return 0.0, 0.0
        slow = float(np.quantile(moving, 0.1))
        top = 2 * np.pi / (SAMPLES_PER_PERIOD * situation.period * slow)
        return np.pi / reach, float(min(top, _highest(situation, joint)))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks all orders at once, by the residual's spectrum over the angle over that of their surroundings.

        Beside one that is listed no other is, but for those of a known gear, which are listed besides.
        """
        assert joint is not None
        grid = self.grid(situation, joint)
        if len(grid) <= count:
            return grid
        orders = np.array([order for order, *_ in grid])
        power = angle_spectrum(situation.q[:, joint - 1], residual[:, joint - 1], orders, level=True)
        known = np.flatnonzero(np.isin(orders, _of_gear(situation.robot, joint)))
        return tuple(grid[i] for i in dict.fromkeys([*best_apart(power, count, APART), *known.tolist()]))

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds cos(h p) and sin(h p), by themselves and times the load or the motor's torque."""
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
        """Gives the angle within the ripple's period."""
        assert joint is not None
        period = 2 * np.pi / shape[0]
        return f"position of joint {joint} within 1/{shape[0]:.4g} turn [rad]", situation.q[:, joint - 1] % period


def _of_gear(robot: Robot, joint: int) -> tuple[float, ...]:
    """Gives the orders of once, twice and four times per motor turn; none without a known gear."""
    ratio = abs(float(robot.gear_ratio[joint - 1]))
    return tuple(h * ratio for h in (1, 2, 4)) if ratio > 1 else ()


def _highest(situation: Situation, joint: int) -> float:
    return HIGHEST[length_unit(situation.robot, joint - 1)]


def angle_spectrum(q: Array, values: Array, orders: Array, *, level: bool = False) -> Array:
    """Gives |sum(values exp(-i h q))|^2 for each order h (K,), by binning the angle and one Fourier transform.

    Args:
        q: positions (N,) [rad].
        values: (N,).
        orders: (K,).
        level: whether over the median of the orders about each.
    """
    reach = float(np.ptp(q)) or 1.0
    # Eight bins a period of the highest order keep its power to 5 %; the length sets the transform's resolution.
    bins = int(2 ** np.ceil(np.log2(max(8 * float(orders.max()) * reach / (2 * np.pi), 256))))
    sums = np.bincount(np.minimum(((q - q.min()) / reach * bins).astype(int), bins - 1), weights=values, minlength=bins)
    spectrum = np.abs(np.fft.rfft(sums, 4 * bins)) ** 2
    frequencies = 2 * np.pi * np.arange(len(spectrum)) / (4 * reach)
    if level:
        spectrum /= np.maximum(median_filter(spectrum, ABOUT, mode="nearest"), 1e-300)
    return np.interp(orders, frequencies, spectrum)
