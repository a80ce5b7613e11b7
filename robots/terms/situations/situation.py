"""Input of effects: the motion, the base model's torque, and its sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot
from robots.terms.base import Column
from robots.terms.situations.of_model import rotor_inertias, sign_of, velocity_scale
from robots.terms.situations.sensitivities import evaluate

if TYPE_CHECKING:
    from robots.regressor import TorqueModel

Kept = TypeVar("Kept")


@dataclass(frozen=True, kw_only=True, eq=False)
class Situation:
    """The motion of all logs, one after the other, and the base model's torque.

    Attributes:
        model: the base model.
        parameters: its standard parameters (p,); zero if another one represents them in a base parameter.
        t: time (N,) [s] on one clock for all logs.
        starts: indices of each log's first sample, 0 first. Derivatives, filters and presliding states restart there;
            heat decays over the pause.
        q: positions (N, n) [rad or m], without noise.
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n) [rad/s2 or m/s2].
        rigid: torque of rigid body and rotors (N, n) [N m or N].
        friction: torque of the base model's friction (N, n) [N m or N].
        torque: torque of the whole base model (N, n) [N m or N].
        velocity_scale: v0 (n,) [rad/s or m/s] of the sign, tanh(dq / v0); 0 for the sharp sign.
        parts: the joined situations, if payloads differ between logs or the base is tilted against the robot's
            description; else empty. Each part has a model under its own gravity. `parameters` are those of the first.
        measured: logged torque (N, n) [N m or N]; None without a log, for example when a model is evaluated.
        beyond: torque of other effects (N, n) [N m or N], for effects that act on the total torque; None for none.
        extra_load: torque of other effects that loads the gears (N, n) [N m or N]; None for none.
        full_rate: the same logs before they were thinned; None if they were not.
        since: time at which the phase of vibrations is zero [s]; None for the first sample.
    """

    model: TorqueModel
    parameters: Array
    t: Array
    starts: tuple[int, ...]
    q: Array
    dq: Array
    ddq: Array
    rigid: Array
    friction: Array
    torque: Array
    velocity_scale: Array
    parts: tuple[Situation, ...] = ()
    measured: Array | None = None
    beyond: Array | None = None
    extra_load: Array | None = None
    full_rate: Finer | None = None
    since: float | None = None
    _cache: dict[object, Any] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.model.robot

    @property
    def runs(self) -> tuple[slice, ...]:
        """The rows of each log."""
        return tuple(slice(a, b) for a, b in pairwise((*self.starts, len(self.t))))

    @cached_property
    def period(self) -> float:
        """The median sample period within the logs [s]; 0 for a single sample."""
        steps = np.concatenate([np.diff(self.t[run]) for run in self.runs])
        return float(np.median(steps)) if len(steps) else 0.0

    @property
    def origin(self) -> float:
        """The time at which the phase of vibrations is zero [s]."""
        return float(self.t[0]) if self.since is None else self.since

    @property
    def sampled(self) -> float:
        """The median sample period of the logs before they were thinned [s]."""
        return self.period if self.full_rate is None else self.full_rate.situation.period

    @property
    def whole(self) -> Array:
        """The total modelled torque (N, n) [N m or N]: that of the base model and of other effects."""
        return self.torque if self.beyond is None else self.torque + self.beyond

    def beside(self, torque: Array | None) -> Situation:
        """Returns the situation with torque of other effects (N, n) or (n,) [N m or N]; None for none."""
        return self._with("beyond", torque)

    def bearing(self, torque: Array | None) -> Situation:
        """Returns the situation with an additional gear load (N, n) [N m or N]; None for none."""
        return self._with("extra_load", torque)

    def _with(self, name: str, torque: Array | None) -> Situation:
        """Returns a copy with a torque, also at full rate. It shares the cache, which depends on neither torque."""
        if torque is not None:
            torque = np.broadcast_to(torque, self.q.shape)
        if self.full_rate is None or torque is None:
            return replace(self, **{name: torque})  # type: ignore[arg-type]
        other = self.full_rate.situation
        spread = np.empty_like(other.q)
        for own, run in zip(other.runs, self.runs, strict=True):
            spread[own] = np.column_stack([np.interp(other.t[own], self.t[run], x) for x in torque[run].T])
        finer = replace(self.full_rate, situation=other._with(name, spread))
        return replace(self, **{name: torque}, full_rate=finer)  # type: ignore[arg-type]

    @cached_property
    def gravity(self) -> Array:
        """Gravity in the base frame at each sample (N, 3) [m/s2]."""
        if self.parts:
            return np.concatenate([part.gravity for part in self.parts])
        return np.broadcast_to(np.asarray(self.robot.chain.gravity, dtype=float), (len(self), 3))

    @cached_property
    def sign(self) -> Array:
        """The base model's sign of the velocities (N, n), low-passed if the logs are thinned."""
        if self.full_rate is not None:
            return self.full_rate.thinned(self.full_rate.situation.sign)
        return sign_of(self.dq, self.velocity_scale)

    @cached_property
    def rotors(self) -> Array:
        """The rotor inertias (2, n) [kg m2 or kg], see `rotor_inertias`."""
        return rotor_inertias(self.model, self.parameters)

    @cached_property
    def load(self) -> Array:
        """The gear load (N, n) [N m or N]: the rigid-body torque without rotors, plus the additional load."""
        own = self.rigid - self.ddq * self.rotors.sum(axis=0)
        return own if self.extra_load is None else own + self.extra_load

    def friction_at(self, dq: Array) -> Array:
        """Evaluates the base model's friction (N, n) [N m or N] at other velocities (N, n)."""
        columns = [i for i, c in enumerate(self.model.columns) if c.friction and self.parameters[i]]
        if not columns:
            return np.zeros_like(self.q)
        return self.model.torque(self.q, dq, self.ddq, self.parameters[columns], columns=columns)

    def derivatives(self, values: Array) -> tuple[Array, Array]:
        """Computes the first and second time derivative of samples (N, ...), within each log.

        It uses central differences of sixth order; near a log's ends and for uneven samples, of second order.
        """
        return differentiate(self.t, values, self.runs)

    def sensitivity(self, kind: str) -> Array:
        """Evaluates a sensitivity of the base model's rigid-body torque, or a kinematic quantity; results are cached.

        Args:
            kind: which one.

                - ``position``: d rigid/dq (N, n, n)
                - ``velocity``: d rigid/d(dq) (N, n, n)
                - ``inertia``: inertia matrix without rotors (N, n, n)
                - ``gravity``: d rigid/d(gravity in the base frame) (N, n, 3)
                - ``tool``: torque per inertial parameter of a body at the flange, in the flange's frame (N, n, 10)
                - ``bodies``: torque per inertial parameter of a body on each link, in the link's frame (N, n, 10 n)
                - ``jacobian``: Jacobian of the flange in the base frame, linear, then angular (N, 6, n)
                - ``flange``: position of the flange in the base frame [m] (N, 3, 1)
                - ``moment``: first moment of the links' masses in the base frame [kg m] (N, 3, 1)
                - ``links``: per link, rotation matrix (row by row) and origin [m] in the base frame (N, 12, n)
                - ``base_rate``: d rigid/d(angular velocity of the base) (N, n, 3)
                - ``base_acceleration``: d rigid/d(angular acceleration of the base) (N, n, 3)
                - ``base_moment``: moment of the base on the robot about the base's origin (N, 3, 1)
                - ``base_inertia``: d base_moment/d(angular acceleration of the base) (N, 3, 3)
                - ``base_damping``: d base_moment/d(angular velocity of the base) (N, 3, 3)
        """
        if kind not in self._cache:
            parts = [part.sensitivity(kind) for part in self.parts]
            self._cache[kind] = np.concatenate(parts) if parts else self._evaluated(kind)
        return self._cache[kind]

    def _evaluated(self, kind: str) -> Array:
        return evaluate(kind, self.model, self.parameters, self.q, self.dq, self.ddq)

    def cached(self, key: object, compute: Callable[[], Kept]) -> Kept:
        """Returns `compute()`, evaluated once per key, for states that several columns share."""
        if key not in self._cache:
            self._cache[key] = compute()
        return cast(Kept, self._cache[key])


