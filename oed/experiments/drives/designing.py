"""The verb: a motion for drives, put together from the segments that determine their parameters best."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from oed.experiments.drive_options import DriveDesignOptions
from oed.experiments.drives.information import Loop, expected_errors
from oed.experiments.drives.result import DriveDesign, ExpectedError
from oed.experiments.drives.segments import candidates, chirp
from oed.experiments.safety_checks.freedom import UNCHECKED, collides, freedom_of, freedom_text
from robots.collision import Surroundings
from robots.common.errors import InfeasibleError, InputError, SolverError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.drives import Drive
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

SOUGHT = ("armature", "viscous", "coulomb", "torque_offset")
PRIOR = 100.0
"""Standard deviation of what is known before, in sizes of the parameters."""
SMALLER, TRIES = 0.7, 8
"""Factor on a segment that leaves a limit, and how often it is tried."""


@one_blas_thread()
def design_drive_motion(
    robots: Robot | Sequence[Robot],
    drives: Sequence[Drive],
    *,
    options: DriveDesignOptions | None = None,
    progress: Progress | None = None,
) -> DriveDesign:
    """Designs position commands that determine delay, rotor inertia, friction and offset of drives.

    Segments of several kinds are simulated in the closed loop with exact derivatives. Those whose informations add up
    to the largest determinant are played one after the other (exchange algorithm). A segment begins and ends at home,
    so that they may be joined in any order.

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
    home, reach = _home_and_reach(chains, chosen)
    noise = np.full(loop.n, chosen.noise)
    t = np.arange(round(chosen.segment / chosen.period), dtype=np.float64) * chosen.period
    rng = np.random.default_rng(chosen.seed)
    pool: list[tuple[str, Array, Array]] = []
    bar.start("simulating segments", chosen.candidates)
    for k, (kind, wave) in enumerate(candidates(t, loop.n, chosen.fastest, chosen.candidates, rng)):
        found = _within(loop, chains, t, home, reach * wave, noise, chosen)
        if found is not None:
            pool.append((kind, *found))
        bar.update(k + 1)
    bar.finish()
    if not pool:
        raise InfeasibleError("no segment stays within the limits", remedy="allow a smaller reach, or another home")
    count = int(chosen.duration // chosen.segment)
    best = _exchange([item[2] for item in pool], count)
    command = np.concatenate([pool[k][1] for k in best])
    times = np.arange(len(command), dtype=np.float64) * chosen.period
    q, dq, information = loop.played(times, command, noise)
    sizes = np.array([item.size for item in loop.sought])
    plain = _chirp(loop, chains, times, home, reach, noise, chosen)
    errors = expected_errors(information, sizes, PRIOR)
    others = np.full(len(sizes), np.nan) if plain is None else expected_errors(plain, sizes, PRIOR)
    return DriveDesign(
        robot=chains[0].name,
        joints=loop.names,
        t=times,
        command=command,
        segments=tuple(pool[k][0] for k in best),
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


def _home_and_reach(chains: Sequence[Robot], options: DriveDesignOptions) -> tuple[Array, Array]:
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
    room = np.minimum(home - lower, upper - home)
    reach = np.minimum(options.reach, (1 - options.margin) * np.where(np.isfinite(room), room, np.inf))
    return home, np.maximum(reach, 0.0)


def _within(
    loop: Loop, chains: Sequence[Robot], t: Array, home: Array, wave: Array, noise: Array, options: DriveDesignOptions
) -> tuple[Array, Array] | None:
    """A command and its information, made smaller until it stays within the limits; None if it never does."""
    speed = np.concatenate([chain.limits.velocity for chain in chains])
    limit = np.concatenate([chain.limits.torque for chain in chains])
    lower = np.concatenate([chain.limits.lower for chain in chains])
    upper = np.concatenate([chain.limits.upper for chain in chains])
    gains = np.array([drive.values.get("kp", drive.values.get("kv", 0.0)) for drive in loop.drives])
    damping = np.array([drive.values.get("kd", drive.values.get("kv", 0.0)) for drive in loop.drives])
    scale = np.ones(loop.n)
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
        out = (share > 1) | (q.min(axis=0) < lower) | (q.max(axis=0) > upper)
        if not out.any():
            return command, information
        scale = np.where(out, SMALLER * scale, scale)
    return None


def _exchange(informations: Sequence[Array], count: int) -> list[int]:
    """Chooses segments, each as often as it pays, by the largest determinant of the sum."""
    size = len(informations[0])
    prior = np.eye(size) / PRIOR**2

    def value(chosen: Sequence[int]) -> float:
        return float(np.linalg.slogdet(prior + sum(informations[k] for k in chosen))[1])

    chosen: list[int] = []
    for _ in range(count):
        chosen.append(max(range(len(informations)), key=lambda k: value([*chosen, k])))
    better = True
    while better:
        better = False
        for place in range(count):
            rest = chosen[:place] + chosen[place + 1 :]
            best = max(range(len(informations)), key=lambda k: value([*rest, k]))
            if value([*rest, best]) > value(chosen) + 1e-9:
                chosen, better = [*rest, best], True
    return chosen


def _chirp(
    loop: Loop, chains: Sequence[Robot], t: Array, home: Array, reach: Array, noise: Array, options: DriveDesignOptions
) -> Array | None:
    """Information of a chirp of all joints within the same limits."""
    wave = reach * chirp(t, loop.n, 0.1, options.fastest)
    found = _within(loop, chains, t, home, wave, noise, options)
    return None if found is None else found[1]
