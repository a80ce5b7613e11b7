"""What sets the scale of torques where none is logged: gains, masses, a current, or a known payload."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from estimation.actuators.fitting import Fit
from estimation.actuators.freedom import Fleet, Freedom, FreeParameter
from estimation.actuators.runs import Run
from estimation.actuators.simulated_error import Errors, simulate_runs
from estimation.actuators.uncertainty import uncertainty_of
from robots.common.arrays import Array
from robots.common.errors import InputError

CONSTANT = "torque_constant"
APART = 0.2
"""Relative difference of two scales from which on it is said."""


def with_currents(runs: Sequence[Run], fleet: Fleet) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Keeps the currents of runs if all of them have varying ones in all joints; else drops them, with a note."""
    if not any(run.current is not None for run in runs):
        return tuple(runs), ()
    still = [
        name
        for j, name in enumerate(fleet.names)
        if not all(run.current is not None and np.ptp(run.current[:, j]) > 0 for run in runs)
    ]
    if not still:
        return tuple(runs), ()
    note = f"the current of {', '.join(still[:4])} does not change in every log: currents are not used"
    return tuple(replace(run, current=None) for run in runs), (note,)


def with_constants(freedom: Freedom, values: Sequence[Array], runs: Sequence[Run]) -> tuple[Freedom, tuple[Array, ...]]:
    """Frees the torque constants that nobody stated, and starts them from the simulated torque over the current.

    Args:
        freedom: what is free.
        values: of all parameters, at which the loop is simulated.
        runs: with currents.

    Raises:
        InputError: a current that falls where the torque rises.
    """
    fleet, found = freedom.fleet, tuple(values)
    unknown = [j for j in range(fleet.n) if fleet.of(values, j, CONSTANT) == 0.0]
    for joint, ratio in zip(unknown, constants(fleet, values, runs)[unknown], strict=True):
        if ratio <= 0:
            raise InputError(
                "the current falls where the torque of the drive rises",
                joint=fleet.names[joint],
                column=f"i{joint + 1}",
                remedy="state its sign in a mapping (--mapping): current: {sign: -1}",
            )
        found = fleet.changed(found, CONSTANT, [joint], float(ratio))
    asked = any(parameter.name == CONSTANT for parameter in freedom.free)
    if not unknown or asked:
        return freedom, found
    free = [
        FreeParameter(
            name=CONSTANT,
            group=fleet.names[joint],
            joints=(joint,),
            size=fleet.of(found, joint, CONSTANT),
            lower=0.0,
            upper=np.inf,
            unit="N m/A",
        )
        for joint in unknown
    ]
    return freedom.with_free(free), found


def constants(fleet: Fleet, values: Sequence[Array], runs: Sequence[Run]) -> Array:
    """Estimates torque constants (n,) by least squares of the simulated torque on the current."""
    one = fleet.changed(values, CONSTANT, range(fleet.n), 1.0)
    above, below = np.zeros(fleet.n), np.zeros(fleet.n)
    for part in simulate_runs(fleet, one, runs):
        assert part.run.current is not None
        current = part.run.current - part.run.current.mean(axis=0)
        torque = part.simulated[:, fleet.n :]
        above += (current * (torque - torque.mean(axis=0))).sum(axis=0)
        below += (current**2).sum(axis=0)
    return np.asarray(above / below)


def scale_notes(fit: Fit, described: Fleet, start: Sequence[Array], runs: Sequence[Run]) -> list[str]:
    """Says what sets the scale of the fitted values, and what a current or a payload determines beyond the motion.

    Args:
        fit: the last one.
        described: the fleet as described.
        start: values that this fit started from.
        runs: that were fitted.
    """
    free = {parameter.name for parameter in fit.freedom.free}
    gains = bool(free & {"kp", "kv", "kr"})
    current = all(run.current is not None for run in runs)
    stated = current and all(described.of(described.values, j, CONSTANT) > 0 for j in range(described.n))
    loaded = [bool(run.situations and any(around.body.any() for around in run.situations)) for run in runs]
    notes = []
    if gains and stated and CONSTANT not in free:
        notes.append("the stated torque constants set the scale: gains, friction and inertias are absolute")
    elif gains and any(loaded):
        notes.append("the known payload sets the scale: gains, friction and inertias are absolute")
    elif gains:
        notes.append(
            "no torque, no gains: the masses of the description set the scale of all torques, gains and inertias; if "
            "they are wrong by a factor, these are wrong by the same factor"
        )
    else:
        notes.append("no torque was logged: the stated gains set the scale of friction and inertia")
    if not gains and current and not stated:
        notes.append("torque constants follow from the stated gains; state them (torque_constant) to identify gains")
    if not gains and stated:
        ratio = constants(fit.freedom.fleet, start, runs) / [
            described.of(described.values, j, CONSTANT) for j in range(described.n)
        ]
        for name, value in zip(described.names, ratio, strict=True):
            if abs(value - 1) > APART:
                notes.append(
                    f"{name}: the torque of the stated gains is {value:.3g} times the current's with its stated torque "
                    "constant: one of both is wrong; identify the gains with --free kp,kd"
                )
    if current:
        notes += _owed(fit, "the current", lambda part: _without_current(part, described.n))
    if any(loaded) and not all(loaded):
        bare = {id(run) for run, has in zip(runs, loaded, strict=True) if not has}
        notes += _owed(fit, "the known payload", lambda part: part if id(part.run) in bare else None)
    return notes


def _owed(fit: Fit, to: str, reduced: Callable[[Errors], Errors | None]) -> list[str]:
    """Names the parameters that are determined only with a part of the data."""
    parts = tuple(part for part in map(reduced, fit.errors) if part is not None)
    if not parts:
        return []
    less = replace(fit, errors=parts, weights=fit.weights[: parts[0].error.shape[1]])
    with_all, without = uncertainty_of(fit).determined, uncertainty_of(less).determined
    names = [
        f"{parameter.name} {parameter.group}"
        for parameter, a, b in zip(fit.freedom.free, with_all, without, strict=True)
        if a and not b and parameter.name != CONSTANT
    ]
    return [f"determined by {to}, not by the motion alone: {', '.join(names)}"] if names else []


def _without_current(part: Errors, n: int) -> Errors:
    assert part.jacobian is not None
    run = replace(part.run, current=None)
    return replace(part, run=run, simulated=part.simulated[:, :n], jacobian=part.jacobian[:, :n])
