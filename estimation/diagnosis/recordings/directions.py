"""Rows of a log in which the direction of a joint's motion is not known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.calibration import CREEP_SPEED, CREEP_TIME, MIN_SHARP_SPEED_SIGMAS, MIN_SPEED_SIGMAS
from estimation.regressions.preparation import SLOW
from robots.common.stretches import spans

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# A sign is tried as sharp as over this velocity [rad/s or m/s], a slow joint's over this share of its fastest. Rows
# slower than so many times that count for nothing: friction that turns round at once has no value of the model's there.
SHARP, SURELY = 0.0005, 3.0
# Two clocks are one within this share of a sample period.
ALIKE = 0.02
# Of a jump J of acceleration, a velocity known up to a frequency f is wrong by this times J / (2 pi f).
KICK = 0.3
# Rows to either side of a reversal that count for nothing: those that a kick spreads to, in this share of a period of
# the cut-off, so many at most. A kick below this share of the RMS acceleration is none.
BESIDE, SPREAD, NO_KICK = 3, 0.25, 0.02
# The largest jump, over the root mean square of all.
LARGER = 3.0
# Up to such a frequency [Hz] a position loop undoes what kicks do to a joint, which has then most of it about there.
LOOP = 25.0
# A position's noise beside reversals and elsewhere is as good as drawn anew after so many rows: a slow joint stays on
# a count of its encoder for some. It is compared where there are so many rows of each.
ANEW, FEWEST = 5, 200


@dataclass(frozen=True, eq=False)
class Directions:
    """What is known of the directions of a log's joints.

    Attributes:
        sign_unknown: rows (N, n) in which a joint's direction is not known, or not to be relied on beside its
            reversals.
        sign_known_from_velocity: those of them (N, n) in which the velocity tells it.
        reversal_acceleration_error: error of the accelerations (n,) beside reversals [rad/s2 or m/s2].
        reversal_time_error: how late joints may turn round (N, n) [s] by their velocities' error, where rows beside
            reversals count.
    """

    sign_unknown: Flags
    sign_known_from_velocity: Flags
    reversal_acceleration_error: Array
    reversal_time_error: Array

    def rows(self, kept: slice) -> Directions:
        """Gives what is known of some rows."""
        return replace(
            self,
            sign_unknown=self.sign_unknown[kept],
            sign_known_from_velocity=self.sign_known_from_velocity[kept],
            reversal_time_error=self.reversal_time_error[kept],
        )

    def spread(self, between: NDArray[np.intp]) -> Directions:
        """Takes no row as sure whose torque comes of two samples between which a joint may have turned round.

        Args:
            between: which two samples each row (N,) lies between, in order; -1 for one that is a sample itself.
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
    """Tells in which rows (N, n) of a log the direction of a joint's motion is known.

    Rows beside a reversal are not relied on, for a sharp sign turns round between samples: as many as a kick spreads
    to, and `BESIDE` of them where torque was not sampled at these rows. Clear are those where it was, and the velocity
    changes from row to row by more than `MIN_SHARP_SPEED_SIGMAS` errors and is itself as large: nearly all, with a fine
    encoder.

    Args:
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n).
        cutoffs: up to which they are known (n,) [Hz].
        floor: power density (n,) of the encoders' noise.
        ends: power density (n,) of the positions at the cut-offs.
        step: sample period [s].
        rest: what the positions (N, n) as logged have besides; None where positions and torque were measured between
            these rows.
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
        unsure[:, j] = (np.abs(v) < np.maximum(MIN_SPEED_SIGMAS * error, SLOW * speed)) | near
        change = np.abs(a) * step
        # A kick that does not stand out of the noise where it is looked for is still there; a joint at rest has none.
        usual = float(np.sqrt(np.average(error**2, weights=np.where(turned, change, 0.0) + 1e-300)))
        # It may be as large as the noise hides where it has most power, and as what is seen beside the reversals.
        hidden = KICK * largest / (2 * np.pi * cutoff) * (LOOP / cutoff) ** 2
        usual = max(usual, hidden if rest is None else min(hidden, _bound_reversal_velocity(rest[:, j], turned, step)))
        jolts[j] = 2 * np.pi * max(cutoff, LOOP) * usual
        error = MIN_SHARP_SPEED_SIGMAS * np.maximum(error, usual)
        least = np.maximum(error, np.maximum(ALIKE * change, SURELY * sharpest_sign_velocity(v)))
        clear[:, j] = sampled & (error < change) & (np.abs(v) > least)
        if (turned & (error < change)).any():
            # Reversals at which it is more do not count.
            late[:, j] = np.minimum(usual / np.maximum(np.abs(a), 1e-300), step / MIN_SHARP_SPEED_SIGMAS)
        for start, stop in spans(np.abs(v) < CREEP_SPEED * speed):
            if (stop - start) * step > CREEP_TIME:
                unsure[start:stop, j], clear[start:stop, j] = True, False
    return Directions(unsure, unsure & clear, jolts, late)


def _bound_reversal_velocity(rest: Array, turned: Flags, step: float) -> float:
    """Bounds what kicks do to a joint's velocity at its reversals by what its position (N,) has there besides.

    They move it by as much as that is larger than elsewhere, or would not be told to be; a position loop undoes them
    with its bandwidth, and what they last for is known by that.
    """
    reach = round(1.0 / (LOOP * step))
    near, around = (maximum_filter1d(turned.astype(np.int8), 2 * k * reach + 1) > 0 for k in (1, 2))
    if min(int(near.sum()), int((~around).sum())) < FEWEST:
        return np.inf
    usual, here = float(np.mean(rest[~around] ** 2)), float(np.mean(rest[near] ** 2))
    error = 2.0 * np.sqrt(2.0 * ANEW / int(near.sum())) * max(usual, here)
    return float(2 * np.pi * LOOP * np.sqrt(max(here - usual, 0.0) + error))


def sharpest_sign_velocity(dq: Array) -> float:
    """Gives the velocity over which a joint's sign is tried at its sharpest, by its velocities (N,)."""
    return SHARP * min(1.0, float(np.abs(dq).max(initial=0.0)))


def _error(ddq: Array, cutoff: float, floor: float, largest: float, step: float) -> Array:
    """Gives the error of a joint's velocity (N,) that is known up to a frequency f only.

    Friction that turns round kicks the joint: its acceleration (N,) jumps, and beside a jump J the velocity is wrong by
    `KICK` J / (2 pi f). Jumps at a rate r give the position a power of 2 r J^2 / (2 pi f)^6 per hertz, so that what it
    has at f bounds them: `largest`. Encoder noise of density `floor` adds to that.
    """
    reach = max(1, round(0.5 / cutoff / step))
    jump = np.zeros(len(ddq))
    if len(ddq) > 2 * reach:
        jump[reach:-reach] = np.abs(ddq[2 * reach :] - ddq[: -2 * reach])
    kick = KICK * maximum_filter1d(np.minimum(jump, largest), 2 * reach + 1) / (2 * np.pi * cutoff)
    return np.hypot(kick, 2 * np.pi * np.sqrt(floor * cutoff**3 / 3))
