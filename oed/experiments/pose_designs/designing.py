"""The verb: chooses poses for a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oed.criteria import Criterion
from oed.experiments.assembly import rest_pose
from oed.experiments.checks import usable_limits, velocity_share
from oed.experiments.pose_designs.exchange import exchanged
from oed.experiments.pose_designs.information import PoseInformation
from oed.experiments.pose_designs.observability import pose_criterion
from oed.experiments.pose_designs.ordering import Moves, Paths, ordered
from oed.experiments.pose_designs.refinement import refined
from oed.experiments.pose_designs.result import PoseDesign
from oed.experiments.pose_options import PoseOptions
from oed.experiments.safety_checks.freedom import collides, freedom_of
from robots.collision import CollisionModel
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.geometry_errors.virtual import random_positions
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

CANDIDATES = 1000
AGAIN = 1  # exchanges after poses have moved
DRAWS = 60  # times so many poses are drawn before the limits in space are called too tight
REPAIRS = 4  # times an order is sought anew without a move that was found to collide


@one_blas_thread()
def design_poses(
    robot: Robot,
    *,
    count: int = 30,
    criterion: str = "d",
    options: PoseOptions | None = None,
    progress: Progress | None = None,
) -> PoseDesign:
    """Chooses poses that determine geometric errors best, and an order of moves that is free of collisions.

    Candidates within limits, clear of collisions and in view are exchanged (Mitchell 1974, DETMAX; Borm and Menq 1991),
    then all poses move together by IPOPT, with exact derivatives, to where the criterion is best.

    Args:
        robot: the robot.
        count: number of poses.
        criterion: d, cond, a, e, cond-d, or an observability index o1 to o5.
        options: what is measured, and which poses are allowed.
        progress: hears how far it is.

    Returns:
        The poses in the order of the moves, the motion, and the errors to expect.

    Raises:
        InputError: an unknown criterion or kind of errors, or too few poses for the parameters.
        InfeasibleError: no poses that keep all limits.
    """
    how, bar = options or PoseOptions(), progress or SILENT
    judge = pose_criterion(criterion)
    information = PoseInformation(robot, how.measurement, how.kinds, how.levels)
    needed = int(np.ceil(information.size / len(how.measurement.units)))
    if count < needed:
        raise InputError(
            f"{count} poses",
            allowed=f"{needed} or more: {information.size} parameters, {len(how.measurement.units)} numbers per pose",
        )
    model = how.surroundings.model(robot) if how.collision else None
    usable = usable_limits(robot.limits, velocity_share(robot, how.velocity_fraction))
    bounds = _bounds(usable, how.range_share, robot.chain.kinds)
    allowed = _Allowed(information, how, model)
    bar.start("designing poses", 1.0)
    try:
        candidates = _candidates(bounds, allowed, CANDIDATES, how.seed)
        bar.update(0.1, "exchanging poses")
        rows = information.rows(candidates)
        chosen = exchanged(rows, count, judge)
        q, before = candidates[chosen], np.einsum("nrl,nrk->lk", rows[chosen], rows[chosen])
        bar.update(0.4, "moving poses")
        if how.refine:
            q = _moved(information, q, judge, bounds, allowed, model, how, candidates, bar)
        bar.update(0.7, "ordering moves")
        home = _home(usable, how, allowed, candidates)
        moves, paths = Moves(usable, robot.period), Paths(model, how.clearance / 2.0, bounds, how.seed)
        for _ in range(REPAIRS):
            tour = ordered(q, home, usable, paths)
            if tour.left_out:
                q = _replaced(q, tour.left_out, home, candidates, rows, paths)
                tour = ordered(q, home, usable, paths)
            sequence = moves.whole(tour, how.dwell)
            motion = sequence.motion()
            freedom = None if model is None else freedom_of(model, motion)
            if not collides(freedom):
                break
            _forbid(paths, sequence.table(), motion, freedom)
    finally:
        bar.finish()
    visited = q[list(tour.order)]
    own = information.rows(visited)
    total = np.einsum("nrl,nrk->lk", own, own)
    elsewhere = random_positions(robot, 300, seed=how.seed + 1, share=how.range_share)
    some = rows[np.random.default_rng(how.seed).permutation(len(rows))[: len(visited)]]
    return PoseDesign(
        robot=robot,
        criterion=criterion,
        q=visited,
        home=home,
        motion=motion,
        segments=tuple(sequence.table()),
        parameters=information.parameters,
        eigenvalues=np.linalg.eigvalsh(total),
        random_eigenvalues=np.linalg.eigvalsh(np.einsum("nrl,nrk->lk", some, some)),
        exchanged_eigenvalues=np.linalg.eigvalsh(before),
        expected=information.spread(total),
        prediction=information.prediction_error(total, elsewhere),
        unit=how.measurement.unit,
        left_out=len(tour.left_out),
        freedom=freedom,
        settings={
            "poses": count,
            "measurement": how.measurement.kind,
            "columns": list(how.measurement.columns),
            "kinds": list(how.kinds),
            "noise": how.levels,
            "view": None if how.view is None else how.view.settings(),
            "range_share": how.range_share,
            "collision": how.collision,
            "clearance": how.clearance,
            "surroundings": how.surroundings.settings(),
            "dwell": how.dwell,
            "refine": how.refine,
            "seed": how.seed,
        },
    )


class _Allowed:
    """Which poses keep clear and are in view."""

    def __init__(self, information: PoseInformation, how: PoseOptions, model: CollisionModel | None) -> None:
        self._information, self._how, self._model = information, how, model

    def __call__(self, q: Array) -> NDArray[np.bool_]:
        ok = self._information.seen(q)
        if self._how.view is not None:
            ok &= self._how.view.sees(self._information.flange(q))
        if self._model is not None and self._model.pairs:
            ok &= (self._model.clearance(q) >= self._how.clearance).all(axis=1)
        return ok


def _bounds(limits: Limits, share: float, kinds: tuple[str, ...]) -> tuple[Array, Array]:
    """The part of each range that is used; of joints that turn farther, one turn about home."""
    lower = np.where(np.isfinite(limits.lower), limits.lower, -np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, np.pi)
    middle, half = (lower + upper) / 2.0, share * (upper - lower) / 2.0
    turns = (np.array(kinds) == "revolute") & (half > np.pi)
    home = np.clip(limits.home, middle - half, middle + half)
    low = np.where(turns, np.maximum(middle - half, home - np.pi), middle - half)
    high = np.where(turns, np.minimum(middle + half, home + np.pi), middle + half)
    return low, high


def _candidates(bounds: tuple[Array, Array], allowed: _Allowed, count: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    found: list[Array] = []
    total = 0
    for _ in range(DRAWS):
        q = rng.uniform(*bounds, (count, len(bounds[0])))
        found.append(q[allowed(q)])
        total += len(found[-1])
        if total >= count:
            break
    if total < max(count // 10, 20):
        raise InfeasibleError(
            f"{total} of {DRAWS * count} random poses keep clear and are in view",
            remedy="widen the cone of view, lower --clearance, or state other surroundings (--floor, --no-floor)",
        )
    return np.concatenate(found)[:count]


def _moved(
    information: PoseInformation,
    q: Array,
    judge: Criterion,
    bounds: tuple[Array, Array],
    allowed: _Allowed,
    model: CollisionModel | None,
    how: PoseOptions,
    candidates: Array,
    bar: Progress,
) -> Array:
    """Moves poses to where the criterion is best, exchanges those that are now superfluous, and moves them again."""
    for round_ in range(1 + AGAIN):
        done = 0.4 + 0.3 * round_ / (1 + AGAIN)
        q = refined(
            information,
            q,
            judge,
            bounds,
            allowed,
            model=model,
            clearance=how.clearance,
            view=how.view,
            progress=lambda share, done=done: bar.update(done + 0.3 * share / (1 + AGAIN)),  # type: ignore[misc]
        )
        if round_ == AGAIN:
            break
        pool, own = np.vstack([candidates, q]), range(len(candidates), len(candidates) + len(q))
        chosen = exchanged(information.rows(pool), len(q), judge, start=list(own))
        if set(chosen) <= set(own):
            break
        q = pool[chosen]
    return q


def _replaced(q: Array, lost: tuple[int, ...], home: Array, candidates: Array, rows: Array, paths: Paths) -> Array:
    """Puts candidates in the place of poses that no move reaches: with a free move to a pose that is kept."""
    kept = [k for k in range(len(q)) if k not in lost]
    near = [home, *(q[k] for k in kept)]
    picked: list[Array] = []
    order = np.argsort(-np.linalg.norm(rows, axis=(1, 2)))
    for k in order:
        if len(picked) == len(lost):
            break
        if any(paths.free(pose, candidates[k]) for pose in near[:: max(len(near) // 6, 1)]):
            picked.append(candidates[k])
    return np.vstack([q[kept], *(pose[None] for pose in picked)])


def _forbid(paths: Paths, segments: list[dict[str, object]], motion: Motion, freedom: Mapping[str, Any] | None) -> None:
    """Forbids the move on which a motion collides."""
    assert freedom is not None
    time = float(freedom["meetings"][0][1] if freedom.get("meetings") else freedom["time"])
    for segment in segments:
        start, end = float(str(segment["start"])), float(str(segment["end"]))
        if start <= time <= end:
            rows = np.searchsorted(motion.t, [start, end]).clip(0, len(motion.t) - 1)
            paths.forbid(motion.q[rows[0]], motion.q[rows[1]])


def _home(limits: Limits, how: PoseOptions, allowed: _Allowed, candidates: Array) -> Array:
    """The pose that is asked for, or that of the limits, or the nearest that is free."""
    home = rest_pose(limits, how.home)
    if how.home is not None or not how.collision:
        return home
    free = _Allowed(allowed._information, PoseOptions(collision=True, clearance=how.clearance), allowed._model)
    if free(home[None])[0]:
        return home
    return np.asarray(candidates[int(np.argmin(np.abs(candidates - home).max(axis=1)))])
