"""The verb: predicts the torques of a motion, and measures the error where they were logged."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimation.model import Model
from estimation.preparation import torque_of
from estimation.preprocessing import resample, smooth
from robots.common.errors import InputError
from robots.common.tables import write_table
from robots.signals import Log, Motion

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Torques of a motion.

    Attributes:
        motion: smoothed as the model's data were.
        predicted: torque (N, n) [N m or N].
        measured: torque (N, n) as logged, or None.
        joint_names: names (n,).
    """

    motion: Motion
    predicted: Array
    measured: Array | None
    joint_names: tuple[str, ...]

    @property
    def error_rms(self) -> Array:
        """RMS of measured less predicted torque (n,); NaN without measurement."""
        if self.measured is None:
            return np.full(self.predicted.shape[1], np.nan)
        return np.sqrt(np.mean((self.measured - self.predicted) ** 2, axis=0))

    @property
    def nrmse(self) -> Array:
        """Error RMS over torque RMS (n,)."""
        return self._over(self.error_rms, None if self.measured is None else np.sqrt(np.mean(self.measured**2, axis=0)))

    @property
    def relative_spread(self) -> Array:
        """Standard deviation of the error over that of the torque (n,): 1 is no better than a constant."""
        if self.measured is None:
            return self.error_rms
        return self._over((self.measured - self.predicted).std(axis=0), self.measured.std(axis=0))

    def _over(self, error: Array, scale: Array | None) -> Array:
        if scale is None:
            return error
        return np.divide(error, scale, out=np.full_like(error, np.nan), where=scale > 0)

    def summary(self) -> str:
        """Gives the error per joint, where torque was logged."""
        samples = len(self.motion)
        if self.measured is None:
            return f"torques of {samples} samples; the log has none to compare with"
        lines = [f"torques of {samples} samples", "  joint                  error RMS   over RMS   std over std"]
        rows = zip(self.joint_names, self.error_rms, self.nrmse, self.relative_spread, strict=True)
        lines += [
            f"  {j} {name[:18]:18} {rms:12.4g} {100 * share:8.2f} % {100 * spread:12.2f} %"
            for j, (name, rms, share, spread) in enumerate(rows, start=1)
        ]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Gives the errors as plain data."""
        quantities = {
            "error_rms": self.error_rms,
            "nrmse": self.nrmse,
            "error_std_over_torque_std": self.relative_spread,
        }
        return {
            "samples": len(self.motion),
            **{name: [float(v) if np.isfinite(v) else None for v in values] for name, values in quantities.items()},
        }

    def to_frame(self) -> pd.DataFrame:
        """Gives t, tau1.. as a table."""
        import pandas as pd

        return pd.DataFrame(self._columns())

    def save(self, path: str | Path, *, force: bool = False) -> None:
        """Writes t, tau1..taun as CSV or Parquet.

        Raises:
            InputError: the file is there, and force is not given.
        """
        write_table(path, self._columns(), {"content": "predicted joint torques"}, force=force)

    def _columns(self) -> dict[str, Array]:
        joints = range(self.predicted.shape[1])
        return {"t": self.motion.t, **{f"tau{j + 1}": self.predicted[:, j] for j in joints}}


def predict(model: Model, log: Log) -> Prediction:
    """Predicts the torques of a log's motion.

    Args:
        model: an identified model.
        log: positions over time; its torque, if any, is compared with the prediction and not used otherwise.

    Returns:
        The torques at the log's own times.

    Raises:
        InputError: another number of joints, or too few rows.
    """
    robot = model.robot
    if log.n != robot.n:
        raise InputError(
            f"{log.n} joints", file=log.metadata.get("file"), allowed=f"{robot.n}, as the model of {robot.name} has"
        )
    cutoff = float(model.provenance.get("cutoff_hz", 10.0))
    motion = smooth(resample(log.t, log.q), cutoff)
    has_torque = log.tau is not None or log.current is not None
    return Prediction(
        motion=motion,
        predicted=model.torque(motion.q, motion.dq, motion.ddq),
        measured=torque_of(robot, log) if has_torque else None,
        joint_names=robot.joint_names,
    )
