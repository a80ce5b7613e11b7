"""Runs: identified models with what distinguishes them, such as file, date and temperature."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from estimation.models.model import Model, load_model
from robots.common.arrays import Array
from robots.common.plain import number
from robots.common.records import Record
from robots.common.tables.times import YEAR_2000
from robots.terms import PositionTorque

_DATE = re.compile(r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)(?:[T_ -]?([0-2]\d)[-:_h]?([0-5]\d))?(?!\d)")


@dataclass(frozen=True, kw_only=True)
class Run(Record):
    """One identified model among those compared.

    Attributes:
        label: its name in tables and pictures.
        model: parameters and covariance.
        date: seconds since 1970 at which its first log began; None where neither logs nor names state it.
        start: time of the first sample on the log's own clock [s]; None where the model does not state it.
        temperature: mean of each joint (n,) [degC], NaN where unknown; None without any.
        ambient: mean ambient temperature [degC], NaN where unknown.
        file: where the model or log was read from.
    """

    ENTRIES = ("label", "file", "date=date_text?", "start", "temperature", "ambient", "logs")

    label: str
    model: Model
    date: float | None = None
    start: float | None = None
    temperature: Array | None = None
    ambient: float = np.nan
    file: str = ""

    @property
    def date_text(self) -> str:
        """The date as text, empty where it is unknown."""
        return "" if self.date is None else f"{datetime.fromtimestamp(self.date, UTC):%Y-%m-%d %H:%M}"

    @property
    def logs(self) -> list[str | None]:
        """Names of the logs that the model was fitted to."""
        return [log.get("name") for log in self.model.provenance.get("logs", ())]


def run_of(model: Model, label: str, file: str | Path = "") -> Run:
    """Makes a run of a model, with date and temperatures as far as its logs or its name state them.

    Args:
        model: the model.
        label: its name.
        file: where it comes from; a date in the name of the file or its folder counts.
    """
    logs: Sequence[Mapping[str, Any]] = model.provenance.get("logs", ())
    start = float(logs[0]["start"]) if logs and logs[0].get("start") is not None else None
    names = [*reversed(Path(file).parts[-2:]), label, *(str(log.get("name", "")) for log in logs[:1])]
    date = start if start is not None and start >= YEAR_2000 else date_in(names)
    n, weights = model.robot.n, np.array([float(log.get("samples", 1)) for log in logs])
    rows = [
        [number(value, np.nan) for value in log["temperature"]] if log.get("temperature") else [np.nan] * n
        for log in logs
    ]
    temperature = _mean(np.array(rows, dtype=float), weights) if any(log.get("temperature") for log in logs) else None
    outside = np.array([[number(log.get("ambient"), np.nan)] for log in logs], dtype=float)
    return Run(
        label=label,
        model=model,
        date=date,
        start=start,
        temperature=temperature,
        ambient=float(_mean(outside, weights)[0]) if logs else np.nan,
        file=str(file),
    )


def with_position_torques(runs: Sequence[Run]) -> list[Run]:
    """Gives every model a torque by position where some have one.

    `identify` includes it where it predicts other motions better. A model without it states a torque of zero, which
    is as uncertain as that of the model with it.
    """
    has = [[column.term == PositionTorque.name for column in run.model.parameters] for run in runs]
    known = next((k for k, flags in enumerate(has) if any(flags)), None)
    if known is None:
        return list(runs)
    return [
        run if any(flags) else replace(run, model=_with_columns_of(run.model, runs[known].model, np.array(has[known])))
        for run, flags in zip(runs, has, strict=True)
    ]


def _with_columns_of(model: Model, other: Model, chosen: NDArray[np.bool_]) -> Model:
    """Gives a model that has some columns of another one (b,), with values of zero and its errors."""
    torque = replace(model.torque_model, terms=(*model.torque_model.terms, PositionTorque()))
    extra, provenance = np.flatnonzero(chosen), dict(model.provenance)
    if (share := provenance.get("prior_share")) is not None:
        shares = other.provenance.get("prior_share") or np.zeros(len(other.values))
        provenance["prior_share"] = [*share, *(float(shares[i]) for i in extra)]
    names = [*model.names, *(other.names[i] for i in extra)]
    return replace(
        model,
        torque_model=torque,
        columns=tuple(torque.names.index(name) for name in names),
        values=np.concatenate([model.values, np.zeros(len(extra))]),
        covariance=block_diag(model.covariance, other.covariance[np.ix_(extra, extra)]),
        determined=np.concatenate([model.determined, other.determined[extra]]),
        formulas=(*model.formulas, *(other.formulas[i] for i in extra)),
        provenance=provenance,
        felt=None if model.felt is None else np.concatenate([model.felt, np.zeros(len(extra))]),
    )


def read_model_runs(paths: Sequence[str | Path]) -> list[Run]:
    """Reads model files, each a run, labelled by what distinguishes their paths.

    Args:
        paths: of ``model.json`` files, or their folders.

    Raises:
        InputError: a missing file, one that is no model, or a model without covariance.
    """
    models = []
    for path in paths:
        file = Path(path) / "model.json" if Path(path).is_dir() else Path(path)
        models.append((load_model(file), file))
    labels = distinct_labels([file for _, file in models])
    return [run_of(model, label, file) for (model, file), label in zip(models, labels, strict=True)]


def distinct_labels(files: Sequence[Path]) -> list[str]:
    """Shortens paths to what distinguishes them: the folder's name for ``model.json``, the file's name otherwise."""
    stems = [file.parent if file.stem == "model" and file.parent.name else file.with_suffix("") for file in files]
    parts = [list(stem.resolve().parts) for stem in stems]
    labels: list[str] = []
    for own in parts:
        candidates = ["/".join(own[-length:]) for length in range(1, len(own))]
        alone = [c for i, c in enumerate(candidates, start=1) if sum("/".join(o[-i:]) == c for o in parts) == 1]
        # A file that is given twice has no label of its own.
        labels.append(alone[0] if alone else own[-1])
    return unique_labels(labels)


def unique_labels(labels: Sequence[str]) -> list[str]:
    """Numbers labels that occur more than once."""
    found: list[str] = []
    for label in labels:
        number_, name = 2, label
        while name in found:
            name, number_ = f"{label} ({number_})", number_ + 1
        found.append(name)
    return found


def in_time_order(runs: Sequence[Run]) -> tuple[list[Run], Array | None, str]:
    """Puts runs in order of time.

    Returns:
        The runs, hours (k,) since the first (None where no common clock is known), and what the order is by.
    """
    dates = [run.date for run in runs]
    if all(date is not None for date in dates) and len(set(dates)) == len(dates):
        order = np.argsort(np.array(dates, dtype=float), kind="stable")
        known = np.array(dates, dtype=float)[order]
        return [runs[i] for i in order], (known - known[0]) / 3600, "date"
    starts = np.array([np.nan if run.start is None else run.start for run in runs])
    if len(runs) > 1 and np.all(np.diff(starts) > 0):
        # Logs that all begin at zero have clocks of their own.
        return list(runs), (starts - starts[0]) / 3600, "clock of the logs"
    return list(runs), None, "as given"


def relabelled(runs: Sequence[Run]) -> list[Run]:
    """Gives runs whose labels are unique."""
    labels = unique_labels([run.label for run in runs])
    return [run if run.label == label else replace(run, label=label) for run, label in zip(runs, labels, strict=True)]


def date_in(names: Sequence[str]) -> float | None:
    """Finds the first date in some names [s since 1970]; None without one."""
    for name in names:
        for found in _DATE.finditer(name):
            year, month, day, hour, minute = (int(part or 0) for part in found.groups())
            try:
                return datetime(year, month, day, hour, minute, tzinfo=UTC).timestamp()
            except ValueError:
                continue
    return None


def _mean(rows: Array, weights: Array) -> Array:
    """Weighted mean of each column (c,), NaN without any known value."""
    known = np.isfinite(rows) * weights[:, None]
    total = known.sum(axis=0)
    return np.asarray(
        np.where(total > 0, (np.nan_to_num(rows) * known).sum(axis=0), np.nan) / np.where(total > 0, total, 1)
    )
