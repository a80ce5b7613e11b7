"""The verb: a motion for drives, put together from the segments that determine their parameters best."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oed.experiments.drive_options import DriveDesignOptions
from oed.experiments.drives.information import Loop, expected_errors
from oed.experiments.drives.result import DriveDesign, ExpectedError
from oed.experiments.drives.segments import Wave, candidates, chirp, name_of, offspring
from oed.experiments.safety_checks.freedom import UNCHECKED, collides, freedom_of, freedom_text
from robots.collision import Surroundings
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError, SolverError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.drives import Drive
from robots.robot import Robot
from robots.signals import Motion

SOUGHT = ("armature", "viscous", "coulomb", "torque_offset")
PRIOR = 100.0
"""Standard deviation of what is known before, in sizes of the parameters."""
SMALLER, NEAR, TRIES = 0.5, 0.97, 10
"""Least factor on a segment that leaves a limit, share of the limit that it is to reach then, and the most tries."""
SHRUNK = 0.8
"""Factor on a segment that leaves the range, or comes too near to another body."""
CLEAR = 0.01
"""Least distance [m] of two bodies in a designed segment."""
LOOKED = 0.01
"""Time [s] between poses that are looked at for collisions; the whole motion is checked between them, too."""
POSES, ROOM, TOUCHED = 400, 0.03, 0.02
"""Poses among which a home is sought where the usual one collides, its least distance [m], and joints' least spread."""


