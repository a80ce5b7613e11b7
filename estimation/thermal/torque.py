"""A torque model whose friction knows how warm it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from estimation.models.model import Model
from estimation.preprocessing import resample, smooth
from estimation.regressions.preparation import torque_of
from estimation.thermal.runs.condensed import Condensed
from estimation.uncertainty.quantiles import band_of
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Record
from robots.signals import Motion
from robots.thermal import ThermalModel, ThermalPath, build_thermal_model, simulate_motion


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalTorqueModel(Record):
    """tau = rigid body + (alpha (T - T0) + beta) friction, each joint with its own temperature.

    Attributes:
        model: rigid body, rotor, offset and friction at T0.
        thermal: each joint's thermal model (n,); None for a joint whose friction does not change.
    """

    ENTRIES = ("**model", "thermal.joints=thermal")

    model: Model
    thermal: tuple[ThermalModel | None, ...]

    def __post_init__(self) -> None:
        if len(self.thermal) != self.model.robot.n:
            raise InputError(f"{len(self.thermal)} thermal models", allowed=f"{self.model.robot.n}, one per joint")

    def split(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> tuple[Array, Array]:
        """Gives the torque without friction and the friction at T0, (N, n) each [N m or N]."""
        own = np.array([column.friction for column in self.model.parameters])
        parts = []
        for chosen in (~own, own):
            columns = [c for c, yes in zip(self.model.columns, chosen, strict=True) if yes]
            parts.append(self.model.torque_model.torque(q, dq, ddq, self.model.values[chosen], columns=columns))
        return parts[0], parts[1]

    def simulate(
        self,
        motion: Motion,
        *,
        ambient: ArrayLike | None = None,
        start: Sequence[ArrayLike | None] | None = None,
        resolution: float = 1.0,
    ) -> tuple[Array, tuple[ThermalPath | None, ...]]:
        """Predicts torques of a motion while it heats the joints.

        Args:
            motion: on the robot's clock; pauses between samples are rests.
            ambient: ambient temperature, a number or (N,) [degC]; each model's by default.
            start: temperatures of each joint's zones at first [degC]; ambient temperature by default.
            resolution: time over which power is averaged [s].

        Returns:
            Torques (N, n) [N m or N], and each joint's temperatures, friction, power and energy.

        Raises:
            InputError: another number of joints or of starts.
        """
        n = self.model.robot.n
        begins = [None] * n if start is None else list(start)
        if motion.n != n or len(begins) != n:
            raise InputError(f"a motion of {motion.n} joints, {len(begins)} starts", allowed=f"{n}")
        rigid, cold = self.split(motion.q, motion.dq, motion.ddq)
        torque = rigid + cold
        paths: list[ThermalPath | None] = []
        for j, thermal in enumerate(self.thermal):
            if thermal is None:
                paths.append(None)
                continue
            path = simulate_motion(
                thermal, motion.t, motion.dq[:, j], cold[:, j], ambient=ambient, start=begins[j], resolution=resolution
            )
            torque[:, j] = rigid[:, j] + path.friction
            paths.append(path)
        return torque, tuple(paths)

    def torque(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, temperature: ArrayLike) -> Array:
        """Predicts torques at given temperatures where heat is produced, (n,) or (N, n) [degC]."""
        rigid, cold = self.split(q, dq, ddq)
        T = np.broadcast_to(np.asarray(temperature, dtype=np.float64), cold.shape)
        factors = [
            np.ones(len(cold)) if thermal is None else thermal.friction_factor(T[:, j])
            for j, thermal in enumerate(self.thermal)
        ]
        return np.asarray(rigid + np.stack(factors, axis=1) * cold)


def thermal_from_dict(model: Model, data: Mapping[str, Any]) -> ThermalTorqueModel | None:
    """Reads the ``thermal`` entry of a `model.json`; None where it has none.

    Args:
        model: what the rest of the file describes.
        data: the file's content.

    Raises:
        InputError: an unknown thermal model, or another number of joints.
    """
    entry = data.get("thermal")
    if entry is None:
        return None
    try:
        joints = tuple(None if item is None else build_thermal_model(item) for item in entry["joints"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"thermal is damaged: {type(error).__name__} {error}", column="thermal") from error
    return ThermalTorqueModel(model=model, thermal=joints)


def error_band(model: ThermalTorqueModel, condensed: Condensed, factors: Sequence[Array]) -> list[float]:
    """Measures the 95 % quantile of the torque's error on rows of all logs.

    They are rows of the fit: a campaign has thousands a parameter.

    Args:
        model: the fitted model.
        condensed: its logs and their bins.
        factors: friction over that at T0 in each bin, (B,) by joint.

    Returns:
        Half-widths (n,) [N m or N].
    """
    cutoff = model.model.cutoff
    # Of so many rows the 95 % quantile is known to a percent.
    stride = max(1, sum(len(log) for log in condensed.logs) // 100_000)
    errors = []
    for k, log in enumerate(condensed.logs):
        motion, tau = smooth(resample(log.t, log.q), cutoff), torque_of(model.model.robot, log)
        t, edges = motion.t[::stride], condensed.edges[k]
        part = slice(int(condensed.offsets[k]), int(condensed.offsets[k + 1]))
        middles = (edges[1:] + edges[:-1]) / 2.0
        factor = np.stack([np.interp(t, middles, values[part]) for values in factors], axis=-1)
        rigid, cold = model.split(motion.q[::stride], motion.dq[::stride], motion.ddq[::stride])
        errors.append(np.abs(tau[::stride] - rigid - factor * cold))
    return band_of(np.concatenate(errors)).tolist()
