"""Thermal models beside each other, as thesis Tables 6 and 7 have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.thermal.results.estimate import RunFit, ThermalEstimate
from robots.common.records import Record, axes_for

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True)
class PhaseErrors:
    """Errors of one model in heating or in cooling, as thesis Tables 6 and 7 have them.

    Measurements are averaged over two minutes first, the thesis' time between two: of single noisy samples the errors
    would be those of the noise.

    Attributes:
        mean: of the absolute error [N m, N or degC].
        largest: absolute error.
        steady: absolute mean error over the last tenth of the time.
        mean_share: mean over the measured mean.
        largest_share: largest over the measured value there.
        steady_share: steady over the measured value there.
    """

    mean: float
    largest: float
    steady: float
    mean_share: float
    largest_share: float
    steady_share: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """One model's fit and how well it predicts.

    Attributes:
        order: the model's name.
        estimate: fitted to all runs; None where it could not be.
        held_out: RMS of the error on what the fit had not seen: friction over its cold value, or temperatures [K]; NaN
            where it was not fitted.
        heating: errors under power at the largest power; None without.
        cooling: errors without power; None without.
        failure: why there is no estimate.
    """

    order: str
    estimate: ThermalEstimate | None
    held_out: float
    heating: PhaseErrors | None
    cooling: PhaseErrors | None
    failure: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalChoice(Record):
    """The models beside each other.

    Attributes:
        candidates: in the order in which they were asked for.
        best: name of the model of choice.
        held_out: what was held out, ``runs`` or ``end``.
    """

    ENTRIES = ("best", "held_out", "models=rows", "estimate")

    candidates: tuple[Candidate, ...]
    best: str
    held_out: str

    @property
    def estimate(self) -> ThermalEstimate:
        """The fit of choice."""
        found = next(c.estimate for c in self.candidates if c.order == self.best)
        assert found is not None
        return found

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row per model, as tables have it."""
        return [_row(item) for item in self.candidates]

    def summary(self) -> str:
        """Gives the table of thesis Tables 6 and 7, with held-out errors and criteria."""
        what = "one run after the other" if self.held_out == "runs" else "the last third of each run"
        lines = [
            f"held out: {what}; chosen model: {self.best}",
            "  model        held out        AIC        BIC   "
            "heating mean / largest / steady   cooling mean / largest / steady",
        ]
        for item in self.candidates:
            if item.estimate is None:
                lines.append(f"  {item.order:11} {item.failure}")
                continue
            lines.append(
                f"  {item.order:11} {item.held_out:9.4g} {item.estimate.aic:10.1f} {item.estimate.bic:10.1f}   "
                f"{_cells(item.heating):31}   {_cells(item.cooling)}"
            )
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per model."""
        import pandas as pd

        return pd.DataFrame(self.rows).set_index("model")

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each model's error against time, at the largest power."""
        axes = axes_for(ax, (7, 4))
        for item in self.candidates:
            if item.estimate is not None:
                run = max(item.estimate.runs, key=lambda run: (run.channel == "friction", run.power))
                axes.plot((run.t - run.t[0]) / 60.0, run.predicted - run.measured, ".", ms=2, label=item.order)
        axes.set_xlabel("time [min]")
        axes.set_ylabel("error")
        axes.legend(markerscale=4)
        return axes


def phase_errors(runs: Sequence[RunFit], *, heating: bool) -> PhaseErrors | None:
    """Errors of the run of the largest power, in one phase."""
    with_phase = [run for run in runs if np.any(run.heating == heating)]
    if not with_phase:
        return None
    run = max(with_phase, key=lambda run: (run.channel == "friction", run.power))
    mask = run.heating == heating
    # Measurements are averaged over so long before they are compared [s].
    index = ((run.t[mask] - run.t[mask][0]) / 120.0).astype(np.int64)
    counts = np.bincount(index)
    full = counts > 0
    measured = np.abs(np.bincount(index, run.measured[mask])[full] / counts[full])
    error = np.bincount(index, (run.predicted - run.measured)[mask])[full] / counts[full]
    last = max(1, len(error) // 10)
    worst = int(np.argmax(np.abs(error)))
    mean, largest, steady = float(np.abs(error).mean()), float(np.abs(error[worst])), float(abs(error[-last:].mean()))
    return PhaseErrors(
        mean=mean,
        largest=largest,
        steady=steady,
        mean_share=mean / float(measured.mean()),
        largest_share=largest / max(float(measured[worst]), 1e-300),
        steady_share=steady / max(float(measured[-last:].mean()), 1e-300),
    )


def _cells(errors: PhaseErrors | None) -> str:
    if errors is None:
        return "–"
    shares = (errors.mean_share, errors.largest_share, errors.steady_share)
    return " / ".join(f"{100 * share:.2f} %" for share in shares)


def _row(item: Candidate) -> dict[str, Any]:
    row: dict[str, Any] = {
        "model": item.order,
        "held_out": item.held_out,
        "aic": item.estimate.aic if item.estimate else np.nan,
        "bic": item.estimate.bic if item.estimate else np.nan,
    }
    for word, errors in (("heating", item.heating), ("cooling", item.cooling)):
        for name in ("mean", "largest", "steady", "mean_share", "largest_share", "steady_share"):
            row[f"{word}_{name}"] = getattr(errors, name) if errors else np.nan
    return row
