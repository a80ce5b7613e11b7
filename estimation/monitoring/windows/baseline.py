"""The baseline: what an identified model says of a motion, split into the directions that a monitor follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.models.model import Model, load_model
from estimation.thermal import ThermalTorqueModel, thermal_from_dict
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import read_json
from robots.robot import Robot
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.situations.flange_body import FLANGE, link_columns, with_body
from robots.terms.situations.sensitivities import moved_body

PAYLOAD = ("payload_mass", "payload_mx", "payload_my", "payload_mz")
"""Directions of a payload: its mass [kg] and first moments [kg m] in the flange's frame."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Directions:
    """Torques of one motion.

    Attributes:
        rest: torque without friction (N, n) [N m or N].
        friction: friction of the model (N, n) [N m or N], that at the reference temperature of a thermal model.
        payload: torque of a unit of each of the ten inertial parameters of a body on the flange (N, n, 10), the
            `PAYLOAD` directions first; of no columns where the flange is not known.
    """

    rest: Array
    friction: Array
    payload: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Baseline:
    """An identified model as the healthy state.

    Attributes:
        model: the model.
        thermal: its thermal models, or None.
        source: the file's content, which a state file repeats.
    """

    model: Model
    thermal: ThermalTorqueModel | None
    source: Mapping[str, Any]

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.model.robot

    @property
    def cutoff(self) -> float:
        """Cut-off of the smoothing [Hz]: that of the model, or a higher one that does not ring at stops."""
        # Least cut-off [Hz]: a low-pass rings at a stop, and the sign of the friction follows the ringing.
        return max(self.model.cutoff, 8.0)

    @property
    def residual(self) -> Array:
        """RMS error of the model on its own logs (n,) [N m or N]; NaN where the file does not state it."""
        return self._stated("residual_rms")

    @property
    def torque_rms(self) -> Array:
        """RMS torque of the model's logs (n,) [N m or N]; NaN where the file does not state it."""
        return self._stated("torque_rms")

    @property
    def speeds(self) -> Array:
        """Highest speeds of the model's logs (n,) [rad/s or m/s]; NaN where the file does not state them."""
        recorded = self.model.provenance.get("recorded")
        return np.full(self.robot.n, np.nan) if recorded is None else np.asarray(recorded["velocity"][0], dtype=float)

    @cached_property
    def time_constant(self) -> float | None:
        """Time constant of the heat that a diagnosis found [s]; None without one."""
        found = [e for e in self.model.extensions if e.effect == "thermal_friction"]
        return float(np.median([e.shape[0] for e in found])) if found else None

    @cached_property
    def _plain(self) -> Model:
        """The model without effects that keep heat: the monitor follows heat by itself."""
        kept = tuple(e for e in self.model.extensions if e.source.persistence is not Persistence.HEAT)
        return replace(self.model, extensions=kept)

    @cached_property
    def _carries(self) -> tuple[int, ...]:
        known = FLANGE not in self.robot.assumed
        return link_columns(self.model.torque_model) if known else ()

    @cached_property
    def _own(self) -> NDArray[np.bool_]:
        return np.array([column.friction for column in self.model.parameters])

    @property
    def payload_count(self) -> int:
        """Number of payload directions: 4, or 0 where the flange is not known."""
        return len(PAYLOAD) if self._carries else 0

    def directions(
        self, t: Array, q: Array, dq: Array, ddq: Array, *, gravity: ArrayLike | None, payload: Array | None
    ) -> Directions:
        """Evaluates the model on a motion (N, n) at times (N,).

        Args:
            t: [s].
            q: positions.
            dq: velocities.
            ddq: accelerations.
            gravity: as the log states it; None for the description's.
            payload: as the log states it; None for none.
        """
        model = self._plain
        columns = (*model.columns, *self._carries)
        Y = model.torque_model.under(gravity).regressor(q, dq, ddq, columns=columns)
        b = len(model.columns)
        rest = Y[:, :, :b][:, :, ~self._own] @ model.values[~self._own]
        friction = Y[:, :, :b][:, :, self._own] @ model.values[self._own]
        if self._carries:
            last = Y[:, :, b:]
            carried = last @ moved_body(self.robot.chain.tip)
            if payload is not None:
                rest = rest + carried @ np.asarray(payload, dtype=float)
            directions = carried
        else:
            directions = np.zeros((*q.shape, 0))
            if payload is not None:
                with_body(model.torque_model, np.zeros(model.torque_model.size), np.asarray(payload, dtype=float))
        if model.extensions:
            rest = rest + model.torque(q, dq, ddq, t, gravity=gravity) - model.torque(q, dq, ddq, gravity=gravity)
        return Directions(rest=rest, friction=friction, payload=directions)

    def _stated(self, name: str) -> Array:
        value = self.model.provenance.get(name)
        return np.full(self.robot.n, np.nan) if value is None else np.asarray(value, dtype=float)


def read_baseline(path: str | PathLike[str]) -> Baseline:
    """Reads a `model.json` of an identification, a diagnosis or a thermal fit.

    Args:
        path: the file, or the folder that holds it.

    Raises:
        InputError: a missing or damaged file, or a model without friction.
    """
    file = Path(path)
    file = file / "model.json" if file.is_dir() else file
    model = load_model(file)
    data = read_json(file, remedy="give the model.json of oed identify, oed diagnose or oed thermal")
    return baseline_of(model, data, file)


def baseline_of(model: Model, data: Mapping[str, Any] | None = None, file: Path | None = None) -> Baseline:
    """Makes a baseline of a model in memory.

    Args:
        model: the model.
        data: the content of its file, with a thermal part or without; made of the model by default.
        file: where it was read, for messages.

    Raises:
        InputError: a model without friction, or a damaged thermal part.
    """
    content = model.to_dict() if data is None else data
    if not any(column.friction for column in model.parameters):
        raise InputError("the model has no friction", file=file, remedy="identify the robot with friction")
    return Baseline(model=model, thermal=thermal_from_dict(model, content), source=content)
