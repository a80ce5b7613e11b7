"""Reads logs onto one uniform grid: low-passed motion, torque as measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.diagnosis.recordings.directions import ALIKE, find_directions
from estimation.diagnosis.recordings.position_spectra import Spectra, Spectrum, select_position_cutoff
from estimation.diagnosis.recordings.recording import Recording, cut_recording, join_recordings
from estimation.diagnosis.recordings.smoothed_motion import project_on_harmonics, remove_encoder_lines, smooth_motion
from estimation.diagnosis.recordings.thinning import decimate_recording, keep_clipped_level, low_pass_rows
from estimation.preprocessing import Cycle
from estimation.recordings.rows.columns import lattice_step
from estimation.regressions.preparation import Prepared, prepare, still_joints
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.forks import forked
from robots.robot import Robot
from robots.signals import Log

# Rows beyond which logs are low-passed and decimated by an integer: more rows only cost time.
MOST_ROWS = 20_000
# Rows up to which discontinuous terms, such as friction signs, are evaluated at the full rate.
MOST_FINE = 130_000
FASTEST = 260.0  # [Hz] faster sampling improves no effect of the catalogue
# Derivatives are less accurate at the ends of a log, where the filter lacks data. `LOST` periods of the cut-off are
# removed at each end, at most the share `MOST_LOST` of the log.
LOST, MOST_LOST = 4.0, 0.02
SHORTEST = 1.0  # [s] of rows without filter transients
# Tolerance, as a share of a period, within which a step is a whole number of periods.
WHOLE = 1e-3
# The mean over repetitions is used if its cut-off is higher than that of a single pass by this factor.
SHARPER = 1.2
# Rows at the ends in which all joints are slower than the share `SETTLED` of their RMS speed are removed, at most
# `ENDS` [s].
SETTLED, ENDS = 0.15, 2.0


def build_recording(
    robot: Robot,
    logs: Sequence[Log],
    *,
    step: float | None = None,
    travel: Array | float = 0.0,
) -> Recording:
    """Builds a recording on a uniform grid from logs, with noise removed from the motion.

    Positions of a periodic motion are projected on its harmonics. Other positions are low-passed joint by joint where
    their spectrum meets the encoder noise. The signal-to-noise ratio is then known at every frequency, for positions
    and derivatives.

    Args:
        robot: the robot.
        logs: logs with t, q and tau or current.
        step: sample period of the grid [s]; by default that of the slowest log, longer if there are too many rows.
        travel: position ranges of the joints (n,) in other logs [rad or m]; they show which joints rest in all of these
            logs.

    Returns:
        The recording of all logs, in the order of time.

    Raises:
        InputError: logs of another robot, without torque, too short, or overlapping in time.
    """
    prepared = sorted((prepare(robot, log) for log in logs), key=lambda log: float(log.log.t[0]))
    for before, after in pairwise(prepared):
        if after.log.t[0] <= before.log.t[-1]:
            raise InputError(
                "overlaps another log in time",
                file=after.log.metadata.get("file", after.log.name or None),
                column="t",
                allowed="one clock for all logs of a robot, one after the other",
                remedy="shift t by the time at which the log was recorded; where that is not known, --own-clocks or "
                "estimation.on_one_clock put the logs one after the other",
            )
    own, step = max(log.positions.period for log in prepared), _step(prepared) if step is None else step
    stride = round(step / own)
    whole = abs(step - stride * own) < WHOLE * own
    if stride > 1 and whole and sum(log.log.duration for log in prepared) / own <= MOST_FINE:
        return decimate_recording(build_recording(robot, logs, step=own, travel=travel), stride)
    spectra = [Spectra.of(log.positions) for log in prepared]
    found = [[of.of_positions(x) for x in log.positions.q.T] for of, log in zip(spectra, prepared, strict=True)]
    highest = np.max([[spectrum.cutoff() for spectrum in own] for own in found], axis=0)
    cap = select_position_cutoff(robot, prepared, highest)
    parts = forked(lambda each: _part(each[0], step, cap, *each[1:]), zip(prepared, spectra, found, strict=True))
    never = np.all([np.ptp(part.q, axis=0) == 0 for part in parts], axis=0)
    held = still_joints([part.q for part in parts], travel) | never
    joined = join_recordings([_zero_resting_joints(*each) for each in zip(parts, held, strict=True)])
    if joined.duration < SHORTEST:
        recorded = sum(log.log.duration for log in prepared)
        raise InputError(
            f"{joined.duration:.1f} s of usable logs ({recorded:.1f} s recorded, less filter transients at the ends)",
            file=prepared[0].log.metadata.get("file", prepared[0].log.name or None) if len(prepared) == 1 else None,
            allowed=f"{SHORTEST:g} s or more",
            remedy="record a longer log",
        )
    return replace(joined, names=tuple(log.log.name or f"log {i}" for i, log in enumerate(prepared, start=1)))


def _zero_resting_joints(part: Recording, held: NDArray[np.bool_]) -> Recording:
    """Sets the motion of resting joints (n,) of a log to zero and marks their rows.

    They still move by a few encoder steps, against static friction. Derivatives of these steps are accelerations that
    the other joints would seem to feel.
    """
    assert part.reversal_time_error is not None
    return replace(
        part,
        dq=np.where(held, 0.0, part.dq),
        ddq=np.where(held, 0.0, part.ddq),
        floor=np.where(held, 0.0, part.floor),
        sign_unknown=part.sign_unknown | held,
        sign_known_from_velocity=part.sign_known_from_velocity & ~held,
        reversal_acceleration_error=np.where(held, 0.0, part.reversal_acceleration_error),
        reversal_time_error=np.where(held, 0.0, part.reversal_time_error),
    )


def _step(prepared: Sequence[Prepared]) -> float:
    slowest = max(log.positions.period for log in prepared)
    rows = sum(log.log.duration for log in prepared) / slowest
    stride = max(1, int(np.ceil(1 / (slowest * FASTEST))), int(np.ceil(rows / MOST_ROWS)))
    return slowest * stride


def _part(log: Prepared, step: float, cap: float, spectra: Spectra, found: Sequence[Spectrum]) -> Recording:
    """Processes one log into a recording on the working grid.

    Positions above `cap` [Hz] are noise, whatever their power; `found` are the spectra of the positions.
    """
    period, grid = log.positions.period, log.positions.t
    positions = log.positions.q
    cutoffs = np.minimum([spectrum.cutoff() for spectrum in found], cap)
    q, dq, ddq = smooth_motion(positions, period, cutoffs)
    cycle = log.cycle
    if cycle is not None:
        rows = slice(cycle.start, cycle.stop)
        exact, known, repeated = project_on_harmonics(positions, period, cycle)
        # A single pass is better if the motion repeats less exactly than the encoder resolves.
        better = (known > SHARPER * cutoffs) & (known <= cap)
        rest = positions[rows] - exact[0]
        slow = smooth_motion(rest, period, np.array([spectra.of_positions(x).cutoff(none=0.0) for x in rest.T]))
        for whole, harmonic, other in zip((q, dq, ddq), exact, slow, strict=True):
            # Motion that does not repeat counts too, where it exceeds the noise.
            whole[rows] = np.where(better, harmonic + other, whole[rows])
        cutoffs = np.where(better, known, cutoffs)
    floor = np.array([spectrum.floor if cap == np.inf else spectrum.noise_at(cap) for spectrum in found])
    edge = min(LOST / float(cutoffs.min()), MOST_LOST * (grid[-1] - grid[0]))
    # Start at a sample: between two samples the time of a torque jump is unknown.
    begin = grid[0] + np.ceil(edge / period - 1e-9) * period
    count = int(np.floor((grid[-1] - edge - begin) / step + 1e-6)) + 1
    t = begin + step * np.arange(count)
    tau = _torque(log, step)(np.minimum(t, log.log.t[-1]))
    first = round((begin - grid[0]) / period)
    if abs(step - period) < 1e-9:
        states = [array[first : first + count] for array in (q, dq, ddq)]
    else:
        states = [CubicSpline(grid, array)(t) for array in (q, dq, ddq)]
    moved = None
    if cycle is not None:
        start = max(0, int(np.ceil((cycle.start - first) * period / step)))
        stop = min(count, int(np.floor((cycle.stop - first) * period / step)))
        moved = Cycle(start, stop, cycle.period, int((stop - start) * step / cycle.period + 0.1))
    if cycle is not None:
        floor = np.where(better, np.clip(repeated, floor / cycle.count, floor), floor)
    ends = [spectrum.at(float(cutoff)) for cutoff, spectrum in zip(cutoffs, found, strict=True)]
    beside = log.log.t[np.clip(np.searchsorted(log.log.t, t), 1, len(log.log.t) - 1) + np.array([[-1], [0]])]
    sampled = abs(step - period) < 1e-9 and bool(np.abs(beside - t).min(axis=0).max() < ALIKE * period)
    steps = np.array([lattice_step(x) for x in log.log.q.T])
    states[1:] = remove_encoder_lines(states[0], states[1], states[2], steps, step)
    besides = positions[first : first + count] - q[first : first + count] if sampled else None
    turns = find_directions(states[1], states[2], cutoffs, floor, np.maximum(ends, floor), step, besides)
    turns = turns.spread(_between(log.log.t, t, period))
    recording = Recording(
        t=t,
        starts=(0,),
        q=states[0],
        dq=states[1],
        ddq=states[2],
        tau=tau,
        step=step,
        cycles=(moved,),
        cutoff=float(cutoffs.min()),
        floor=floor,
        sign_unknown=turns.sign_unknown,
        sign_known_from_velocity=turns.sign_known_from_velocity,
        reversal_acceleration_error=turns.reversal_acceleration_error,
        names=(log.log.name,),
        reversal_time_error=turns.reversal_time_error,
        position_residual=besides,
        cutoffs=None if besides is None else cutoffs[None],
        payloads=() if log.log.payload is None else (np.array(log.log.payload),),
        gravity_fields=() if log.log.gravity is None else (log.log.gravity,),
    )
    return recording if moved is not None else cut_recording(recording, _trim_ends(states[1], step))


def _between(own: Array, t: Array, period: float) -> NDArray[np.intp]:
    """Returns the index of the sample pair that encloses each row (N,) of a grid; -1 for rows at a sample."""
    after = np.clip(np.searchsorted(own, t, side="right"), 1, len(own) - 1)
    on = np.minimum(np.abs(own[after] - t), np.abs(t - own[after - 1])) < ALIKE * period
    return np.where(on, -1, after)


def _torque(log: Prepared, step: float) -> _Interpolation:
    """Interpolates the torque as a function of time; low-passes it first if the grid is coarser than the log."""
    t, tau = log.log.t, log.tau
    period = log.positions.period
    if step > 1.5 * period:
        even = t[0] + period * np.arange(int((t[-1] - t[0]) / period + 1e-6) + 1)
        tau = np.column_stack([np.interp(even, t, column) for column in tau.T])
        t, tau = even, keep_clipped_level(tau, low_pass_rows(tau, step / period))
    return _Interpolation(t, tau)


class _Interpolation:
    """Linear interpolation between samples: it neither overshoots at a step nor rings."""

    def __init__(self, t: Array, values: Array) -> None:
        self.t, self.values = t, values

    def __call__(self, at: Array) -> Array:
        return np.column_stack([np.interp(at, self.t, column) for column in self.values.T])


def _trim_ends(dq: Array, step: float) -> slice:
    """Selects the rows without slow ends: near rest, stiction may hold any torque."""
    speed = np.sqrt(np.mean(dq**2, axis=0))
    active = np.flatnonzero((np.abs(dq) > SETTLED * np.maximum(speed, 1e-9)).any(axis=1))
    if not len(active):
        return slice(0, len(dq))
    most = int(min(ENDS / step, 0.05 * len(dq)))
    return slice(min(int(active[0]), most), max(int(active[-1]) + 1, len(dq) - most))
