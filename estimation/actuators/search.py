"""Search for effects in the loop: scanned by derivatives, fitted by simulation, accepted by held-out error."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import uniform_filter1d

from estimation.actuators.effects import BY_NAME, EFFECTS, LoopEffect, Seen
from estimation.actuators.fitting import FLOOR, Fit, FitOptions, fit_drives, normal_equations
from estimation.actuators.freedom import Fleet, Freedom, FreeParameter, free_parameters
from estimation.actuators.runs import Run
from estimation.actuators.simulated_error import CHAINS, Errors, linearised_runs, rms, simulate_runs
from estimation.uncertainty.correlations import correlation_rows
from robots.common.arrays import Array
from robots.common.errors import SolverError
from robots.common.progress import SILENT, Progress

WORTH = 0.04
"""Share of a joint's squared error that an effect must promise to be fitted, and bring on held-out data."""
MOST = 0.5
"""Share that an effect must promise so that others, which derivatives do not show, need not be tried beside it."""
TRIED = 3
"""Alternatives of a joint that are fitted in a round: those that promise most."""
ROUNDS = 6
"""Rounds of the search on a chain: each may accept one effect per joint."""
FAINT = 0.3
"""Share of what an effect brought below which a promise is not tried beside it."""
SURE = 3.0
"""Standard errors by which the logarithm of the held-out squared error must fall."""
MEMORIES, FEWEST_BLOCKS, MOST_BLOCKS = 2, 6, 40
"""Length of a block in times of the error's memory, and the least and most blocks."""
QUIET = 2.0
"""Error of a joint, in times of its measurement's noise, up to which nothing is looked for."""
CLEAR = 1e-4
"""Error of a joint [rad or m] from which on an elastic gear is tried."""
SHORTER = 0.5
"""Steps of a simulation with an elastic gear, in usual ones: its flanks are stiff."""
SMOOTHED = 5
"""Samples over which speeds are averaged that only start a search."""
QUICK = FitOptions(iterations=6, rounds=1, settled=0.01)
"""Settings of the fits that compare effects."""
FINISHED = FitOptions(iterations=30, rounds=1, settled=1e-4)
"""Settings of the fit with an effect that was accepted, if that had not settled."""


@dataclass(frozen=True, kw_only=True)
class LoopFinding:
    """An effect that was found.

    Attributes:
        effect: its name.
        title: for people.
        joint: counted from 1.
        name: the joint's name.
        states: its values in words.
        before: held-out error of the joint without it [rad or m].
        after: with it.
        rivals: names of other effects that bring nearly as much, with their held-out errors.
    """

    effect: str
    title: str
    joint: int
    name: str
    states: str
    before: float
    after: float
    rivals: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Promise:
    joint: int
    effect: LoopEffect
    start: dict[str, float]
    share: float
    cost: float
    """What it takes off the chain's weighted squared error on fitted data; infinite where it is not known."""


_Trial = tuple[float, _Promise, Fit, list[Errors]]


def search_effects(
    fit: Fit, runs: Sequence[Run], held_out: Sequence[Run], progress: Progress = SILENT
) -> tuple[Freedom, tuple[Array, ...], tuple[LoopFinding, ...]]:
    """Looks for effects chain by chain.

    Args:
        fit: of the drives without them.
        runs: that were fitted.
        held_out: the same runs with the samples that were not fitted, see `Run.blocks`.
        progress: receives each finding.

    Returns:
        What is free with the effects, values to start a fit of all from, and the findings, strongest first.
    """
    fleet = fit.freedom.fleet
    freedom, values, findings = fit.freedom, list(fit.values), list[LoopFinding]()

    def searched(chain: int) -> tuple[Fleet, tuple[Array, ...], list[LoopFinding]]:
        columns = fleet.columns[chain]
        return _search_chain(
            fit.freedom.part(chain),
            (fit.values[chain],),
            [run.chain(chain, columns) for run in runs],
            [run.chain(chain, columns) for run in held_out],
            fit.weights[columns],
            progress,
        )

    chains = range(len(fleet.columns))
    parts = []
    for chain, (part, own, found) in enumerate(CHAINS.map(searched, chains)):
        columns = fleet.columns[chain]
        values[chain] = own[0]
        parts.append(part)
        findings += [replace(finding, joint=int(columns[finding.joint - 1]) + 1) for finding in found]
    dynamics = [part.dynamics[0] for part in parts]
    fleet = Fleet(fleet.robots, [drive for part in parts for drive in part.drives], dynamics)
    freedom = replace(freedom, fleet=fleet)
    for finding in findings:
        joint, effect = finding.joint - 1, BY_NAME[finding.effect]
        alone = {fleet.names[joint]: (joint,)}
        freedom = freedom.with_free(free_parameters(fleet, effect.free, alone, [joint]))
    findings.sort(key=lambda finding: finding.after - finding.before)
    return freedom, tuple(values), tuple(findings)


