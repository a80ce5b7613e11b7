"""A delay between logged torque and logged position."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.interpolate import PchipInterpolator, make_interp_spline

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import AtReversals

if TYPE_CHECKING:
    from robots.robot import Robot


LEAST_SHIFT = 1e-5
"""Least step [s] of the difference quotient."""
LEAST_DELAY = 1e-4
"""Delay [s] below which it counts as zero: the time of a reversal within a sample is not known better."""
DELAY_RATIO = 1.6
"""Largest ratio between the delay and that of the reversals."""
# A delay also acts above the frequency band of the data, so it is underestimated by some per cent.
DELAY_ERROR = 0.05
SHIFT = Shape("reversals_late", "s", -0.02, 0.02, "linear", (-0.003, -0.001, -0.0002, 0.0002, 0.001, 0.003, 0.008))


class Late(Effect):
    """A delay of the logged torque: the shape is the delay at reversals, the coefficient that of all other data."""

    at_reversals: ClassVar[AtReversals] = AtReversals.LATE
    needs_full_rate: ClassVar[bool] = True

    def ties(self, coefficients: Array) -> tuple[tuple[int, int, float], ...]:
        """Ties the delay at reversals to the delay elsewhere: the range of `near` is taken as 95 %."""
        return ((0, 0, 0.5 * (DELAY_RATIO - 1.0 / DELAY_RATIO) * float(abs(coefficients[0]))),)

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Rejects a delay at the end of the range that the delay at reversals allows."""
        ends = [end for shift in shape for end in near(shift)[0]]
        torn = any(bool(np.isclose(coefficients[0], end, rtol=1e-6, atol=0.0)) for end in ends)
        return super().is_plausible(robot, joint, coefficients, shape) and not torn

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists a delay at reversals that equals the delay elsewhere."""
        return ((float(np.clip(coefficients[0], SHIFT.lower, SHIFT.upper)),),)


class TimeDelay(Late):
    """tau(t - d) - tau(t): the logged torque lags the logged position by d, equally on all joints.

    The torque change is d times a difference quotient over d', computed from the base model's torque and velocities at
    t - d'. Derivatives are not sufficient, because Coulomb friction changes sign within one sample. With a correct
    model d' = d.
    """

    name: ClassVar[str] = "time_delay"
    title: ClassVar[str] = "delay between torque and position"
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (SHIFT,)
    rivals: ClassVar[tuple[str, ...]] = ("current_lag", "presliding_hysteresis", "joint_elasticity")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the delay; no sensor has more than 50 ms."""
        return (Coefficient("delay", "s", -0.05, 0.05, DELAY_ERROR, LEAST_DELAY),)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Bounds the delay to values near that of the reversals."""
        return near(shape[0])

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the change of torque per delay (N, n, 1) [N m/s or N/s]."""
        return lateness(situation, shape[0])[:, :, None]

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
        which = "later" if coefficients[0] > 0 else "earlier"
        return f"Torque is logged {1000 * abs(coefficients[0]):.3g} ms {which} than position, on all joints."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the rate of torque of the joint where it is largest."""
        rate = -lateness(situation, shape[0])
        most = int(np.argmax(np.mean(rate**2, axis=0)))
        unit = force_unit(situation.robot, most)
        return f"rate of the torque of joint {most + 1} [{unit}/s]", rate[:, most]


def lateness(situation: Situation, shift: float) -> Array:
    """Computes the change of torque per delay, (tau(t - shift) - tau(t)) / shift.

    Without reversals this is close to -dtau/dt. The torque is that of the base model, and of other effects if the
    situation has them.

    Args:
        situation: the motion and the base model's torque (N samples).
        shift: delay of the difference quotient [s]; `LEAST_SHIFT` is used if its size is below that.

    Returns:
        (N, n) [N m/s or N/s].
    """
    step = shift if abs(shift) > LEAST_SHIFT else LEAST_SHIFT

    def evaluate() -> Array:
        smooth = situation.torque - situation.friction
        before, dq = np.empty_like(smooth), np.empty_like(smooth)
        for run, (torque, velocity) in zip(
            situation.runs, situation.cached("before", lambda: _past(situation, smooth)), strict=True
        ):
            past = _before(situation.t[run], step)
            before[run], dq[run] = torque(past), velocity(past)
        return (before - smooth + situation.friction_at(dq) - situation.friction) / step

    # Joints share the grid points, which are cached; points of a search are used once.
    own = situation.cached(("lateness", shift), evaluate) if shift in SHIFT.grid else evaluate()
    if situation.beyond is None:
        return own
    others = np.empty_like(own)
    for run in situation.runs:
        t, torque = situation.t[run], situation.beyond[run]
        # Linear interpolation, because this torque may jump between two samples.
        others[run] = make_interp_spline(t, torque, min(1, len(t) - 1))(_before(t, step)) - torque
    return own + others / step


def _before(t: Array, step: float) -> Array:
    return np.clip(t - step, t[0], t[-1])


def _past(situation: Situation, smooth: Array) -> list[tuple[Callable[[Array], Array], Callable[[Array], Array]]]:
    """Interpolates each log's torque without friction, and its velocities, between the samples.

    Velocities are interpolated by cubics without overshoot, which next to standstill would be a false reversal.
    """
    result: list[tuple[Callable[[Array], Array], Callable[[Array], Array]]] = []
    for run in situation.runs:
        t, count = situation.t[run], run.stop - run.start
        torque = make_interp_spline(t, smooth[run], min(3, count - 1))
        dq = situation.dq[run]
        # For a joint at rest the harmonic mean of tiny slopes overflows; its inverse is zero, as it should be.
        with np.errstate(over="ignore"):
            velocity = PchipInterpolator(t, dq, axis=0) if count > 1 else make_interp_spline(t, dq, 0)
        result.append((torque, velocity))
    return result


def near(shift: float) -> tuple[tuple[float, float], ...]:
    """Returns the range [s] of a delay for a given delay at reversals: within a factor of `DELAY_RATIO`.

    A difference quotient over a much longer time than the delay would contain the torque's second derivative.
    """
    low, high = sorted((shift / DELAY_RATIO, shift * DELAY_RATIO))
    return ((low - LEAST_SHIFT, high + LEAST_SHIFT),)
