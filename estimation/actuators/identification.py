"""The verb: identifies a robot's drives from what was commanded and measured, without torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.actuators.base_motion import is_situated, with_base
from estimation.actuators.effects import BY_NAME
from estimation.actuators.equation_error import started
from estimation.actuators.exports.expressible import expressible
from estimation.actuators.fitting import FINE, Fit, fit_drives, polished
from estimation.actuators.freedom import (
    Fleet,
    Freedom,
    FreeParameter,
    classes_of,
    free_parameters,
    shared_delay,
)
from estimation.actuators.options import ActuatorOptions
from estimation.actuators.result import Actuators, DriveValue, MotionError, Trace
from estimation.actuators.runs import Run, runs_of
from estimation.actuators.scale import scale_notes, with_constants, with_currents
from estimation.actuators.search import LoopFinding, search_effects
from estimation.actuators.simulated_error import Errors, prepare, rms, simulate_runs
from estimation.actuators.uncertainty import intervals, uncertainty_of
from estimation.logs.provenance import describe_logs
from robots.common.arrays import Array
from robots.common.errors import InputError, SolverError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.drives import Drive
from robots.robot import Robot
from robots.signals import Log
from robots.version import VERSION

BASIC = ("armature", "viscous", "coulomb", "torque_offset")
"""Parameters of every joint that are always identified, beside the delay of all."""
TRAINED = 0.7
"""Share of each run that is fitted where no log is held out."""
EXPLAINED_SHARE = 0.2
"""Largest share of what command and measurement differ by that a simulation may miss."""
ROUGH = 1e-3
"""Relative decrease of the cost at which the fit ends that effects are compared with."""
NEUTRAL = {
    "stribeck": 0.0,
    "load_coulomb": 0.0,
    "friction_cosine": 0.0,
    "friction_sine": 0.0,
    "dead_band": 0.0,
    "encoder_zero": 0.0,
    "ki": 0.0,
    "stop_lower": -1e3,
    "stop_upper": 1e3,
}
"""Values of what simulators do not express, see `expressible`."""
TRACED = 4000
"""Samples of a trace at most."""


@one_blas_thread()
def identify_actuators(
    robots: Robot | Sequence[Robot],
    logs: Log | Sequence[Log],
    drives: Sequence[Drive],
    *,
    held_out: Log | Sequence[Log] = (),
    options: ActuatorOptions | None = None,
    progress: Progress | None = None,
) -> Actuators:
    """Identifies delay, rotor inertia, friction and further effects of drives, with 95 % intervals.

    A fit of torques along the measured motion starts it (equation error). Then the closed loop is simulated, and its
    position error minimised by Gauss-Newton steps with exact derivatives (output error). Standard errors are those of
    coloured noise (sandwich), and at least those of a block bootstrap.

    Args:
        robots: the robot, or its chains from a base that is held, see `robots.drives.branches.load_branches`.
        logs: with commands, of all joints in the order of the chains. Currents, known payloads, and a base that moves
            or stands otherwise than described count.
        drives: what is known of the joints' drives, see `robots.drives.described_drives`.
        held_out: logs that nothing is fitted to. Without them the last part of each run is held out.
        options: settings.
        progress: hears how far it is.

    Returns:
        The drives.

    Raises:
        InputError: logs without commands, of other joints or units, or recorded too slowly; an unknown parameter.
        NotIdentifiableError: commands that do not change.
        SolverError: a loop that is not stable with the drives as described.

    Source: Ljung, System Identification, 1999, chapter 7 (output error); Kuensch 1989 (block bootstrap).
    """
    chosen, bar = options or ActuatorOptions(), progress or SILENT
    chains = [robots] if isinstance(robots, Robot) else list(robots)
    given = [logs] if isinstance(logs, Log) else list(logs)
    outside = [held_out] if isinstance(held_out, Log) else list(held_out)
    given, outside = [with_base(log) for log in given], [with_base(log) for log in outside]
    fleet = Fleet(chains, drives, situated=any(is_situated(log) for log in [*given, *outside]))
    runs, notes = runs_of(given, fleet)
    other, more = runs_of(outside, fleet) if outside else ((), ())
    other = tuple(replace(run, current=None) for run in other)
    freedom = _freedom(fleet, chosen)
    bar.start("fitting the drives", None)
    prepare(fleet)
    begun, ended = zip(*(run.cut(TRAINED) for run in runs), strict=True)
    fitted_runs, text = (runs, "held-out logs") if outside else (begun, f"the last {1 - TRAINED:.0%} of each run")
    seen: Sequence[Run] = other if outside else [replace(run, current=None) for run in ended]
    fitted_runs, said = with_currents(fitted_runs, fleet)
    plain = [replace(run, current=None) for run in fitted_runs]
    start = _start(freedom, plain, bar)
    findings: tuple[LoopFinding, ...] = ()
    if chosen.effects:
        trained, validated = zip(*(run.blocks() for run in plain), strict=True)
        first = fit_drives(freedom, start, trained, replace(chosen.fit, settled=ROUGH), bar)
        freedom, start, findings = search_effects(first, trained, validated, bar)
    if fitted_runs[0].current is not None:
        # Torques are simulated along a motion that is right already.
        start = fit_drives(freedom, start, plain, replace(chosen.fit, settled=ROUGH), bar).values
        freedom, start = with_constants(freedom, start, fitted_runs)
    fit = polished(fit_drives(freedom, start, fitted_runs, chosen.fit, bar), bar)
    bar.finish()
    notes = (*notes, *more, *said, *scale_notes(fit, fleet, start, fitted_runs), *_fit_notes(fit))
    return _result(fleet, fit, plain, seen, findings, notes, text, given, chosen)


def _freedom(fleet: Fleet, options: ActuatorOptions) -> Freedom:
    known = {name for drive in fleet.drives for name in drive.names}
    for name in options.free:
        if name not in known:
            raise InputError(f"no drive has a parameter {name!r}", allowed=", ".join(sorted(known)))
    classes = classes_of(fleet.names, options.share)
    further = tuple(dict.fromkeys((*BASIC, *options.free)))
    own = [name for name in further if name != "delay"]
    return Freedom(fleet=fleet, free=(shared_delay(fleet), *free_parameters(fleet, own, classes)))


def _start(freedom: Freedom, runs: Sequence[Run], progress: Progress) -> tuple[Array, ...]:
    """The better one of the torque fit and the description, by the simulated error."""
    fleet = freedom.fleet
    found: list[tuple[float, tuple[Array, ...]]] = []
    failed: SolverError | None = None
    for values in (started(freedom, fleet.values, runs), fleet.values):
        try:
            found.append((float(np.mean(rms(simulate_runs(fleet, values, runs)))), values))
        except SolverError as error:
            failed = error
    if not found:
        assert failed is not None
        raise failed
    best = min(found, key=lambda item: item[0])
    progress.update(0.0, f"start: {1e3 * best[0]:.3g} mrad")
    return best[1]


def _stands(finding: LoopFinding, fit: Fit, values: Sequence[DriveValue]) -> bool:
    """Whether an effect is still there after the fit of everything: its size, which cannot be below zero, is above."""
    for parameter, value in zip(fit.freedom.free, values, strict=True):
        if parameter.name == BY_NAME[finding.effect].free[0] and finding.joint - 1 in parameter.joints:
            return parameter.lower != 0.0 or value.lower > 0.0
    return True


def _fit_notes(fit: Fit) -> list[str]:
    return [] if fit.settled else ["the fit had not settled after the allowed iterations: allow more"]


def _limits(runs: Sequence[Run]) -> Array:
    """Errors (n,) above which a simulated motion is not explained, see `MotionError`."""
    differences = []
    for run in runs:
        command = np.column_stack([np.interp(run.t, run.log_t, column) for column in run.command.T])
        differences.append((run.q - command)[run.counted])
    deviation = np.sqrt(np.mean(np.concatenate(differences) ** 2, axis=0))
    noise = np.max([run.noise for run in runs], axis=0)
    return np.asarray(np.maximum(EXPLAINED_SHARE * deviation, 3.0 * noise))


def _result(
    fleet: Fleet,
    fit: Fit,
    runs: Sequence[Run],
    seen: Sequence[Run],
    findings: tuple[LoopFinding, ...],
    notes: tuple[str, ...],
    held_out: str,
    logs: Sequence[Log],
    options: ActuatorOptions,
) -> Actuators:
    reached = fit.freedom.fleet
    fitted_as_described = _described_errors(fleet, runs)
    seen_as_described, after = _described_errors(fleet, seen), simulate_runs(reached, fit.values, seen, refinement=FINE)
    errors = tuple(
        MotionError(name=name, described=a, fitted=b, held_out_described=c, held_out=d, limit=e)
        for name, a, b, c, d, e in zip(
            fleet.names,
            rms(fitted_as_described),
            fit.rms[: fleet.n],
            rms(seen_as_described),
            rms(after),
            _limits(seen),
            strict=True,
        )
    )
    drives, parameters = reached.with_values(fit.values), _parameters(fleet, fit, options.seed)
    result = Actuators(
        robot=fleet.robots[0].name,
        joints=fleet.names,
        law=tuple(_law(drive) for drive in drives),
        values=tuple(_plain(drive.values) for drive in drives),
        parameters=parameters,
        errors=errors,
        findings=tuple(finding for finding in findings if _stands(finding, fit, parameters)),
        notes=notes,
        held_out=held_out,
        traces=tuple(_trace(a, b) for a, b in zip(seen_as_described, after, strict=True)),
        success=fit.settled,
        provenance={
            "logs": describe_logs(logs),
            "share": list(options.share),
            "free": list(options.free),
            "tool_version": VERSION,
        },
        robots=fleet.robots,
        drives=tuple(drives),
    )
    return replace(result, written_error=_written_error(fleet, fit, result, seen))


def _written_error(fleet: Fleet, fit: Fit, result: Actuators, seen: Sequence[Run]) -> float:
    """Error of the drives as simulators express them."""
    fleet = fleet.rigid
    values = fleet.taken(fit.values, fit.freedom.fleet)
    for joint, friction in enumerate(expressible(result).friction):
        values = fleet.changed(values, "coulomb", [joint], float(friction))
    for name, neutral in NEUTRAL.items():
        having = [joint for joint in range(fleet.n) if name in fleet.drives[joint].names]
        values = fleet.changed(values, name, having, neutral)
    return float(np.mean(rms(simulate_runs(fleet, values, seen, refinement=FINE))))


def _described_errors(fleet: Fleet, runs: Sequence[Run]) -> list[Errors]:
    """The motion with the drives as described; that of the first position held where their loop is not stable."""
    try:
        return simulate_runs(fleet, fleet.values, runs)
    except SolverError:
        return [Errors(run=run, simulated=np.broadcast_to(run.q[:1], run.q.shape).copy()) for run in runs]


def _parameters(fleet: Fleet, fit: Fit, seed: int) -> tuple[DriveValue, ...]:
    free, known = fit.freedom.free, uncertainty_of(fit, seed)
    ends = intervals(fit.theta, known.standard_errors, fit.freedom.sizes)
    found = []
    for k, (parameter, (lower, upper)) in enumerate(zip(free, ends, strict=True)):
        status = "identified" if known.determined[k] else "not determined"
        if fit.at_bound[k] and known.determined[k]:
            status = "at its bound"
        found.append(
            DriveValue(
                parameter=parameter.name,
                group=parameter.group,
                joints=tuple(fleet.names[j] for j in parameter.joints),
                value=float(fit.theta[k] * parameter.size),
                standard_error=float(known.standard_errors[k] * parameter.size),
                lower=max(lower, parameter.lower),
                upper=min(upper, parameter.upper),
                unit=parameter.unit,
                described=float(
                    np.mean([fleet.drives[j].values.get(parameter.name, np.nan) for j in parameter.joints])
                ),
                status=status,
                partners=tuple(_name(free[m]) for m in known.partners[k]),
            )
        )
    return tuple(found)


def _name(parameter: FreeParameter) -> str:
    return f"{parameter.name} {parameter.group}"


def _law(drive: Drive) -> str:
    return next(member.name for member in drive.members if member.name in ("pd", "servo", "velocity", "cascade"))


def _plain(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}


def _trace(before: Errors, after: Errors) -> Trace:
    run = after.run
    share = slice(None, None, -(-len(run.t) // TRACED))
    command = np.column_stack(
        [column[np.clip(np.searchsorted(run.log_t, run.t, side="right") - 1, 0, None)] for column in run.command.T]
    )
    return Trace(
        name=run.name,
        t=run.t[share],
        measured=run.q[share],
        command=command[share],
        described=before.simulated[share],
        identified=after.simulated[share],
    )