def _search_chain(
    freedom: Freedom,
    values: tuple[Array, ...],
    runs: Sequence[Run],
    held_out: Sequence[Run],
    weights: Array,
    progress: Progress,
) -> tuple[Fleet, tuple[Array, ...], list[LoopFinding]]:
    accepted: list[LoopFinding] = []
    geared: dict[int, Fleet] = {}
    now = linearised_runs(freedom, values, runs)
    outside: list[Errors] = [replace(part, run=run) for part, run in zip(now, held_out, strict=True)]
    for _ in range(ROUNDS):
        taken = {(finding.joint - 1, finding.effect) for finding in accepted}
        weights = np.maximum(rms(now), FLOOR) ** -2
        smooth, bent = _promises(freedom, values, runs, now, weights, taken, geared)
        best: _Trial | None = None
        trials: list[_Trial] = []
        rivals: list[tuple[int, str, float]] = []
        for derivatives in (True, False):
            if not derivatives and best is not None and smooth[0].share > MOST:
                break
            for promise in smooth if derivatives else bent():
                if best is not None and promise.cost < FAINT * best[0]:
                    # An effect does not bring many times what its derivatives promise.
                    continue
                trial = _fitted(freedom, values, runs, promise, weights, geared)
                if trial is None:
                    continue
                seen = _outside(trial, held_out)
                gain = _gain(outside, seen, promise.joint, weights)
                rivals.append((promise.joint, promise.effect.name, float(rms(seen)[promise.joint])))
                trials.append((gain, promise, trial, seen))
                if gain > 0 and (best is None or gain > best[0]):
                    best = trials[-1]
        if best is None:
            break
        _, promise, trial, seen = _plainest(best, trials, weights)
        if promise.effect.gear is not None:
            # Flanks need shorter steps.
            runs, held_out = ([replace(run, coarseness=SHORTER) for run in part] for part in (runs, held_out))
        if not trial.settled or promise.effect.gear is not None:
            # What an unfinished fit leaves would look like another effect.
            trial = fit_drives(trial.freedom, trial.values, runs, FINISHED, weights=weights)
            seen = _outside(trial, held_out)
        finding = _finding(trial.freedom, promise, trial, outside, seen, rivals)
        accepted.append(finding)
        progress.update(0.0, f"{finding.name}: {finding.title}")
        if promise.effect.gear is not None:
            geared.clear()
        freedom, values, outside = trial.freedom, trial.values, seen
        now = list(trial.errors)
    return freedom.fleet, values, accepted


def _outside(fit: Fit, held_out: Sequence[Run]) -> list[Errors]:
    """Errors of a fit on the samples that were not fitted."""
    return [replace(part, run=run, jacobian=None) for part, run in zip(fit.errors, held_out, strict=True)]


def _plainest(best: _Trial, trials: Sequence[_Trial], weights: Array) -> _Trial:
    """Prefers a special case of the best trial, with fewer parameters, unless the best one is surely better."""
    _, promise, _, seen = best
    for trial in trials:
        effect = trial[1].effect
        plainer = set(effect.free) < set(promise.effect.free) and effect.gear == promise.effect.gear
        same = trial[1].joint == promise.joint and trial[0] > 0
        if plainer and same and not _gain(trial[3], seen, promise.joint, weights):
            return trial
    return best


