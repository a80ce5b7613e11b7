"""The virtual robot's heat: friction that falls as the joints warm up by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.signals import Motion
from robots.thermal import ThermalModel, build_thermal_model, known_thermal
from robots.thermal.motion import PAUSE_STEPS

Thermometers = Literal["none", "ambient", "all"]


@dataclass(frozen=True, kw_only=True, eq=False)
class HeatPiece:
    """Power of a motion at T0, averaged over short times.

    Attributes:
        edges: of the times (B + 1,) [s].
        power: mean in each, (B, n) [W].
    """

    edges: Array
    power: Array

    def shifted(self, start: float) -> HeatPiece:
        """Gives the same power later by `start` [s]."""
        return HeatPiece(edges=self.edges + start, power=self.power)


@dataclass(frozen=True, kw_only=True, eq=False)
class Warmth:
    """Temperatures where heat is produced.

    Attributes:
        models: of each joint (n,); None where friction does not change.
        t: times (M,) [s].
        temperatures: (M, n) [degC].
    """

    models: tuple[ThermalModel | None, ...]
    t: Array
    temperatures: Array

    def at(self, t: Array) -> Array:
        """Interpolates the temperatures at times (N,): (N, n) [degC]."""
        return np.stack([np.interp(t, self.t, column) for column in self.temperatures.T], axis=-1)

    def factor(self, t: Array) -> Array:
        """Friction over that at T0 at times (N,): (N, n)."""
        T = self.at(t)
        columns = [
            np.ones(len(t)) if model is None else model.friction_factor(T[:, j]) for j, model in enumerate(self.models)
        ]
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlantHeat:
    """Friction heat of a plant's joints.

    Attributes:
        models: of each joint (n,); None for one whose friction does not change.
        ambient: ambient temperature [degC].
        start: temperature of all zones when the robot is switched on [degC]; ambient temperature by default.
        thermometers: what the log sees of it: ``none``, ``ambient``, or ``all``, the joints too.
    """

    models: tuple[ThermalModel | None, ...]
    ambient: float = 20.0
    start: float | None = None
    thermometers: Thermometers = field(default="ambient")

    def follow(self, pieces: Sequence[HeatPiece]) -> Warmth:
        """Follows the temperatures through pieces in order of time; between them the robot rests.

        Raises:
            InputError: pieces that overlap.
        """
        steps, powers = [np.diff(pieces[0].edges)], [pieces[0].power]
        times, last = [pieces[0].edges], float(pieces[0].edges[-1])
        for piece in pieces[1:]:
            rest = float(piece.edges[0]) - last
            if rest < -1e-9:
                raise InputError("a motion begins before the last one ends", allowed="increasing times [s]")
            if rest > 1e-9:
                steps.append(np.array([rest]))
                powers.append(np.zeros((1, piece.power.shape[1])))
                times.append(piece.edges[:1])
            steps.append(np.diff(piece.edges))
            powers.append(piece.power)
            times.append(piece.edges[1:])
            last = float(piece.edges[-1])
        h, W, t = np.concatenate(steps), np.concatenate(powers), np.concatenate(times)
        begin = self.ambient if self.start is None else self.start
        columns = [
            np.full(len(t), begin)
            if model is None
            else model.temperatures(W[:, j], h, start=[begin] * len(model.zones), ambient=self.ambient)[:, 0]
            for j, model in enumerate(self.models)
        ]
        return Warmth(models=self.models, t=t, temperatures=np.stack(columns, axis=-1))


def reference_friction(model: TorqueModel, parameters: Array, motion: Motion) -> Array:
    """Evaluates the friction torque at T0 (N, n) [N m or N]."""
    own = [k for k, column in enumerate(model.columns) if column.friction]
    return np.asarray(model.torque(motion.q, motion.dq, motion.ddq, np.asarray(parameters)[own], columns=own))


def heat_piece(motion: Motion, friction: Array) -> HeatPiece:
    """Averages the power of a friction torque (N, n) over a second, keeping its energy; pauses are rests."""
    t = np.asarray(motion.t)
    if len(t) < 2:
        return HeatPiece(edges=t, power=np.zeros((0, motion.n)))
    # A polynomial fitted to data may dip below zero where there were none; friction never gives power back.
    power, lengths = np.maximum(friction * motion.dq, 0.0), np.diff(t)
    moving = lengths <= PAUSE_STEPS * np.median(lengths)
    energy = np.where(moving[:, None], (power[1:] + power[:-1]) / 2.0, 0.0) * lengths[:, None]
    heat = np.vstack([np.zeros(motion.n), np.cumsum(energy, axis=0)])
    # Power is averaged over 1 s: short against the fastest time constant, some two minutes.
    edges = np.linspace(t[0], t[-1], max(1, int(np.ceil(t[-1] - t[0] - 1e-9))) + 1)
    at_edges = np.stack([np.interp(edges, t, column) for column in heat.T], axis=-1)
    return HeatPiece(edges=edges, power=np.maximum(np.diff(at_edges, axis=0), 0.0) / np.diff(edges)[:, None])


def plant_heat(
    robot: Robot,
    *,
    known: bool = False,
    joints: Mapping[int, Mapping[str, Any]] | None = None,
    ambient: float = 20.0,
    start: float | None = None,
    thermometers: Thermometers = "ambient",
) -> PlantHeat:
    """Checks the heat of a plant.

    Args:
        robot: the robot.
        known: whether joints have the published models of this robot, see `robots.thermal.known_thermal`.
        joints: model and parameters by joint, counted from 1; ``beta`` is 1 by default. They go before published ones.
        ambient: ambient temperature [degC].
        start: temperature of all zones when the robot is switched on [degC]; ambient temperature by default.
        thermometers: what the log sees of it.

    Raises:
        InputError: no joint with a model, an unknown joint, model or parameter, or a value out of range.
    """
    for name, value in (("ambient", ambient), ("start", ambient if start is None else start)):
        if not -60.0 <= value <= 160.0:
            raise InputError(f"thermal: {name} is {value}", column="thermal", allowed="-60 to 160 degC")
    models: list[ThermalModel | None] = [None] * robot.n
    if known:
        published = known_thermal(robot, ambient=ambient)
        if published is None:
            raise InputError(
                f"no thermal models of {robot.name} are published",
                column="thermal",
                remedy="state them as joints: {1: {model: second, alpha: ..., K1: ..., K2: ..., C1: ..., C2: ...}}",
            )
        models = list(published.models)
    for joint, settings in (joints or {}).items():
        if not 1 <= joint <= robot.n:
            raise InputError(f"thermal: joint {joint}", column="thermal", allowed=f"1 to {robot.n}")
        try:
            models[joint - 1] = build_thermal_model({"ambient": ambient, "beta": 1.0, **settings})
        except InputError as error:
            raise InputError(error.problem, column="thermal", joint=joint, allowed=error.allowed) from error
    if not any(models):
        raise InputError("thermal: no joint has a model", column="thermal", allowed="known: true, or joints")
    return PlantHeat(models=tuple(models), ambient=ambient, start=start, thermometers=thermometers)
