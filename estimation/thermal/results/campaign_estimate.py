"""Result of a campaign's fit of rigid body, friction and thermal models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from estimation.models.model import Model
from estimation.thermal.results.estimate import ThermalEstimate
from estimation.thermal.torque import ThermalTorqueModel
from robots.common.arrays import Array
from robots.common.records import Finding, Result, axes_for, findings_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, eq=False)
class CampaignEstimate(Result):
    """A torque model with heat, and the evidence for it.

    Attributes:
        torque_model: rigid body, friction at T0 and thermal models together.
        thermal: each joint's fit (n,); None where a joint does not move.
        residual_rms: of each joint's torque with heat (n,) [N m or N].
        residual_without: the same without heat (n,): one friction for cold and warm.
        rounds: of the two fits' turns.
        notes: what a reader must know.
    """

    ENTRIES = ("success", "residual_rms", "residual_without", "rounds", "notes", "thermal", "model=torque_model")

    torque_model: ThermalTorqueModel
    thermal: tuple[ThermalEstimate | None, ...]
    residual_rms: Array
    residual_without: Array
    rounds: int
    notes: tuple[str, ...] = ()

    @property
    def model(self) -> Model:
        """The torque model at T0."""
        return self.torque_model.model

    @property
    def success(self) -> bool:
        """Whether every joint's thermal fit succeeded."""
        return all(fit is not None and fit.success for fit in self.thermal)

    @property
    def gain(self) -> Array:
        """Share (n,) of each joint's error that the thermal model takes away."""
        return np.asarray(1.0 - self.residual_rms / np.maximum(self.residual_without, 1e-300))

    @property
    def conclusion(self) -> str:
        """Whether heat explains the friction of these logs."""
        share = round(100 * float(np.median(self.gain)))
        if share > 0:
            return (
                f"Use this thermal model: it reduces the torque error of the median joint by {share} %, compared with "
                "temperature-independent friction."
            )
        return "These logs show no effect of temperature: record from cold to warm, or use the model without heat."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What the logs do not determine, notes, and joints without a thermal model."""
        fits = [fit for fit in self.thermal if fit is not None]
        names = sorted({q.name for fit in fits for q in fit.parameters if not q.determined})
        text = f"These logs determine time constants and friction ratios, but not {', '.join(names)}."
        still = ", ".join(str(j) for j, fit in enumerate(self.thermal, start=1) if fit is None)
        rest = f"No thermal model for joint {still}: it does not move in the logs."
        return (
            *findings_of("thermal.undetermined", [text] if names else []),
            *findings_of("model.warning", self.joint_notes),
            *findings_of("joint.still", [rest] if still else []),
        )

    def summary(self) -> str:
        """Gives each joint's error with and without thermal model, time constants, the span of friction, and notes."""
        lines = [
            "  joint   torque error RMS  without   time constants slow / fast    highest over lowest\n"
            "          with thermal model          at the mean power, ± 95 %     friction in the logs, ± 95 %"
        ]
        for j, fit in enumerate(self.thermal):
            head = f"  {j + 1:5} {self.residual_rms[j]:14.4g} {self.residual_without[j]:11.4g}"
            if fit is None:
                lines.append(f"{head}     does not move")
                continue
            texts = " / ".join(
                f"{q.value / 60:.1f} ± {q.half_width / 60:.1f} min" if q.determined else "not determined"
                for q in fit.time_constants
            )
            seen = fit.span
            ratio = "not determined" if seen is None else f"{seen.value:.3f} ± {seen.half_width:.3f} times"
            lines.append(f"{head}     {texts}   {ratio}")
        return "\n".join([*lines, *(f"  {note}" for note in self.joint_notes)])

    @property
    def joint_notes(self) -> tuple[str, ...]:
        """Notes, with the joints they apply to unless they apply to all."""
        moving = sum(fit is not None for fit in self.thermal)
        found = []
        for note in self.notes:
            joints = [str(j) for j, fit in enumerate(self.thermal, start=1) if fit is not None and note in fit.notes]
            found.append(f"Joint {', '.join(joints)}: {note}" if 0 < len(joints) < moving else note)
        return tuple(found)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per joint and thermal quantity."""
        import pandas as pd

        frames = [fit.to_frame().assign(joint=j + 1) for j, fit in enumerate(self.thermal) if fit is not None]
        return pd.concat(frames)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each joint's friction over that at T0 against time."""
        axes = axes_for(ax, (7, 4))
        for j, fit in enumerate(self.thermal):
            for run in fit.runs if fit is not None else ():
                if run.channel == "friction":
                    (line,) = axes.plot(run.t / 60.0, run.measured, ".", ms=2, alpha=0.4)
                    axes.plot(run.t / 60.0, run.predicted, color=line.get_color(), label=f"joint {j + 1}")
        axes.set_xlabel("time [min]")
        axes.set_ylabel("friction over that at T0")
        axes.legend()
        return axes