def _promises(
    freedom: Freedom,
    values: tuple[Array, ...],
    runs: Sequence[Run],
    now: Sequence[Errors],
    weights: Array,
    taken: set[tuple[int, str]],
    geared: dict[int, Fleet],
) -> tuple[list[_Promise], Callable[[], list[_Promise]]]:
    """What effects would take off a joint's squared error by derivatives, most first; and what gives the others."""
    fleet = freedom.fleet
    costs = np.array([sum(float((part.error[:, j] ** 2).sum()) for part in now) for j in range(fleet.n)]) * weights
    found: list[_Promise] = []
    starts: dict[tuple[int, str], Sequence[dict[str, float]]] = {}
    noise = np.max([run.noise for run in runs], axis=0)
    for joint in np.flatnonzero(rms(now) > QUIET * noise).tolist():
        known = {name: fleet.of(values, joint, name) for name in fleet.drives[joint].names}
        q = np.concatenate([run.q[:, joint] for run in runs])
        dq = np.concatenate([uniform_filter1d(np.gradient(run.q[:, joint], run.t), SMOOTHED) for run in runs])
        command = np.concatenate([np.interp(run.t - known["delay"], run.log_t, run.command[:, joint]) for run in runs])
        for effect in EFFECTS:
            possible = all(name in known for name in effect.free) if effect.gear is None else "stiffness" not in known
            if (joint, effect.name) not in taken and possible:
                starts[joint, effect.name] = effect.starts(Seen(q, dq, command, known))
    for index in range(max((len(options) for options in starts.values()), default=0)):
        there = [key for key, options in starts.items() if index < len(options)]
        neutral = [key for key in there if not BY_NAME[key[1]].bends]
        changed = _with_starts(fleet, values, {key: starts[key][index] for key in neutral})
        shares = _shares_by_slopes(freedom, changed, runs, now, neutral, costs, weights)
        for (joint, name), share in shares.items():
            found.append(
                _Promise(
                    joint=joint,
                    effect=BY_NAME[name],
                    start=starts[joint, name][index],
                    share=share,
                    cost=share * costs[joint],
                )
            )
    best: dict[tuple[int, str], _Promise] = {}
    for promise in found:
        key = (promise.joint, promise.effect.name)
        if promise.share > WORTH and (key not in best or promise.share > best[key].share):
            best[key] = promise
    # A promise counts by what it takes off the whole chain's error.
    smooth = sorted(best.values(), key=lambda p: -p.share * costs[p.joint])[:TRIED]
    worst = int(np.argmax(rms(now)))
    return smooth, partial(_bent, freedom, values, runs, starts, worst, float(rms(now)[worst]), geared)


def _bent(
    freedom: Freedom,
    values: tuple[Array, ...],
    runs: Sequence[Run],
    starts: Mapping[tuple[int, str], Sequence[dict[str, float]]],
    worst: int,
    error: float,
    geared: dict[int, Fleet],
) -> list[_Promise]:
    """Effects that no derivative promises, of the joint with the largest error: each from its best first values.

    `error` is that joint's. `geared` keeps the chain with an elastic gear at a joint, which has to be compiled.
    """
    fleet = freedom.fleet
    clear = error > CLEAR
    found = []
    for (joint, name), options in starts.items():
        gear = BY_NAME[name].gear
        if joint != worst or not BY_NAME[name].bends or (gear is not None and not clear):
            continue
        if gear is not None and joint not in geared:
            geared[joint] = fleet.with_gear(joint, gear)
        other = fleet if gear is None else geared[joint]
        costs = []
        for start in options:
            try:
                began = _with_starts(other, other.taken(values, fleet), {(joint, name): start})
                errors = simulate_runs(other, began, runs)
                costs.append(float(rms(errors)[joint]))
            except SolverError:
                costs.append(np.inf)
        if costs and np.isfinite(min(costs)):
            start = options[int(np.argmin(costs))]
            found.append(_Promise(joint=joint, effect=BY_NAME[name], start=start, share=WORTH, cost=np.inf))
    return found


def _with_starts(
    fleet: Fleet, values: tuple[Array, ...], starts: Mapping[tuple[int, str], dict[str, float]]
) -> tuple[Array, ...]:
    """Gives the values with which effects of some joints begin."""
    for (joint, _), start in starts.items():
        for name, value in start.items():
            values = fleet.changed(values, name, [joint], value)
    return values


