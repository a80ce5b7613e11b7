"""The verb: checks a log before anything is fitted to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.checks.delays import Delay, delay_findings, estimate_delays
from estimation.gate.checks.excitation import HOPELESS, check_excitation
from estimation.gate.checks.jumps import check_jumps
from estimation.gate.checks.motion import check_motion, standing
from estimation.gate.checks.orientations import check_orientations
from estimation.gate.checks.repeats import check_repeats, without_hung
from estimation.gate.checks.resolution import check_clipping, check_resolution
from estimation.gate.checks.scales import check_scales, check_size
from estimation.gate.checks.signs import check_signs
from estimation.gate.checks.spikes import check_spikes
from estimation.gate.checks.stalls import check_stalls
from estimation.gate.checks.timing import Timing, check_timing
from estimation.gate.checks.units import beyond_findings, check_speed, suspect_position_unit
from estimation.gate.checks.values import (
    absurd_values,
    constant_torques,
    few_rows,
    notes_of_reader,
    once,
    same_columns,
    too_little,
    too_short,
)
from estimation.gate.checks.velocities import check_velocities
from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.excerpts import Excerpt, cutoffs, excerpts_of, stretch, stretches
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.joint_physics import joint_physics, mean_inertias
from estimation.gate.quick_fits.whole_fit import fit_all
from estimation.gate.report import FEWEST, GateReport, pick_rows, worst_first
from estimation.logs.known_setup import robot_for_log
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log

Array = NDArray[np.float64]

# Rows by which the smoothing is chosen, and without which nothing is fitted.
CHOICE_ROWS, FEWEST_ROWS = 1500, 60
# A higher cut-off is used if its error is at most this much worse (mean log): it shows inertias better; and
# for the delays, which a low one hides.
SLACK, SHARP_SLACK = 0.03, 0.3
# Improvement (mean log error) with another unit, from which it counts as the right one.
BETTER = 0.1


# Values of 1e300 overflow when they are squared: they are found and named, and never fitted.
@np.errstate(over="ignore", invalid="ignore")
def check_log(robot: Robot, log: Log) -> GateReport:
    """Checks sampling, sensors, units, signs, delay and excitation of a log.

    Every row is looked at for what a look can tell; delay, signs and excitation come from a quick fit of rigid body
    and friction, joint by joint, on stretches of some 24,000 rows in all, so that a long log takes little longer.

    Args:
        robot: the robot with n joints; limits, gear ratios and inertias are used where they are known.
        log: of n joints; without torque and current only the motion is checked.

    Returns:
        The findings, each with its number, severity, and what to do.

    Raises:
        InputError: a log of another number of joints.
    """
    file = str(log.metadata.get("file", log.name))
    if log.n != robot.n:
        raise InputError(f"{log.n} joints", file=file or None, allowed=f"{robot.n}, as {robot.name} has")
    robot = robot_for_log(robot, log)
    samples, duration = len(log), log.duration
    stalls = check_stalls(log)
    if stalls.findings:
        log = replace(log, t=stalls.t)
    columns = Columns.of(log)
    timing = check_timing(log, robot.period)
    repeats, copies = check_repeats(log, columns)
    findings: list[Finding] = [*too_short(log), *timing.findings, *stalls.findings, *repeats]
    findings += check_resolution(columns)
    found, spikes = check_spikes(columns)
    breaks = np.array([first for first, _ in timing.parts[1:]], dtype=np.intp)
    findings += [
        *found,
        *notes_of_reader(log),
        *check_clipping(columns),
        *constant_torques(columns),
        *same_columns(columns),
        *check_motion(robot, columns),
        *check_jumps(log.t, columns, spikes, breaks, standing(robot, columns)),
    ]
    stale = np.union1d(copies, stalls.lost)
    left_out = np.union1d(spikes, stale)
    if len(left_out):
        log = pick_rows(log, np.delete(np.arange(len(log)), left_out))
        columns = Columns.of(log)
    dynamics, found = _physics(robot, log, columns, check_timing(log, robot.period) if len(left_out) else timing)
    findings += found
    return GateReport(
        robot=robot.name,
        log=file,
        samples=samples,
        duration=duration,
        period=timing.period,
        findings=worst_first(once(findings)),
        parts=without_hung(timing.parts, findings),
        spikes=spikes,
        stale=stale,
        t=stalls.t,
        **dynamics,
    )


def _physics(robot: Robot, log: Log, columns: Columns, timing: Timing) -> tuple[dict[str, Array], list[Finding]]:
    """Looks at derivatives and torques of a log without spikes and copies."""
    dynamics: dict[str, Array] = {
        name: np.full(robot.n, np.nan) for name in ("delay", "delay_error", "unexplained", "information")
    }
    absurd = absurd_values(columns)
    if len(log) < FEWEST or absurd:
        return dynamics, absurd
    torque, factor = _in_newton_metres(robot, log)
    # A joint that stands has nothing to fit.
    spread = np.where(columns.varies & ~standing(robot, columns), columns.spread, 0.0) * factor
    looked = _look(robot, log, torque, timing, spread)
    findings = _positions(robot, log, columns, torque, timing, spread, looked)
    if looked.excerpts:
        findings += check_speed(robot, np.max([np.abs(part.dq).max(axis=0) for part in looked.excerpts], axis=0))
        findings += check_velocities(robot, looked.excerpts)
    if looked.rows is None and torque is not None and columns.varies.any() and columns.travel.any():
        findings.append(too_little(log, timing))
    if looked.rows is not None and torque is not None:
        findings += few_rows(log)
        dynamics, found = _dynamics(robot, columns, looked, timing.period, spread)
        findings += found
    return dynamics, findings


def _positions(
    robot: Robot,
    log: Log,
    columns: Columns,
    torque: Array | None,
    timing: Timing,
    spread: Array,
    looked: _Looked,
) -> list[Finding]:
    """Positions beyond the limits: in another unit, where that explains the torque better, or just beyond."""
    suspicion = suspect_position_unit(robot, columns)
    if suspicion is not None:
        convicted = suspicion.certain
        if not convicted and looked.rows is not None:
            other = _look(robot, replace(log, q=log.q / suspicion.factor), torque, timing, spread)
            convicted = other.cost < looked.cost - BETTER
        if convicted:
            return [suspicion.finding]
    return beyond_findings(robot, columns)


@dataclass(frozen=True, eq=False)
class _Looked:
    """The excerpts at the cut-off [Hz] that predicts left-out torque best.

    Attributes:
        excerpts: of the log.
        rows: all of them.
        cutoff: [Hz].
        cost: mean log of the error at it.
        sharp: the rows at a higher cut-off, if need be a little noisier: a low one hides a delay.
        sharp_cutoff: that cut-off [Hz].
    """

    excerpts: tuple[Excerpt, ...]
    rows: Rows | None
    cutoff: float
    cost: float = 0.0
    sharp: Rows | None = None
    sharp_cutoff: float = 0.0


def _look(robot: Robot, log: Log, torque: Array | None, timing: Timing, spread: Array) -> _Looked:
    found = (stretch(log, torque, piece, timing.period) for piece in stretches(timing.parts))
    pieces = [part for part in found if part is not None]

    def at(cutoff: float) -> tuple[Excerpt, ...]:
        return excerpts_of(pieces, timing.period, cutoff)

    candidates = cutoffs(timing.period)
    if torque is None:
        middle = candidates[len(candidates) // 2]
        return _Looked(at(middle), None, middle)
    joints = spread > 0
    tried: list[tuple[float, tuple[Excerpt, ...], float]] = []
    for cutoff in candidates:
        parts = at(cutoff)
        if sum(len(part.t) for part in parts) < FEWEST_ROWS or not joints.any():
            continue
        moments = Rows.of(robot, parts, CHOICE_ROWS).moments(np.flatnonzero(joints), raw=True)
        error = np.clip(fit_all(moments, spread).unexplained[joints], 1e-9, 1.0)
        cost = float(np.mean(np.log(error)))
        tried.append((cost, parts, cutoff))
    if not tried:
        return _Looked(at(candidates[-1]), None, candidates[-1])
    lowest = min(cost for cost, _, _ in tried)
    cost, parts, cutoff = [candidate for candidate in tried if candidate[0] <= lowest + SLACK][-1]
    rows = Rows.of(robot, parts)
    _, quick, sharp = [candidate for candidate in tried if candidate[0] <= lowest + SHARP_SLACK][-1]
    return _Looked(parts, rows, cutoff, cost, rows if sharp == cutoff else Rows.of(robot, quick), sharp)


def _dynamics(
    robot: Robot, columns: Columns, looked: _Looked, period: float, raw_spread: Array
) -> tuple[dict[str, Array], list[Finding]]:
    rows = looked.rows
    assert rows is not None
    prefix, joints = columns.prefix, raw_spread > 0
    fits = [rows.fit(j) if joints[j] else None for j in range(robot.n)]
    felt = mean_inertias(robot, rows)
    physics = [None if fit is None else joint_physics(rows, fit, j, felt[j]) for j, fit in enumerate(fits)]
    spread = np.array([rows.torque(j).std() if joints[j] else 0.0 for j in range(robot.n)])
    moments = rows.moments(np.flatnonzero(joints))
    # As it was logged: smoothing would take the noise away that hides a joint's torque.
    unexplained = fit_all(rows.moments(np.flatnonzero(joints), raw=True), raw_spread).unexplained
    whole = fit_all(moments, spread)
    gains = np.zeros(robot.n)
    if joints.sum() > 1:
        turned = 1.0 - 2.0 * np.eye(robot.n)
        gains = np.array([fit_all(moments.scaled(turned[j]), spread).cost - whole.cost for j in range(robot.n)])
    sharp = looked.sharp or rows
    explained = [j for j, fit in enumerate(fits) if fit is not None and unexplained[j] < HOPELESS]
    quick = {j: (fits[j] if sharp is rows else None) or sharp.fit(j) for j in explained}
    delays = estimate_delays(sharp, quick, period, looked.sharp_cutoff, unexplained)
    findings = check_signs(robot, rows, fits, physics, gains, prefix)
    if prefix == "tau":
        findings += check_scales(robot, moments, spread)
    if not findings:
        findings += check_orientations(robot, rows, raw_spread)
    findings += check_excitation(robot, physics, unexplained, prefix)
    if prefix == "tau":
        findings += check_size(robot, rows, fits, prefix, {finding.joint for finding in findings if finding.joint})
    findings += delay_findings(delays, period)
    sure = [delay if delay is not None and np.isfinite(delay.error) else Delay(np.nan, np.nan, 0.0) for delay in delays]
    return {
        "delay": np.array([delay.value for delay in sure]),
        "delay_error": np.array([delay.error for delay in sure]),
        "unexplained": unexplained,
        "information": np.array([np.nan if felt is None else felt.information for felt in physics]),
    }, findings


def _in_newton_metres(robot: Robot, log: Log) -> tuple[Array | None, Array]:
    """Torque (N, n) and its size over the logged signal's (n,); a current without a known constant stays one."""
    if log.tau is not None or log.current is None:
        return log.tau, np.ones(robot.n)
    constant = np.asarray(robot.torque_constant)
    constant = np.where(np.isfinite(constant), constant, 1.0)
    return log.current * constant, np.abs(constant)
