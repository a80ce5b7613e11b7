"""High-frequency band above each joint's usable band, for effects that do not depend on acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import firwin

from estimation.diagnosis.base_models.baseline import FAINT, Baseline
from estimation.diagnosis.calibration import MIN_HIGH_BAND
from estimation.diagnosis.noise_models.frequency_bands import TRANSITION, Band, low_pass
from estimation.diagnosis.noise_models.masked_rows import find_masked_rows
from estimation.diagnosis.noise_models.noise_spectrum import remove_lines
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.recording import Recording, rest_rows
from estimation.linear_algebra.orthonormal import orthonormal
from robots.common.arrays import Array

# Time [s] over which the noise level is averaged to find bursts.
BURST = 0.4
# Number of parts of the high band in which the noise level is estimated, and the fewest frequencies in one.
PARTS, FEWEST = 8, 10


@dataclass(frozen=True, eq=False)
class JointHighBand:
    """High-frequency band of one joint, as a weighted regression.

    Attributes:
        high_pass: filter for white rows: passes the high band and levels its noise.
        counts: weights of the rows (N',); zero where the direction of motion is unknown.
        base: orthonormal columns of the base model (N', b).
        residual: white torque after the base model was fitted to this band (N',).
        residual_of_band_fit: white torque minus the base model as fitted to the usable band (N',).
    """

    high_pass: Band
    counts: Array
    base: Array
    residual: Array
    residual_of_band_fit: Array


@dataclass(frozen=True, eq=False)
class HighBand:
    """A second regression above each joint's band, for effects that are searched `above_band`.

    Its noise is that of the residual in this band, unknown accelerations included. The base model is fitted anew for
    each joint, because the errors of friction and inertia differ from those in the usable band. For exogenous effects
    it is not fitted anew: the arm responds to them, and an inertia fitted to the response would absorb the effect.

    Attributes:
        whitening: whitening in a band that is far wider.
        joints: high band of each joint; None where the usable band leaves nothing above it.
        far_from_reversals: white rows (N',) in which no joint reverses nearby.
    """

    whitening: Whitening
    joints: tuple[JointHighBand | None, ...]
    far_from_reversals: NDArray[np.bool_]

    def columns(self, series: Array, joint: int, *, calm: bool = False, bare: bool = False) -> Array:
        """Whitens columns of a joint in its high band and projects the base model out.

        Args:
            series: the columns (N, k).
            joint: the joint, counted from 0.
            calm: whether only rows far from all reversals count, since each joint feels the acceleration errors of the
                others.
            bare: whether the base model is not projected out.

        Returns:
            White columns (N', k); no rows for a joint without high band.
        """
        above = self.joints[joint]
        if above is None:
            return np.zeros((0, series.shape[1]))
        counts = above.counts * self.far_from_reversals if calm else above.counts
        white = _passed(self.whitening, series, joint, above.high_pass) * counts[:, None]
        return white if bare else np.asarray(white - above.base @ (above.base.T @ white))

    def cross(self, columns: Array, joint: int, *, bare: bool = False) -> Array:
        """Multiplies columns (N', k) with the residual and returns the products (k,)."""
        above = self.joints[joint]
        if above is None:
            return np.zeros(columns.shape[1])
        return np.asarray(columns.T @ (above.residual_of_band_fit if bare else above.residual))

    def score_gradient(self, joint: int, rows: int, *, bare: bool = False) -> Array:
        """Computes the products of the residual in the high band with unit torques in each of a joint's rows (N,)."""
        above = self.joints[joint]
        if above is None:
            return np.zeros(rows)
        left = above.counts * (above.residual_of_band_fit if bare else above.residual)
        runs = _runs(left, self.whitening.starts, rows, self.whitening.stride)
        # A filter without delay is its own adjoint.
        return self.whitening.unfiltered(np.concatenate([above.high_pass.passed(run) for run in runs]), joint, rows)

    def regression(self, columns: Array, *, calm: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Builds the regression of columns in the high bands of the joints on which they act.

        Args:
            columns: columns (N, n, k).
            calm: columns (k,) for which only rows far from all reversals count.

        Returns:
            White columns (R, k) and white torque (R,).
        """
        rows, torque = [np.zeros((0, columns.shape[2]))], [np.zeros(0)]
        for j, above in enumerate(self.joints):
            if above is not None and columns[:, j].any():
                white = np.empty((len(above.residual), columns.shape[2]))
                for kind in np.unique(calm):
                    white[:, calm == kind] = self.columns(columns[:, j, calm == kind], j, calm=bool(kind))
                rows.append(white)
                torque.append(above.residual)
        return np.concatenate(rows), np.concatenate(torque)


def build_high_band(
    recording: Recording, baseline: Baseline, remainder: Array, noise: Array, bands: Sequence[Band], wide: Whitening
) -> HighBand:
    """Builds the regression above the joints' bands.

    Args:
        recording: the data.
        baseline: the base model.
        remainder: torque minus base model (N, n) [N m or N].
        noise: torque minus base model and known effects (N, n) [N m or N].
        bands: usable band of each joint.
        wide: whitening in wider bands.

    Returns:
        The high band of each joint.
    """
    # Rows near reversals get no weight after filtering: ripple continues through them, so they need no interpolation.
    wide = replace(wide, masked=find_masked_rows(recording.sign_unknown, recording.starts, rest_rows(recording.step)))
    joints: list[JointHighBand | None] = []
    for j, (band, wider) in enumerate(zip(bands, wide.bands, strict=True)):
        if band.cutoff > MIN_HIGH_BAND * wider.cutoff:
            joints.append(None)
            continue
        length = len(low_pass(band.cutoff, 1 / (recording.step * wide.stride), 1).taps)
        counts = _counts(wide, recording, j, length // 2)
        passing = _levelling(wide, recording, noise[:, j, None], counts, j, band.cutoff, length)
        left = _passed(wide, noise[:, j, None], j, passing)[:, 0] * counts
        counts *= _calmness(left, counts, round(BURST / (recording.step * wide.stride)))
        own = baseline.columns[:, j]
        base = orthonormal(_passed(wide, own[:, own.any(axis=0)], j, passing) * counts[:, None], FAINT)
        white = _passed(wide, remainder[:, j, None], j, passing)[:, 0] * counts
        joints.append(JointHighBand(passing, counts, base, white - base @ (base.T @ white), white))
    return HighBand(wide, tuple(joints), recording.far_from_reversals(wide.stride))


def _levelling(
    wide: Whitening, recording: Recording, noise: Array, counts: Array, joint: int, cutoff: float, length: int
) -> Band:
    """Builds a filter of a given length for the high band of a joint, in which noise (N, 1) gets unit density.

    Noise of unknown accelerations grows with the fourth power of frequency, which an autoregressive process describes
    only roughly. For a periodic motion, the noise at its harmonics counts. An encoder rounds each repetition alike, and
    an effect of the motion shows only at these harmonics.
    """
    rate = 1 / (recording.step * wide.stride)
    low, high = ((1 - TRANSITION / 2) * f for f in (cutoff, wide.bands[joint].cutoff))
    longest = max(_lines(recording, run)[0] for run in range(len(recording.runs)))
    parts = int(np.clip((high - low) * longest / FEWEST, 1, PARTS))
    edges = np.linspace(low, high, parts + 1)
    passes = [firwin(length, f, fs=rate, window=("kaiser", 6.0)) for f in edges]
    between = [Band(above - below, 1, float(high)) for below, above in pairwise(passes)]
    plain = Band(passes[-1] - passes[0], 1, float(high))
    white = _passed(wide, noise, joint, plain)[:, 0] * counts
    density, known = np.zeros(parts), 0
    for run, values in enumerate(_runs(white, recording.starts, len(recording), wide.stride)):
        period, first, repeats = _lines(recording, run)
        start, count = -(-first // wide.stride), max(int(repeats + 1e-6), 1)
        values = values[start : start + round(count * period * rate)]
        counted = int(np.count_nonzero(values))
        power = np.abs(np.fft.rfft(values)) ** 2 / max(counted, 1)
        f = np.fft.rfftfreq(len(values), 1 / rate)
        power = remove_lines(power[:, None], f[1], period if count > 1 else None)[:, 0]
        lines = np.arange(len(f)) % count == 0
        known += counted
        for part, (below, above) in enumerate(pairwise(edges)):
            inside = (f >= below) & (f < above)
            everywhere = float(power[inside].mean()) if inside.any() else 0.0
            at_lines = float(power[inside & lines].mean()) if (inside & lines).any() else everywhere
            # Scaled to the repetitions that remain: filters may remove part of one at the ends of a log.
            more = max(at_lines - everywhere, 0.0) * (repeats - 1.0) / (count - 1.0) if count > 1 else 0.0
            density[part] += (everywhere + more) * counted
    levels = np.sqrt(density / max(known, 1))
    taps = sum((band.taps / level for band, level in zip(between, levels, strict=True) if level > 0), np.zeros(length))
    return Band(taps, 1, float(high))


def _lines(recording: Recording, run: int) -> tuple[float, int, float]:
    """Returns a log's period [s], first periodic row and number of repetitions; the whole log if not periodic."""
    rows, cycle = recording.runs[run], recording.cycles[run]
    if cycle is not None:
        repeats = (cycle.stop - cycle.start) * recording.step / cycle.period
        if repeats >= 2 - 1e-6:
            return cycle.period, cycle.start, repeats
    return (rows.stop - rows.start) * recording.step, 0, 1.0


def _calmness(noise: Array, counts: Array, width: int) -> Array:
    """Returns weights of white rows (N',), at most one, that are lower in bursts of noise.

    A reversal of one joint accelerates the others. Acceleration errors therefore come in bursts, the same ones in each
    repetition of a motion.
    """
    near = uniform_filter1d(noise**2, width) / np.maximum(uniform_filter1d(counts**2, width), 1e-3)
    mean = float(np.sum(noise**2) / max(np.sum(counts**2), 1e-300))
    return np.asarray(1.0 / np.sqrt(np.maximum(near / max(mean, 1e-300), 1.0)))


def _runs(white: Array, starts: Sequence[int], rows: int, stride: int) -> list[Array]:
    """Splits white rows (N', ...) into those of each log."""
    lengths = [-(-(stop - start) // stride) for start, stop in pairwise((*starts, rows))]
    return np.split(white, np.cumsum(lengths)[:-1])


def _passed(wide: Whitening, series: Array, joint: int, passing: Band) -> Array:
    """Whitens columns (N, k) of a joint and filters them (N', k)."""
    runs = _runs(wide.filtered(series, joint), wide.starts, len(series), wide.stride)
    return np.concatenate([passing.passed(run) for run in runs])


def _counts(wide: Whitening, recording: Recording, joint: int, edge: int) -> Array:
    """Returns weights of a joint's white rows (N',), zero near rows in which its direction is unknown.

    They are also zero in the `edge` rows at the ends of a log, where the filter sees the torque begin and end. The
    weights act after the filters, which would otherwise turn slow torque into fast torque.
    """
    reach = int(np.ceil(0.5 / wide.bands[joint].cutoff / recording.step))
    parts = []
    for run in recording.runs:
        part = ~maximum_filter1d(recording.sign_unknown[run, joint], 2 * reach + 1)[:: wide.stride]
        part[:edge] = False
        part[max(len(part) - edge, 0) :] = False
        parts.append(part)
    counts = np.concatenate(parts).astype(float)
    return counts if wide.weights is None else counts * wide.weights[:, joint]
