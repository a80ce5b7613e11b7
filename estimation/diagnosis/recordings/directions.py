"""Rows of a log in which the sign of a joint's velocity, and so of its friction, is unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.calibration import CREEP_SPEED, CREEP_TIME, MIN_SHARP_SPEED_SIGMAS, MIN_SPEED_SIGMAS
from estimation.regressions.preparation import SIGN_SPEED_SHARE
from robots.common.arrays import Array, Flags
from robots.common.stretches import spans

# Width v0 [rad/s or m/s] of the sharpest friction sign that is tried; for a slow joint, as a share of its largest
# speed. Rows slower than `SURELY` times that do not count: at a sudden reversal the model's friction is not defined
# there.
SHARP, SURELY = 0.0005, 3.0
# Time stamps that differ by less than this share of a sample period are the same sample.
ALIKE = 0.02
# A jump J of the acceleration causes an error of KICK J / (2 pi f) in a velocity known up to the frequency f.
KICK = 0.3
# Rows on either side of a reversal that do not count: as far as a jump of the acceleration spreads, `SPREAD` periods of
# the cut-off, and at most `BESIDE` rows. Jumps below the share `NO_KICK` of the RMS acceleration are neglected.
BESIDE, SPREAD, NO_KICK = 3, 0.25, 0.02
# Largest jump of the acceleration over the RMS of all jumps.
LARGER = 3.0
# Assumed bandwidth [Hz] of the position loop. It attenuates the response to friction jumps below this frequency, so
# that most of the response lies about it.
LOOP = 25.0
# Position noise is independent after this many rows, since a slow joint stays on one encoder count for some rows. The
# noise beside reversals is compared with the noise elsewhere if each has at least `FEWEST` rows.
ANEW, FEWEST = 5, 200


@dataclass(frozen=True, eq=False)
class Directions:
    """What a log determines about the direction of motion of its joints.

    Attributes:
        sign_unknown: rows (N, n) in which a joint's direction is unknown, or unreliable because of a reversal nearby.
        sign_known_from_velocity: those of them (N, n) in which the velocity still determines the sign.
        reversal_acceleration_error: error of the accelerations (n,) near reversals [rad/s2 or m/s2].
        reversal_time_error: error of the reversal times (N, n) [s] that follows from the error of the velocities; zero
            for joints whose rows near reversals never count.
    """

    sign_unknown: Flags
    sign_known_from_velocity: Flags
    reversal_acceleration_error: Array
    reversal_time_error: Array

    def spread(self, between: NDArray[np.intp]) -> Directions:
        """Marks rows whose torque is interpolated between two samples that enclose a reversal.

        Args:
            between: index of the sample pair that encloses each row (N,), in ascending order; -1 for rows at a sample.

        Returns:
            The directions, in which all rows of such a pair have an unknown sign.
        """
        inner = np.flatnonzero(between >= 0)
        if not len(inner):
            return self
        unsure = self.sign_unknown.copy()
        begins = np.flatnonzero(np.diff(between[inner], prepend=-1))
        found = np.logical_or.reduceat(unsure[inner], begins, axis=0)
        unsure[inner] = np.repeat(found, np.diff([*begins, len(inner)]), axis=0)
        return replace(
            self,
            sign_unknown=unsure,
            sign_known_from_velocity=self.sign_known_from_velocity & ~(unsure & ~self.sign_unknown),
        )


def find_directions(
    dq: Array, ddq: Array, cutoffs: Array, floor: Array, ends: Array, step: float, rest: Array | None
) -> Directions:
    """Finds the rows (N, n) of a log in which the direction of motion is known.

    Rows near a reversal are unreliable, since Coulomb friction changes sign between samples. Where torque was sampled
    at the rows of the grid, these are the rows over which a jump of the acceleration spreads. Otherwise they are
    `BESIDE` rows on either side.

    The velocity still determines the sign if torque was sampled at the rows and two conditions hold. It changes by more
    than `MIN_SHARP_SPEED_SIGMAS` errors per row, and it is itself larger than that. With a fine encoder this holds for
    nearly all rows.

    Args:
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n) [rad/s2 or m/s2].
        cutoffs: cut-off frequencies of the positions (n,) [Hz].
        floor: power density of the encoder noise (n,) [rad^2/Hz or m^2/Hz].
        ends: power density of the positions at the cut-offs (n,) [rad^2/Hz or m^2/Hz].
        step: sample period [s].
        rest: logged minus low-passed positions (N, n) [rad or m]; None if positions and torque were not sampled at
            these rows.

    Returns:
        The directions of motion, row by row.
    """
    sampled = rest is not None
    unsure, clear = np.zeros(dq.shape, dtype=bool), np.zeros(dq.shape, dtype=bool)
    jolts, late = np.zeros(dq.shape[1]), np.zeros(dq.shape)
    for j, cutoff in enumerate(np.maximum(cutoffs, 1e-3)):
        v, a = dq[:, j], ddq[:, j]
        speed = float(np.sqrt(np.mean(v**2)))
        turned = np.concatenate([v[1:] * v[:-1] < 0, [False]])
        rate = max(float(turned.sum()), 1.0) / (len(v) * step)
        largest = float(LARGER * np.sqrt(ends[j] / (2 * rate)) * (2 * np.pi * cutoff) ** 3)
        error = _error(a, cutoff, floor[j], largest, step)
        kicked = largest > NO_KICK * float(np.sqrt(np.mean(a**2)))
        beside = int(np.clip(np.ceil(SPREAD / (cutoff * step)) if kicked else 1, 1, BESIDE)) if sampled else BESIDE
        near = maximum_filter1d(turned.astype(np.int8), 2 * beside, origin=0) > 0
        unsure[:, j] = (np.abs(v) < np.maximum(MIN_SPEED_SIGMAS * error, SIGN_SPEED_SHARE * speed)) | near
        change = np.abs(a) * step
        # At each reversal the error is at least its RMS over all reversals: a jump may hide in the noise. A joint at
        # rest has no jumps, which the weights allow for.
        usual = float(np.sqrt(np.average(error**2, weights=np.where(turned, change, 0.0) + 1e-300)))
        # The jumps are bounded twice: by the encoder noise, which hides most about the loop's bandwidth, and by the
        # position residual near reversals.
        hidden = KICK * largest / (2 * np.pi * cutoff) * (LOOP / cutoff) ** 2
        usual = max(usual, hidden if rest is None else min(hidden, _bound_reversal_velocity(rest[:, j], turned, step)))
        jolts[j] = 2 * np.pi * max(cutoff, LOOP) * usual
        error = MIN_SHARP_SPEED_SIGMAS * np.maximum(error, usual)
        least = np.maximum(error, np.maximum(ALIKE * change, SURELY * sharpest_sign_velocity(v)))
        clear[:, j] = sampled & (error < change) & (np.abs(v) > least)
        if (turned & (error < change)).any():
            # Reversals with a larger error do not count.
            late[:, j] = np.minimum(usual / np.maximum(np.abs(a), 1e-300), step / MIN_SHARP_SPEED_SIGMAS)
        for start, stop in spans(np.abs(v) < CREEP_SPEED * speed):
            if (stop - start) * step > CREEP_TIME:
                unsure[start:stop, j], clear[start:stop, j] = True, False
    return Directions(unsure, unsure & clear, jolts, late)


def _bound_reversal_velocity(rest: Array, turned: Flags, step: float) -> float:
    """Bounds the velocity error [rad/s or m/s] that acceleration jumps cause at a joint's reversals.

    The position residual (N,) has more power near reversals than elsewhere. That excess, plus its standard error,
    bounds the motion that the low-pass removed. The loop's bandwidth converts it into a velocity. The bound is infinite
    if there are too few rows.
    """
    reach = round(1.0 / (LOOP * step))
    near, around = (maximum_filter1d(turned.astype(np.int8), 2 * k * reach + 1) > 0 for k in (1, 2))
    if min(int(near.sum()), int((~around).sum())) < FEWEST:
        return np.inf
    usual, here = float(np.mean(rest[~around] ** 2)), float(np.mean(rest[near] ** 2))
    error = 2.0 * np.sqrt(2.0 * ANEW / int(near.sum())) * max(usual, here)
    return float(2 * np.pi * LOOP * np.sqrt(max(here - usual, 0.0) + error))


def sharpest_sign_velocity(dq: Array) -> float:
    """Returns the width of the sharpest friction sign [rad/s or m/s] to try for a joint with velocities (N,)."""
    return SHARP * min(1.0, float(np.abs(dq).max(initial=0.0)))


def _error(ddq: Array, cutoff: float, floor: float, largest: float, step: float) -> Array:
    """Estimates the error (N,) of a joint's velocity that is known up to a frequency f only.

    Coulomb friction makes the acceleration (N,) jump at reversals. Near a jump J the error of the velocity is `KICK` J
    / (2 pi f). Jumps at a rate r give the position the power density 2 r J^2 / (2 pi f)^6. The power of the position at
    f therefore bounds the jumps by `largest`. Encoder noise of density `floor` adds to the error.
    """
    reach = max(1, round(0.5 / cutoff / step))
    jump = np.zeros(len(ddq))
    if len(ddq) > 2 * reach:
        jump[reach:-reach] = np.abs(ddq[2 * reach :] - ddq[: -2 * reach])
    kick = KICK * maximum_filter1d(np.minimum(jump, largest), 2 * reach + 1) / (2 * np.pi * cutoff)
    return np.hypot(kick, 2 * np.pi * np.sqrt(floor * cutoff**3 / 3))
