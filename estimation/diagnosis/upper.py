"""The frequencies above a joint's band: there accelerations are not known, but torque that owes nothing to them is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.band import Band, low_pass
from estimation.diagnosis.baseline import FAINT, Baseline
from estimation.diagnosis.gaps import find_gaps, long_gap
from estimation.diagnosis.orthonormal import orthonormal
from estimation.diagnosis.periods import Cycle
from estimation.diagnosis.recording import Recording
from estimation.diagnosis.whitening import Whitening

Array = NDArray[np.float64]

# A joint whose band ends within this share of the wider one has nothing above it.
NEARLY = 0.8
# Above the bands, the error of the accelerations may have so many times the power of the torque noise: it is part of
# the noise there.
WIDER = 50.0


@dataclass(frozen=True, eq=False)
class Above:
    """What one joint's torque is above its band.

    Attributes:
        kept: low-pass of the joint's band, at the white rows: the rest is above it.
        counts: weights of the rows (N',): none for those whose direction of motion is not known.
        base: orthonormal columns of the base model (N', b).
        level: of the noise at the frequencies of what repeats, over that at all of them: an encoder rounds each
            repetition of a motion alike.
        residual: white torque that the base model leaves, over that level (N',).
    """

    kept: Band
    counts: Array
    base: Array
    level: float
    residual: Array


@dataclass(frozen=True, eq=False)
class Upper:
    """A second regression, in the frequencies above each joint's band, for effects that are `fast`.

    The noise is the residual's own there, with what unknown accelerations add to it. Each joint's columns of the base
    model are fitted anew, for what is left of friction and inertia there is not what they are below.

    Attributes:
        whitening: makes the noise white in a band that is far wider.
        joints: each joint's; None where its band leaves nothing above it.
    """

    whitening: Whitening
    joints: tuple[Above | None, ...]

    def columns(self, series: Array, joint: int) -> Array:
        """Whitens columns (N, k) of a joint, from 0, above its band and projects the base model out (N', k)."""
        above = self.joints[joint]
        if above is None:
            return np.zeros((0, series.shape[1]))
        white = _passed(self.whitening, series, joint, above.kept) * above.counts[:, None]
        return np.asarray(white - above.base @ (above.base.T @ white)) / above.level

    def cross(self, columns: Array, joint: int) -> Array:
        """Gives the products (k,) of such columns with the residual."""
        above = self.joints[joint]
        return np.zeros(columns.shape[1]) if above is None else np.asarray(columns.T @ above.residual)

    def regression(self, columns: Array) -> tuple[Array, Array]:
        """Gives the rows (R, k) of columns (N, n, k) above the bands of joints that they act on, and torque (R,)."""
        rows, torque = [np.zeros((0, columns.shape[2]))], [np.zeros(0)]
        for j, above in enumerate(self.joints):
            if above is not None and columns[:, j].any():
                rows.append(self.columns(columns[:, j], j))
                torque.append(above.residual)
        return np.concatenate(rows), np.concatenate(torque)


def pose_upper(
    recording: Recording, baseline: Baseline, remainder: Array, noise: Array, bands: Sequence[Band], wide: Whitening
) -> Upper:
    """Prepares the regression above the bands.

    Args:
        recording: the data.
        baseline: the base model.
        remainder: torque less base model (N, n) [N m or N].
        noise: that less what is known besides (N, n).
        bands: each joint's.
        wide: whitens the noise in wider bands.
    """
    # Rows beside reversals are left out after the filters: a ripple goes on through them, and need not be bridged.
    wide = replace(wide, gaps=find_gaps(recording.unsure, recording.starts, long_gap(recording.step)))
    rate = 1 / (recording.step * wide.stride)
    joints: list[Above | None] = []
    for j, (band, wider) in enumerate(zip(bands, wide.bands, strict=True)):
        if band.cutoff > NEARLY * wider.cutoff:
            joints.append(None)
            continue
        kept = low_pass(band.cutoff, rate, 1)
        counts = _counts(wide, recording, j, kept)
        level = _repeating(_passed(wide, noise[:, j, None], j, kept)[:, 0] * counts, recording, wide.stride)
        own = np.concatenate([baseline.regressor[:, j], baseline.nuisance[:, j]], axis=1)
        base = orthonormal(_passed(wide, own[:, own.any(axis=0)], j, kept) * counts[:, None], FAINT)
        white = _passed(wide, remainder[:, j, None], j, kept)[:, 0] * counts
        joints.append(Above(kept, counts, base, level, (white - base @ (base.T @ white)) / level))
    return Upper(wide, tuple(joints))


def _repeating(white: Array, recording: Recording, stride: int) -> float:
    """The noise's standard deviation at the harmonics of repeated motions over that at all frequencies, one at least.

    In white rows (N',), `stride` of the recording's in each. Logs that do not repeat count as they are.
    """
    coherent = total = 0.0
    for cycle, run in zip(recording.cycles, _runs(white, recording.starts, len(recording), stride), strict=True):
        power = float(run @ run)
        total += power
        coherent += power * (1.0 if cycle is None else _coherence(run, cycle, recording.step, stride))
    return max(1.0, float(np.sqrt(coherent / max(total, 1e-300))))


def _coherence(run: Array, cycle: Cycle, step: float, stride: int) -> float:
    """The power density at a cycle's harmonics over that at all frequencies: of noise that repeats, its repetitions."""
    repeats = (cycle.stop - cycle.start) * step / cycle.period
    whole = int(repeats + 1e-6)
    if whole < 2:
        return 1.0
    first = -(-cycle.start // stride)
    spectrum = np.abs(np.fft.rfft(run[first : first + round(whole * cycle.period / (step * stride))])) ** 2
    # Seen in whole repetitions, which the ends of a log may leave fewer of than there are.
    ratio = whole * float(spectrum[::whole].sum()) / max(float(spectrum.sum()), 1e-300)
    return 1.0 + (ratio - 1.0) / (whole - 1) * (repeats - 1.0)


def _runs(white: Array, starts: Sequence[int], rows: int, stride: int) -> list[Array]:
    """Splits white rows (N', ...) into those of each log."""
    lengths = [-(-(stop - start) // stride) for start, stop in pairwise((*starts, rows))]
    return np.split(white, np.cumsum(lengths)[:-1])


def _passed(wide: Whitening, series: Array, joint: int, kept: Band) -> Array:
    """Whitens columns (N, k) of a joint and takes off what is in its band (N', k)."""
    runs = _runs(wide.filtered(series, joint), wide.starts, len(series), wide.stride)
    return np.concatenate([run - kept.passed(run) for run in runs])


def _counts(wide: Whitening, recording: Recording, joint: int, kept: Band) -> Array:
    """Weights of a joint's white rows (N',).

    None beside rows in which its direction is not known, nor at the ends of a log, where the low-pass sees the torque
    begin and end. They come after the filters: before, they would turn slow torque into fast.
    """
    reach = int(np.ceil(0.5 / wide.bands[joint].cutoff / recording.step))
    edge = len(kept.taps) // 2
    parts = []
    for run in recording.runs:
        part = ~maximum_filter1d(recording.unsure[run, joint], 2 * reach + 1)[:: wide.stride]
        part[:edge] = False
        part[max(len(part) - edge, 0) :] = False
        parts.append(part)
    counts = np.concatenate(parts).astype(float)
    return counts if wide.weights is None else counts * wide.weights[:, joint]
