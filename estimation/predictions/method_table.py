"""Estimators against each other on the same logs and the same held-out data."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.estimators import ESTIMATORS
from estimation.identifications.identification import identify
from estimation.predictions.prediction import predict
from robots.common.arrays import Array
from robots.common.errors import InputError, OedError
from robots.common.progress import SILENT, Progress
from robots.common.records import plain
from robots.robot import Robot
from robots.signals import Log

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class MethodRow:
    """One estimator's result.

    Attributes:
        method: its name.
        unseen: standard deviation of the error over that of the torque on held-out data (n,); NaN where it failed.
        determined: share of parameters that it determines.
        seconds: of processor time.
        problem: why it failed; empty where it did not.
    """

    ENTRIES = ("method", "unseen=errors", "determined", "seconds", "problem")

    method: str
    unseen: Array
    determined: float
    seconds: float
    problem: str = ""

    @property
    def errors(self) -> Array | None:
        """The errors; None where it failed."""
        return None if self.problem else self.unseen


@dataclass(frozen=True, kw_only=True)
class MethodTable:
    """Estimators on the same data.

    Attributes:
        rows: one per estimator, the smallest mean error first.
        joint_names: names (n,).
    """

    rows: tuple[MethodRow, ...]
    joint_names: tuple[str, ...]

    def summary(self) -> str:
        """Gives a line per estimator: error per joint, their mean, what it determines, and its time."""
        lines = [
            "error on held-out data / torque, standard deviations [%] per joint; mean; determined parameters; time"
        ]
        for row in self.rows:
            if row.problem:
                lines.append(f"  {row.method:12} {row.problem}")
                continue
            joints = " ".join(f"{100 * value:6.1f}" for value in row.unseen)
            lines.append(
                f"  {row.method:12} {joints}  {100 * row.unseen.mean():6.1f}  {100 * row.determined:5.0f} %"
                f"  {row.seconds:6.2f}"
            )
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per estimator."""
        import pandas as pd

        return pd.DataFrame(plain(self.rows)).set_index("method")


def compare_methods(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    methods: Sequence[str] | None = None,
    held_out: Log | Sequence[Log] | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> MethodTable:
    """Identifies with several estimators and predicts held-out data.

    Args:
        robot: the robot.
        logs: what is fitted.
        methods: names of estimators; all by default.
        held_out: unseen logs; by default the last of several logs, or the last stretch of a single one.
        progress: receives the progress.
        options: of `identify`.

    Returns:
        The table. An estimator that cannot do it, for want of what it needs, has its reason in place of numbers.

    Raises:
        InputError: no logs, or unknown methods.
    """
    seen = [logs] if isinstance(logs, Log) else list(logs)
    if not seen:
        raise InputError("no logs", allowed="one or more")
    if held_out is not None:
        unseen = [held_out] if isinstance(held_out, Log) else list(held_out)
    elif len(seen) > 1:
        seen, unseen = seen[:-1], seen[-1:]
    else:
        # In a single log, the last part is held out: one contiguous part, never shuffled samples.
        middle = int(0.7 * len(seen[0]))
        seen, unseen = [seen[0].rows(slice(0, middle))], [seen[0].rows(slice(middle, None))]
    names = list(methods or ESTIMATORS)
    unknown = [name for name in names if name not in ESTIMATORS]
    if unknown:
        raise InputError(f"method {unknown[0]!r}", allowed=", ".join(ESTIMATORS))
    bar = progress or SILENT
    bar.start("comparing estimators", float(len(names)))
    rows = []
    for done, name in enumerate(names):
        bar.update(float(done), name)
        rows.append(_row(robot, seen, unseen, name, options))
    bar.finish()
    order = sorted(rows, key=lambda row: (bool(row.problem), float(np.nan_to_num(row.unseen.mean(), nan=np.inf))))
    return MethodTable(rows=tuple(order), joint_names=robot.joint_names)


def _row(robot: Robot, seen: list[Log], unseen: list[Log], method: str, options: dict[str, Any]) -> MethodRow:
    start = time.process_time()
    try:
        model = identify(robot, seen, method=method, **options).model
    except OedError as error:
        nothing = np.full(robot.n, np.nan)
        return MethodRow(method=method, unseen=nothing, determined=0.0, seconds=0.0, problem=str(error))
    seconds = time.process_time() - start
    predictions = [predict(model, log) for log in unseen]
    errors = [p.measured - p.predicted for p in predictions if p.measured is not None]
    torque = np.concatenate([p.measured for p in predictions if p.measured is not None])
    spread = np.concatenate(errors).std(axis=0) / np.maximum(torque.std(axis=0), np.finfo(float).tiny)
    return MethodRow(method=method, unseen=spread, determined=float(model.determined.mean()), seconds=seconds)
