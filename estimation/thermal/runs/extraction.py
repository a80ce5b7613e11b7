"""Friction torques out of logs, and the runs that a thermal fit needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.logs.known_setup import HEAT, require_plain
from estimation.models.model import Model
from estimation.preprocessing import resample, smooth
from estimation.regressions.preparation import SIGN_SPEED_SHARE, torque_of
from estimation.thermal.runs.thermal_run import ThermalRun
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.signals import Log

# Logs that lie further apart are fitted as runs of their own, each with its own start [s].
SEPARATE_RUN_GAP = 6.0 * 3600.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionSignal:
    """One log's friction.

    Attributes:
        t: times (N,) [s].
        dq: velocities (N, n).
        friction: measured torque minus that of the rigid body, rotor and offset (N, n) [N m or N].
        cold: friction torque of the model's own polynomial (N, n).
        counts: whether a joint moves fast enough for its friction to have a sign (N, n).
        log: where it came from.
    """

    t: Array
    dq: Array
    friction: Array
    cold: Array
    counts: NDArray[np.bool_]
    log: Log


def friction_signal(model: Model, log: Log) -> FrictionSignal:
    """Subtracts the identified rigid body from a log's torque (thesis 4.3.1).

    Args:
        model: an identified model with a friction polynomial.
        log: positions and torque or current.

    Raises:
        InputError: another number of joints, no torque, a payload or gravity, or a model without friction.
    """
    if log.n != model.robot.n:
        raise InputError(f"{log.n} joints", file=log.metadata.get("file"), allowed=f"{model.robot.n}")
    require_plain([log], HEAT)
    own = np.array([column.friction for column in model.parameters])
    if not own.any():
        raise InputError("a model without friction", allowed="a model with a friction term")
    tau = torque_of(model.robot, log)
    motion = smooth(resample(log.t, log.q), model.cutoff)
    parts = []
    for chosen in (~own, own):
        columns = [c for c, yes in zip(model.columns, chosen, strict=True) if yes]
        parts.append(model.torque_model.torque(motion.q, motion.dq, motion.ddq, model.values[chosen], columns=columns))
    speed = np.sqrt(np.mean(motion.dq**2, axis=0))
    return FrictionSignal(
        t=motion.t,
        dq=motion.dq,
        friction=tau - parts[0],
        cold=parts[1],
        counts=(np.abs(motion.dq) >= SIGN_SPEED_SHARE * speed) & (speed > 1e-9),
        log=log,
    )


def thermal_runs(
    model: Model,
    logs: Log | Sequence[Log],
    joint: int,
    *,
    width: float = 10.0,
    sensor: str = "motor",
    signals: Sequence[FrictionSignal] | None = None,
) -> tuple[ThermalRun, ...]:
    """Builds the runs of one joint from logs on one clock.

    Friction is averaged over short times, weighted by the friction that the model expects; pauses between logs are
    rests. The model's own friction stands for that at T0: `beta` and `alpha` are relative to it.

    Args:
        model: an identified model.
        logs: in any order; further apart than six hours they become runs of their own.
        joint: counted from 1.
        width: of the averages [s].
        sensor: where the log's joint temperatures are measured: ``motor`` (where heat is produced) or ``housing``.
        signals: what `friction_signal` made of these logs, where it is at hand.

    Returns:
        The runs.

    Raises:
        InputError: no logs, or no such joint.
        NotIdentifiableError: the joint does not move.
    """
    data = [logs] if isinstance(logs, Log) else list(logs)
    if not data or not 1 <= joint <= model.robot.n:
        raise InputError(f"{len(data)} logs, joint {joint}", allowed=f"one or more, joint 1 to {model.robot.n}")
    parts = list(signals) if signals is not None else [friction_signal(model, log) for log in data]
    parts.sort(key=lambda part: float(part.t[0]))
    groups = group_by_time(parts)
    if not any(part.counts[:, joint - 1].any() for part in parts):
        raise NotIdentifiableError("the joint does not move", joint=joint, remedy="record a log in which it moves")
    return tuple(_run(group, joint - 1, width, sensor, k) for k, group in enumerate(groups, start=1))


def group_by_time(parts: Sequence[FrictionSignal]) -> list[list[FrictionSignal]]:
    """Puts signals, in order of time, into runs: those whose logs lie close to each other."""
    groups: list[list[FrictionSignal]] = []
    for part in parts:
        if groups and part.t[0] - groups[-1][-1].t[-1] < SEPARATE_RUN_GAP:
            groups[-1].append(part)
        else:
            groups.append([part])
    return groups


def _run(group: list[FrictionSignal], j: int, width: float, sensor: str, number: int) -> ThermalRun:
    return join_pieces([_piece(part, j, width) for part in group], sensor, f"run {number}, joint {j + 1}")


def join_pieces(pieces: list[dict[str, Array]], sensor: str, name: str) -> ThermalRun:
    """Joins what `piece_on_bins` made of the logs of one run, pauses between them as rests."""
    for before, after in pairwise(pieces):
        # Logs that touch share a time: the later one's power holds from there.
        if after["t"][0] - before["t"][-1] < 1e-6:
            for key in before:
                before[key] = before[key][:-1]
    joined = {key: np.concatenate([piece[key] for piece in pieces]) for key in pieces[0]}
    ratio, seen, around = joined["ratio"], joined["temperature"], joined["ambient"]
    return ThermalRun(
        t=joined["t"],
        power=joined["power"],
        friction=ratio,
        cold_friction=1.0,
        weight=joined["weight"] / np.median(joined["weight"][np.isfinite(ratio)]),
        temperatures={sensor: seen} if np.isfinite(seen).any() else {},
        ambient=around if np.isfinite(around).any() else None,
        name=name,
    )


def piece_on_bins(edges: Array, ratio: Array, weight: Array, power: Array, log: Log, j: int) -> dict[str, Array]:
    """One log on the ends and middles of its bins: friction stands at the middles, power holds over a bin.

    Args:
        edges: of the bins (B + 1,) [s].
        ratio: friction over the model's (B,), NaN where the joint hardly moves.
        weight: of the ratio (B,).
        power: mean in each bin (B,) [W].
        log: for its temperatures.
        j: joint, counted from 0.
    """
    t = np.empty(2 * len(edges) - 1)
    t[::2], t[1::2] = edges, (edges[1:] + edges[:-1]) / 2.0
    ratios, weights = np.full(t.shape, np.nan), np.ones(t.shape)
    known = np.isfinite(ratio)
    ratios[1::2][known], weights[1::2][known] = ratio[known], weight[known]
    return {
        "t": t,
        "power": np.append(np.repeat(power, 2), 0.0),
        "ratio": ratios,
        "weight": weights,
        "temperature": _readings(None if log.temperature is None else log.temperature[:, j], log.t, t),
        "ambient": _readings(log.ambient, log.t, t),
    }


def _piece(part: FrictionSignal, j: int, width: float) -> dict[str, Array]:
    edges, index = bins(part.t, width)
    good, cold = part.counts[:, j], part.cold[:, j]
    cross = _sums(index, good * cold * part.friction[:, j], edges)
    square = _sums(index, good * cold**2, edges)
    counted = np.maximum(_sums(index, np.ones(len(cold)), edges), 1.0)
    power = np.maximum(_sums(index, np.maximum(cold * part.dq[:, j], 0.0), edges) / counted, 0.0)
    return piece_on_bins(edges, ratio_of(cross, square), square, power, part.log, j)


def ratio_of(cross: Array, square: Array) -> Array:
    """Least-squares scale of the friction in each bin (B,), NaN where it hardly acts."""
    known = square > 1e-3 * float(square.max(initial=0.0))
    return np.divide(cross, square, out=np.full(cross.shape, np.nan), where=known)


def bins(t: Array, width: float) -> tuple[Array, NDArray[np.intp]]:
    """Cuts times (N,) into bins of some width [s]: their edges (B + 1,), and the bin of each time (N,)."""
    count = max(3, round(float(t[-1] - t[0]) / width))
    edges = np.linspace(t[0], t[-1], count + 1)
    return edges, np.clip(np.searchsorted(edges, t, side="right") - 1, 0, count - 1)


def _sums(index: NDArray[np.intp], values: Array, edges: Array) -> Array:
    return np.bincount(index, values, minlength=len(edges) - 1).astype(np.float64)


def _readings(values: Array | None, t: Array, at: Array) -> Array:
    seen = np.zeros(0, dtype=bool) if values is None else np.isfinite(values)
    if values is None or not seen.any():
        return np.full(at.shape, np.nan)
    return np.asarray(np.interp(at, t[seen], values[seen]))
