"""Result of a thermal fit: parameters, uncertainty, and undetermined quantities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.results.derived import SPAN, Quantity
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Finding, Result, axes_for, findings_of, read, read_json
from robots.thermal import ThermalModel, build_thermal_model

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, eq=False)
class RunFit:
    """One run beside what the model says of it.

    Attributes:
        name: of the run.
        channel: ``friction``, or the zone of a thermometer.
        t: times that were measured (M,) [s].
        heating: whether the joint was under power (M,).
        measured: friction torque [N m or N] or temperature [degC] (M,).
        predicted: the same by the model (M,).
        power: mean power while heating [W].
        start: temperatures of the zones at first [degC].
        ambient: surroundings at first [degC].
    """

    ENTRIES = ("name", "channel", "rows=t.size", "rms", "power", "start", "ambient")

    name: str
    channel: str
    t: Array
    heating: NDArray[np.bool_]
    measured: Array
    predicted: Array
    power: float
    start: tuple[float, ...]
    ambient: float

    @property
    def rms(self) -> float:
        """RMS of the error, in the unit of the measurement."""
        return float(np.sqrt(np.mean((self.measured - self.predicted) ** 2)))


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalEstimate(Result, format="robot-oed thermal model"):
    """A fitted thermal model and the evidence for it.

    Attributes:
        model: with the estimated parameters; those that are not determined are conventions that make it predict right.
        parameters: values, standard errors, and whether the data determine them.
        combinations: what the data determine even where they leave the parameters open.
        bounds: by name, numbers that only a bound is known of, such as a slow time constant of too short a log.
        covariance: of the parameters (p, p), zero where one is fixed.
        runs: the data beside the predictions.
        noise: standard deviation by channel: friction over cold friction, temperatures [K].
        proportional: whether the friction's noise goes with the torque.
        colour: honest over white-noise standard errors, median.
        log_likelihood: of the data, Gaussian, at the estimated noise.
        rows: number of measurements.
        free: number of numbers that were fitted.
        success: whether the solver found a minimum.
        status: what the solver said.
        notes: what a reader must know before using the numbers.
    """

    FILE = "thermal.json"
    ENTRIES = (
        "success",
        "status",
        "model",
        "parameters",
        "combinations",
        "bounds",
        "covariance",
        "noise",
        "noise_proportional=proportional",
        "colour",
        "log_likelihood",
        "aic",
        "bic",
        "rows",
        "free",
        "runs",
        "notes",
    )

    model: ThermalModel
    parameters: tuple[Quantity, ...]
    combinations: tuple[Quantity, ...]
    covariance: Array
    runs: tuple[RunFit, ...]
    noise: Mapping[str, float]
    proportional: bool
    colour: float
    log_likelihood: float
    rows: int
    free: int
    success: bool
    status: str
    bounds: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Quantity:
        """Finds a parameter or a combination by its name.

        Raises:
            InputError: the name is unknown.
        """
        everything = (*self.parameters, *self.combinations)
        for quantity in everything:
            if quantity.name == name:
                return quantity
        raise InputError(f"no quantity {name!r}", allowed=", ".join(quantity.name for quantity in everything))

    @property
    def time_constants(self) -> tuple[Quantity, ...]:
        """Time constants at the largest power of a run, the slow one first."""
        return tuple(q for q in self.combinations if "time constant" in q.name)[: len(self.model.zones)]

    @property
    def span(self) -> Quantity | None:
        """Highest over lowest friction factor in the logs; None without friction."""
        return next((q for q in self.combinations if q.name == SPAN), None)

    @property
    def aic(self) -> float:
        """Akaike's criterion: smaller is better."""
        return 2.0 * self.free - 2.0 * self.log_likelihood

    @property
    def bic(self) -> float:
        """Bayes' criterion: smaller is better."""
        return float(np.log(self.rows)) * self.free - 2.0 * self.log_likelihood

    @property
    def residual(self) -> float:
        """RMS of the friction's error over its measured RMS; NaN without friction."""
        parts = [run for run in self.runs if run.channel == "friction"]
        if not parts:
            return float("nan")
        error = np.concatenate([run.measured - run.predicted for run in parts])
        return float(np.sqrt(np.mean(error**2) / np.mean(np.concatenate([run.measured for run in parts]) ** 2)))

    @property
    def conclusion(self) -> str:
        """How well the model explains the measurements."""
        if not self.success:
            return f"The fit did not succeed: {self.status}."
        if np.isfinite(self.residual):
            return (
                f"The {self.model.name} thermal model explains the friction to {100 * self.residual:.2g} % of its RMS."
            )
        return f"The {self.model.name} thermal model explains {self.rows} temperatures."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """What the measurements do not determine, and notes."""
        open_ = [item.name for item in self.parameters if not item.determined]
        text = f"The measurements do not determine {', '.join(open_)}."
        return (
            *findings_of("thermal.undetermined", [text] if open_ else []),
            *findings_of("model.warning", self.notes),
        )

    def summary(self) -> str:
        """Lists determined and undetermined quantities."""
        head = f"{self.model.name} thermal model from {self.rows} measurements"
        if np.isfinite(self.residual):
            head += f", friction error {100 * self.residual:.2f} % of its RMS"
        lines = [head]
        for title, quantities in (("parameters", self.parameters), ("combinations", self.combinations)):
            lines.append(f"  {title}")
            for item in quantities:
                error = f"± {item.standard_error:.2g}" if np.isfinite(item.standard_error) else "fixed"
                mark = "" if item.determined else "  not determined"
                lines.append(f"    {item.name:36} {item.value:12.5g} {error:>10} {item.unit}{mark}")
        lines += [f"  {name} above {value:.4g}" for name, value in self.bounds.items()]
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter and combination."""
        import pandas as pd

        rows = [asdict(item) for item in (*self.parameters, *self.combinations)]
        kinds = ["parameter"] * len(self.parameters) + ["combination"] * len(self.combinations)
        return pd.DataFrame(rows).assign(kind=kinds).set_index("name")

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the friction, or without it the temperatures, against time, run by run.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (7, 4))
        shown = [run for run in self.runs if run.channel == "friction"] or list(self.runs)
        for run in shown:
            minutes = (run.t - run.t[0]) / 60.0
            (line,) = axes.plot(minutes, run.measured, ".", ms=2, alpha=0.5)
            axes.plot(minutes, run.predicted, color=line.get_color(), label=run.name)
        axes.set_xlabel("time [min]")
        axes.set_ylabel("friction [N m]" if shown[0].channel == "friction" else "temperature [°C]")
        axes.legend()
        return axes


def searched_parameters(fit: ThermalEstimate) -> list[str]:
    """Parameters that were searched and have both sides to move to; beta is the scale of the friction itself."""
    return [q.name for q in fit.parameters if np.isfinite(q.standard_error) and q.value != 0.0 and q.name != "beta"]


def with_errors(fit: ThermalEstimate, errors: Mapping[str, float]) -> ThermalEstimate:
    """Raises standard errors to at least those of a joint fit, by name."""
    parameters = tuple(
        replace(q, standard_error=max(q.standard_error, errors[q.name])) if q.name in errors else q
        for q in fit.parameters
    )
    return replace(fit, parameters=parameters)


def load_thermal_model(path: str | PathLike[str]) -> ThermalModel:
    """Reads the model of a saved estimate.

    Args:
        path: a `thermal.json`, or the folder that holds one.

    Raises:
        InputError: a missing or damaged file.
    """
    file = Path(path)
    file, remedy = file / ThermalEstimate.FILE if file.is_dir() else file, "fit the model again with oed thermal"
    data = read_json(file, ThermalEstimate.FORMAT, ThermalEstimate.FORMAT_VERSION, remedy=remedy)
    return build_thermal_model(read(dict[str, Any], data.get("model"), "model", file=file, remedy=remedy))