@dataclass(frozen=True, eq=False)
class Finer:
    """Logs before thinning. Effects that change between samples are evaluated there and filtered like the torque.

    Attributes:
        situation: the motion and the base model's torque at all samples.
        thinned: low-passes rows (N, ...) of these samples like the torque, and thins them.
    """

    situation: Situation
    thinned: Callable[[Array], Array]


def with_finer(coarse: Situation, finer: Finer) -> Situation:
    """Returns a situation of thinned logs with friction evaluated at all samples and low-passed like the torque."""
    friction = finer.thinned(finer.situation.friction)
    return replace(
        coarse, friction=friction, torque=coarse.torque - coarse.friction + friction, full_rate=finer, _cache={}
    )


def situation(
    model: TorqueModel,
    parameters: ArrayLike,
    t: ArrayLike,
    q: ArrayLike,
    dq: ArrayLike,
    ddq: ArrayLike,
    *,
    starts: tuple[int, ...] = (0,),
    columns: tuple[int, ...] | None = None,
) -> Situation:
    """Evaluates the base model on a motion.

    Args:
        model: the base model with p columns.
        parameters: values of all columns (p,), or of `columns` only.
        t: time (N,) [s].
        q: positions (N, n) [rad or m], without noise.
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n) [rad/s2 or m/s2].
        starts: indices of each log's first sample.
        columns: indices of the columns that `parameters` belong to; all other parameters are zero.

    Returns:
        The situation.

    Raises:
        InputError: the arrays' shapes do not match.
    """
    times = np.asarray(t, dtype=float)
    q, dq, ddq = (np.ascontiguousarray(np.atleast_2d(np.asarray(a, dtype=float))) for a in (q, dq, ddq))
    given = np.asarray(parameters, dtype=float)
    chosen = range(model.size) if columns is None else columns
    if given.shape != (len(chosen),) or q.shape != (len(times), model.robot.n) or not q.shape == dq.shape == ddq.shape:
        raise InputError(
            f"{given.shape} parameters and motions of shape {q.shape}", allowed="arrays that fit the model"
        )
    full = np.zeros(model.size)
    full[list(chosen)] = given
    parts = {term: np.zeros_like(q) for term in ("rigid_body", "rotor_inertia", "friction", "other")}
    for name in parts:
        of_term = [i for i, c in enumerate(model.columns) if full[i] and _part_of(c, parts) == name]
        if of_term:
            parts[name] = model.torque(q, dq, ddq, full[of_term], columns=of_term)
    rigid = parts["rigid_body"] + parts["rotor_inertia"]
    return Situation(
        model=model,
        parameters=full,
        t=times,
        starts=tuple(int(start) for start in starts),
        q=q,
        dq=dq,
        ddq=ddq,
        rigid=rigid,
        friction=parts["friction"],
        torque=rigid + parts["friction"] + parts["other"],
        velocity_scale=velocity_scale(model),
    )