def _shares_by_slopes(
    freedom: Freedom,
    values: tuple[Array, ...],
    runs: Sequence[Run],
    now: Sequence[Errors],
    wanted: Sequence[tuple[int, str]],
    costs: Array,
    weights: Array,
) -> dict[tuple[int, str], float]:
    """Decrease that a linear fit of each effect beside the free parameters promises, as a share of its joint's cost.

    All effects begin with values that are neutral, so that one simulation gives the derivatives of all.
    """
    fleet, size = freedom.fleet, len(freedom.free)
    known = {(p.name, j) for p in freedom.free for j in p.joints if len(p.joints) == 1}
    more: dict[tuple[int, str], FreeParameter] = {}
    for joint, name in wanted:
        for parameter in free_parameters(fleet, BY_NAME[name].free, {fleet.names[joint]: (joint,)}, [joint]):
            if (parameter.name, joint) not in known:
                more[joint, parameter.name] = parameter
    if not more:
        return {}
    added = Freedom(fleet=fleet, free=tuple(more.values()))
    joined = [
        replace(old, jacobian=np.concatenate([_of(old), _of(part)], axis=2))
        for part, old in zip(linearised_runs(added, values, runs), now, strict=True)
    ]
    gram, right = normal_equations(joined, weights)
    inner = gram[:size, :size] + 1e-9 * np.diag(np.diag(gram)[:size] + 1.0)
    solved = np.linalg.solve(inner, gram[:size, size:])
    left, effort = gram[size:, size:] - gram[size:, :size] @ solved, right[size:] - solved.T @ right[:size]
    place = {key: k for k, key in enumerate(more)}
    shares = {}
    for joint, name in wanted:
        mine = [place[joint, own] for own in BY_NAME[name].free if (joint, own) in place]
        # Parameters without an effect at these values, such as a speed of no friction, have no slope.
        mine = [k for k in mine if left[k, k] > 1e-9 * gram[size + k, size + k] and gram[size + k, size + k] > 0]
        if not mine:
            continue
        block, force = left[np.ix_(mine, mine)], effort[mine]
        step = np.linalg.solve(block + 1e-9 * np.diag(np.diag(block)), force)
        if len(mine) == 1:
            own = added.free[mine[0]]
            at = fleet.of(values, joint, own.name) / own.size + step[0]
            if not own.lower / own.size <= at <= own.upper / own.size:
                continue
        shares[joint, name] = float(force @ step / costs[joint])
    return shares


def _of(part: Errors) -> Array:
    assert part.jacobian is not None
    return part.jacobian


def _fitted(
    freedom: Freedom,
    values: tuple[Array, ...],
    runs: Sequence[Run],
    promise: _Promise,
    weights: Array,
    geared: Mapping[int, Fleet],
) -> Fit | None:
    """Fits an effect with everything that was free; None where the loop is not stable."""
    fleet, changed = freedom.fleet, values
    if promise.effect.gear is not None:
        other = geared[promise.joint]
        drives = list(other.drives)
        drives[promise.joint] = drives[promise.joint].with_values(promise.start)
        fleet, changed = other.with_drives(drives), other.taken(values, fleet)
        freedom = replace(freedom, fleet=fleet)
    for name, value in promise.start.items():
        changed = fleet.changed(changed, name, [promise.joint], value)
    names = [name for name in promise.effect.free if name in promise.start or not promise.effect.bends]
    alone = {fleet.names[promise.joint]: (promise.joint,)}
    try:
        return fit_drives(
            freedom.with_free(free_parameters(fleet, names, alone, [promise.joint])),
            changed,
            runs,
            QUICK,
            weights=weights,
        )
    except SolverError:
        return None


def _gain(before: Sequence[Errors], after: Sequence[Errors], joint: int, weights: Array) -> float:
    """Decrease of the weighted squared error over all joints of the chain; 0 where it is not sure.

    The error of the effect's own joint must fall, and that of all joints together. It must fall in most blocks of time
    longer than the error's memory: the mean logarithm of its ratio, which no single large error decides.
    """
    old, new = (np.concatenate([part.error for part in parts]) ** 2 for parts in (before, after))
    if new[:, joint].sum() > (1 - WORTH) * old[:, joint].sum():
        return 0.0
    memory = max(correlation_rows(part.error[:, joint]) for part in before)
    count = int(np.clip(len(old) // (MEMORIES * max(memory, 1)), FEWEST_BLOCKS, MOST_BLOCKS))
    floor = FLOOR**2 * len(old) / count
    sums = [
        np.array([block.sum() + floor for block in np.array_split(squares[:, joint], count)]) for squares in (old, new)
    ]
    ratios = np.log(sums[0] / sums[1])
    if ratios.mean() < SURE * ratios.std(ddof=1) / np.sqrt(count):
        return 0.0
    return float(((old - new) @ weights).sum())


def _finding(
    freedom: Freedom,
    promise: _Promise,
    trial: Fit,
    before: Sequence[Errors],
    after: Sequence[Errors],
    rivals: Sequence[tuple[int, str, float]],
) -> LoopFinding:
    fleet, joint, effect = freedom.fleet, promise.joint, promise.effect
    known = {name: fleet.of(trial.values, joint, name) for name in (*effect.free, *promise.start)}
    others = tuple((name, error) for other, name, error in rivals if other == joint and name != effect.name)
    return LoopFinding(
        effect=effect.name,
        title=effect.title,
        joint=joint + 1,
        name=fleet.names[joint],
        states=effect.states(known),
        before=float(rms(before)[joint]),
        after=float(rms(after)[joint]),
        rivals=others,
    )