@one_blas_thread()
def design_drive_motion(
    robots: Robot | Sequence[Robot],
    drives: Sequence[Drive],
    *,
    options: DriveDesignOptions | None = None,
    progress: Progress | None = None,
) -> DriveDesign:
    """Designs position commands that determine delay, rotor inertia, friction and offset of drives.

    Segments of several kinds are simulated in the closed loop with exact derivatives. Those are played one after the
    other that bring the smallest standard errors, by their mean logarithm (exchange algorithm). Then segments near the
    chosen ones are tried, in which joints have kinds of their own. A segment begins and ends at home, so that they may
    be joined in any order. Segments stay within the limits and clear of the robot itself and the floor.

    Args:
        robots: the robot or its chains, see `robots.drives.load_branches`.
        drives: what is known of the joints' drives.
        options: settings.
        progress: hears how far it is.

    Returns:
        The motion with the standard errors that it will bring, beside those of a chirp of the same time and limits.

    Raises:
        InputError: a home of another number of joints, or outside of the limits.
        InfeasibleError: no segment stays within the limits.

    Source: Fedorov 1972; Mitchell 1974 (DETMAX).
    """
    chosen, bar = options or DriveDesignOptions(), progress or SILENT
    chains = [robots] if isinstance(robots, Robot) else list(robots)
    loop = Loop(chains, drives, SOUGHT)
    guard = _Guard(chains)
    home, reach = _home_and_reach(chains, chosen, guard)
    noise = np.full(loop.n, chosen.noise)
    t = np.arange(round(chosen.segment / chosen.period), dtype=np.float64) * chosen.period
    rng, length = np.random.default_rng(chosen.seed), chosen.segment
    pool: list[tuple[tuple[Wave, ...], Array, Array]] = []
    count = int(chosen.duration // length)
    best: list[int] = []
    bar.start("simulating segments", chosen.candidates * (1 + chosen.refinements))
    for round_ in range(1 + chosen.refinements):
        parents = [pool[k][0] for k in dict.fromkeys(best)]
        if round_ and not parents:
            break
        drawn = (
            offspring(parents, length, chosen.fastest, chosen.candidates, rng)
            if round_
            else candidates(length, loop.n, chosen.fastest, chosen.candidates, rng)
        )
        for k, waves in enumerate(drawn):
            wave = reach * np.column_stack([own.values(t) for own in waves])
            found = _within(loop, chains, t, home, wave, noise, chosen, guard)
            if found is not None:
                pool.append((waves, *found))
            bar.update(round_ * chosen.candidates + k + 1)
        if pool:
            best = _exchange(np.array([item[2] for item in pool]), count, best)
    bar.finish()
    if not pool:
        raise InfeasibleError(
            "no segment stays within the limits and clear of other bodies",
            remedy="allow a smaller reach, or another home",
        )
    command = np.concatenate([pool[k][1] for k in best])
    times = np.arange(len(command), dtype=np.float64) * chosen.period
    q, dq, information = loop.played(times, command, noise)
    sizes = np.array([item.size for item in loop.sought])
    plain = _chirp(loop, chains, times, home, reach, noise, chosen, guard)
    errors = expected_errors(information, sizes, PRIOR)
    others = np.full(len(sizes), np.nan) if plain is None else expected_errors(plain, sizes, PRIOR)
    return DriveDesign(
        robot=chains[0].name,
        joints=loop.names,
        t=times,
        command=command,
        segments=tuple(name_of(pool[k][0]) for k in best),
        expected=tuple(
            ExpectedError(parameter=s.parameter, group=s.group, unit=s.unit, standard_error=float(e), of_chirp=float(c))
            for s, e, c in zip(loop.sought, errors, others, strict=True)
        ),
        noise=chosen.noise,
        collisions=_collisions(chains, times, q, dq),
    )


def _collisions(chains: Sequence[Robot], t: Array, q: Array, dq: Array) -> str:
    """Says whether the simulated motion (N, n) collides, and with what it was checked."""
    ends = np.cumsum([chain.n for chain in chains])[:-1]
    parts = [np.split(values, ends, axis=1) for values in (q, dq, np.gradient(dq, t, axis=0))]
    texts = []
    for chain, *signals in zip(chains, *parts, strict=True):
        # Nobody knows how far above the floor several chains hang.
        bodies = Surroundings(floor=len(chains) == 1).model(chain)
        freedom = freedom_of(bodies, Motion(t, *signals))
        if len(chains) == 1 or collides(freedom):
            return freedom_text(freedom)
        texts.append(f"{chain.name}: {freedom_text(freedom)}")
    return f"{UNCHECKED} of the {len(chains)} chains with each other and with the floor. {' '.join(texts)}"


class _Guard:
    """Distances between bodies while a motion is sought.

    Args:
        chains: of the robot. Nobody knows how far above the floor several chains hang.
    """

    def __init__(self, chains: Sequence[Robot]) -> None:
        self.models = [Surroundings(floor=len(chains) == 1).model(chain) for chain in chains]
        ends = np.cumsum([chain.n for chain in chains])
        self.columns = [slice(end - chain.n, end) for chain, end in zip(chains, ends, strict=True)]

    def clearance(self, q: Array) -> Array:
        """Smallest distance in each pose (N,) [m]; infinite where nothing can meet."""
        least = np.full(len(q), np.inf)
        for model, columns in zip(self.models, self.columns, strict=True):
            found = model.clearance(q[:, columns])
            if found.size:
                least = np.minimum(least, found.min(axis=1))
        return least


def _home_and_reach(chains: Sequence[Robot], options: DriveDesignOptions, guard: _Guard) -> tuple[Array, Array]:
    lower = np.concatenate([chain.limits.lower for chain in chains])
    upper = np.concatenate([chain.limits.upper for chain in chains])
    span = np.where(np.isfinite(upper - lower), upper - lower, 2 * np.pi)
    middle = np.where(np.isfinite(lower + upper), (lower + upper) / 2, 0.0)
    # A joint whose range holds zero starts there: arms are drawn at zero.
    home = np.clip(0.0, middle - 0.3 * span, middle + 0.3 * span)
    if options.home is not None:
        home = np.array(options.home, dtype=float)
        if home.shape != lower.shape:
            raise InputError(f"a home of {len(home)} joints", allowed=f"{len(lower)}")
        outside = (home < lower) | (home > upper)
        if outside.any():
            raise InputError("the home is outside of the limits", joint=int(np.argmax(outside)) + 1)
    elif guard.clearance(home[None])[0] < ROOM:
        # The nearest of some poses with room.
        rng = np.random.default_rng(options.seed)
        spread = np.linspace(TOUCHED, 0.3, POSES)[:, None] * span
        poses = np.clip(
            home + spread * rng.standard_normal((POSES, len(home))), middle - 0.3 * span, middle + 0.3 * span
        )
        able = np.flatnonzero(guard.clearance(poses) >= ROOM)
        if len(able):
            home = poses[able[np.argmin(np.linalg.norm((poses[able] - home) / span, axis=1))]]
    room = np.minimum(home - lower, upper - home)
    reach = np.minimum(options.reach, (1 - options.margin) * np.where(np.isfinite(room), room, np.inf))
    return home, np.maximum(reach, 0.0)


def _within(
    loop: Loop,
    chains: Sequence[Robot],
    t: Array,
    home: Array,
    wave: Array,
    noise: Array,
    options: DriveDesignOptions,
    guard: _Guard,
) -> tuple[Array, Array] | None:
    """A command and its information, made smaller until it stays within the limits; None if it never does."""
    speed = np.concatenate([chain.limits.velocity for chain in chains])
    limit = np.concatenate([chain.limits.torque for chain in chains])
    lower = np.concatenate([chain.limits.lower for chain in chains])
    upper = np.concatenate([chain.limits.upper for chain in chains])
    gains = np.array([drive.values.get("kp", drive.values.get("kv", 0.0)) for drive in loop.drives])
    damping = np.array([drive.values.get("kd", drive.values.get("kv", 0.0)) for drive in loop.drives])
    scale, every = np.ones(loop.n), max(1, round(LOOKED / options.period))
    for _ in range(TRIES):
        command = home + scale * wave
        try:
            q, dq, information = loop.played(t, command, noise)
        except SolverError:
            return None
        torque = np.abs(gains * (command - q) - damping * dq)
        share = np.maximum(
            np.abs(dq).max(axis=0) / ((1 - options.margin) * speed),
            torque.max(axis=0) / ((1 - options.margin) * limit),
        )
        scale = np.where(share > 1, scale * np.clip(NEAR / np.maximum(share, 1.0), SMALLER, NEAR), scale)
        beyond = (q.min(axis=0) < lower) | (q.max(axis=0) > upper)
        near = bool(guard.clearance(q[::every]).min() < CLEAR)
        if not (share > 1).any() and not beyond.any() and not near:
            return command, information
        scale = np.where(beyond | near, SHRUNK * scale, scale)
    return None


def _value(informations: Array) -> Array:
    """What informations (..., K, K) are worth: minus the mean logarithm of the variances that they leave."""
    prior = np.eye(informations.shape[-1]) / PRIOR**2
    variances = np.diagonal(np.linalg.inv(informations + prior), axis1=-2, axis2=-1)
    return np.asarray(-np.mean(np.log(np.maximum(variances, 1e-300)), axis=-1))


def _exchange(informations: Array, count: int, start: Sequence[int]) -> list[int]:
    """Chooses segments, each as often as it pays."""
    chosen = list(start)
    while len(chosen) < count:
        total = informations[chosen].sum(axis=0)
        chosen.append(int(np.argmax(_value(total + informations))))
    better = True
    while better:
        better = False
        for place in range(count):
            rest = informations[chosen[:place] + chosen[place + 1 :]].sum(axis=0)
            values = _value(rest + informations)
            best = int(np.argmax(values))
            if values[best] > values[chosen[place]] + 1e-9:
                chosen[place], better = best, True
    return chosen


def _chirp(
    loop: Loop,
    chains: Sequence[Robot],
    t: Array,
    home: Array,
    reach: Array,
    noise: Array,
    options: DriveDesignOptions,
    guard: _Guard,
) -> Array | None:
    """Information of a chirp of all joints within the same limits."""
    wave = reach * chirp(t, loop.n, 0.1, options.fastest)
    found = _within(loop, chains, t, home, wave, noise, options, guard)
    return None if found is None else found[1]