def _part_of(column: Column, parts: Collection[str]) -> str:
    """Names the part of the torque to which a column belongs; friction may come from any friction term."""
    if column.friction:
        return "friction"
    return column.term if column.term in parts else "other"


def differentiate(t: Array, values: Array, runs: Iterable[slice]) -> tuple[Array, Array]:
    """Computes the first and second time derivative of samples, within each log.

    It uses central differences of sixth order; near a log's ends and for uneven samples, of second order.

    Args:
        t: times (N,) [s].
        values: the samples (N, ...).
        runs: rows of each log.

    Returns:
        Both derivatives (N, ...); zero in logs of less than three rows.
    """
    first, second = np.zeros_like(values), np.zeros_like(values)
    # Rows at an end from which derivatives of second order in its first three rows follow.
    end_rows = 6
    for run in runs:
        times, x = t[run], values[run]
        if len(times) < 3:
            continue
        steps = np.diff(times)
        h = float(steps.mean())
        even = len(times) > 2 * end_rows and np.abs(steps - h).max() < 1e-3 * h
        for part in (slice(0, end_rows), slice(-end_rows, None)) if even else (slice(None),):
            slope = np.gradient(x[part], times[part], axis=0)
            first[run][part], second[run][part] = slope, np.gradient(slope, times[part], axis=0)
        if even:
            inner = slice(run.start + 3, run.stop - 3)
            a, b, c = x[4:-2] - x[2:-4], x[5:-1] - x[1:-5], x[6:] - x[:-6]
            first[inner] = (45 * a - 9 * b + c) / (60 * h)
            a, b, c = x[4:-2] + x[2:-4], x[5:-1] + x[1:-5], x[6:] + x[:-6]
            second[inner] = (270 * a - 27 * b + 2 * c - 490 * x[3:-3]) / (180 * h**2)
    return first, second
