"""Result of monitoring stored logs: findings, trends, and a row per log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from estimation.monitoring.change_points import ChangePoint, find_change_points
from estimation.monitoring.findings import LIGHTS, Finding, Severity, when, worst
from estimation.monitoring.log_row import UNFIT, LogRow
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import write_atomic
from robots.common.records import Finding as Remark
from robots.common.records import Result, axes_for, findings_of, read, read_json
from robots.common.tables.table_files import read_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from estimation.monitoring.monitor import Monitor


RESULT, TABLE = "monitor.json", "trends.csv"
REMEDY = "give the folder written by `oed monitor`"
_COLUMNS = ("start", "end", "log", "friction_percent", "heat_percent", "rest_percent", "standard_error_percent")
HEAT_WORDS = {
    "model": "the thermal model",
    "temperature": "measured joint temperatures",
    "common": "heat states with assumed time constants, fitted to the logs",
    "none": "nothing",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class MonitorResult(Result, format="robot-oed monitoring", shares=("origin",)):
    """What a monitor found in logs.

    Attributes:
        robot: name of the robot.
        joint_names: (n,).
        heat: what explained the changes of friction that all joints share.
        false_alarm_hours: between false alarms [h of recorded motion].
        findings: in the order of their alarms.
        logs: a row per log.
        notes: what was found about the logs' clocks.
        history: columns over time, see `History.table`.
        origin: start of the first log [s].
        change_points: of the stored logs; None without the package `ruptures`.
    """

    FILE = RESULT
    ENTRIES = (
        "robot",
        "joint_names",
        "light",
        "severity",
        "verdict",
        "heat",
        "heat_percent=heat_range",
        "false_alarm_hours",
        "hours",
        "origin",
        "findings",
        "logs",
        "notes",
        "change_points",
    )

    robot: str
    joint_names: tuple[str, ...]
    heat: str
    false_alarm_hours: float
    findings: tuple[Finding, ...]
    logs: tuple[LogRow, ...]
    notes: tuple[str, ...]
    history: dict[str, Array]
    origin: float
    change_points: tuple[ChangePoint, ...] | None

    @classmethod
    def of(cls, monitor: Monitor, notes: Sequence[str]) -> MonitorResult:
        """Makes a result of a monitor's state.

        Raises:
            InputError: the monitor has seen no motion.
        """
        evaluation = monitor.evaluation
        history = evaluation.history.table()
        robot = monitor.baseline.robot
        return cls(
            robot=robot.name,
            joint_names=robot.joint_names,
            heat=evaluation.heat.kind,
            false_alarm_hours=monitor.settings.false_alarm_hours,
            findings=(*monitor.findings, *evaluation.unsettled(monitor.logs)),
            logs=tuple(monitor.rows),
            notes=tuple(notes),
            history=history,
            origin=evaluation.begin,
            change_points=find_change_points(history),
        )

    @property
    def severity(self) -> Severity:
        """The most urgent finding's; a last log that does not fit is to be watched."""
        undecided: list[Severity] = ["watch"] if self.undecided else []
        return worst([*(f.severity for f in self.findings), *undecided])

    @property
    def undecided(self) -> str:
        """Name of a last log that does not fit the model; empty without one."""
        return next((row.name for row in self.logs if row.undecided), "")

    @property
    def light(self) -> str:
        """Traffic light: green, amber or red."""
        return LIGHTS[self.severity]

    @property
    def hours(self) -> float:
        """Recorded motion [h]."""
        return float((self.history["end"] - self.history["start"]).sum() / 3600)

    @property
    def heat_range(self) -> tuple[float, float]:
        """Lowest and highest change of friction that temperature explains [%]."""
        heat = self.history["heat"]
        if not np.isfinite(heat).any():
            return 0.0, 0.0
        return float(100 * np.expm1(np.nanmin(heat))), float(100 * np.expm1(np.nanmax(heat)))

    @property
    def headline(self) -> Finding | None:
        """The most significant of the most urgent findings; None without one that asks for attention."""
        urgent = [f for f in self.findings if f.severity == self.severity != "info"]
        return max(urgent, key=lambda f: f.sigmas, default=None)

    def sentence(self) -> str:
        """Says what the headline is."""
        if self.headline is not None:
            return self.headline.sentence(self.origin)
        if self.undecided:
            return f"Log {self.undecided} {UNFIT}. The next log shows which."
        return "No change beyond what temperature explains."

    def advice(self) -> str:
        """Says what to do next; empty where nothing is to be done."""
        if self.headline is not None:
            return self.headline.advice()
        return "Check which robot this log belongs to." if self.undecided else ""

    @property
    def conclusion(self) -> str:
        """What to do about the most urgent findings."""
        urgent = [f for f in self.findings if f.severity == self.severity != "info"]
        if not urgent:
            return "No change beyond what temperature explains."
        return " ".join(dict.fromkeys(finding.advice() for finding in urgent))

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """The findings, logs that were left out, and notes."""
        found = (
            Remark(code=f"change.{f.severity}", text=f.sentence(self.origin), action=f.advice()) for f in self.findings
        )
        left_out = (
            Remark(code="log.left_out", subject=f"{row.name}:", text=f"left out: {row.note}")
            for row in self.logs
            if not row.used
        )
        return (*found, *left_out, *findings_of("monitor.note", self.notes))

    def verdict(self) -> str:
        """Says in some sentences what was found, and how much temperature explains."""
        low, high = self.heat_range
        start = {"act": "Action needed. ", "watch": "Watch this robot. ", "info": ""}[self.severity]
        heat = f" Temperature explains changes of friction of {low:+.0f} to {high:+.0f} %."
        return start + self.sentence() + ("" if self.heat == "none" else heat)

    def summary(self) -> str:
        """Gives verdict, findings, what to do, and what was left out."""
        used = [row for row in self.logs if row.used]
        lines = [
            f"{self.light.upper()}: {self.verdict()}",
            f"  {len(used)} logs, {self.hours:.2g} h of motion; friction changes by temperature: from "
            f"{HEAT_WORDS[self.heat]}; false alarms: one in {self.false_alarm_hours:g} h of motion",
        ]
        for f in self.findings:
            lines += [f"  {LIGHTS[f.severity]:5}  {f.sentence(self.origin)}", f"         {f.advice()}"]
        lines += [f"  {row.name}: left out: {row.note}" for row in self.logs if not row.used]
        lines += [f"  {note}" for note in self.notes]
        if self.change_points is None and len(used) > 1:
            lines.append("  Change points of the stored logs need the package ruptures: pip install ruptures.")
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gives the trends: a row per window and joint, changes in per cent of the model's friction."""
        import pandas as pd

        h = self.history
        count, n = h["friction"].shape
        return pd.DataFrame(
            {
                "start": np.repeat(h["start"], n),
                "end": np.repeat(h["end"], n),
                "log": np.repeat(h["log"].astype(int) + 1, n),
                "joint": np.tile(np.arange(1, n + 1), count),
                **{f"{name}_percent": 100 * np.expm1(h[name].ravel()) for name in ("friction", "heat", "rest")},
                "standard_error_percent": 100 * h["error"].ravel(),
            }
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each joint's change of friction that temperature does not explain, over the time since the first log.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes, hours = axes_for(ax, (7, 4)), (self.history["start"] - self.origin) / 3600.0
        for name, rest in zip(self.joint_names, self.history["rest"].T, strict=True):
            axes.plot(hours, 100.0 * np.expm1(rest), ".", markersize=3, label=name)
        axes.set_xlabel("time [h]")
        axes.set_ylabel("change of friction beyond temperature [%]")
        axes.legend()
        return axes

    @classmethod
    def load(cls, folder: str | Path) -> MonitorResult:
        """Reads the files of `save`.

        Args:
            folder: with `monitor.json` and `trends.csv`.

        Raises:
            InputError: a missing or damaged file, or one of an earlier version.
        """
        file = Path(folder) / RESULT
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=REMEDY)
        names = read(tuple[str, ...], data.get("joint_names"), "joint_names", file=file, remedy=REMEDY)
        columns = {name: np.asarray(x, dtype=float) for name, x in read_table(Path(folder) / TABLE).columns.items()}
        lacking = [name for name in _COLUMNS if name not in columns]
        if lacking:
            raise InputError("is missing", file=Path(folder) / TABLE, column=lacking[0], remedy=REMEDY)
        rows = {name: values.reshape(-1, len(names)) for name, values in columns.items()}
        history = {name: rows[name][:, 0] for name in ("start", "end")} | {"log": rows["log"][:, 0] - 1.0}
        history |= {name: np.log1p(rows[f"{name}_percent"] / 100.0) for name in ("friction", "heat", "rest")}
        history["error"] = rows["standard_error_percent"] / 100.0
        return cls.from_dict(data, file=file, remedy=REMEDY, history=history)

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `trends.csv`."""
        write_atomic(folder / TABLE, self.to_frame().to_csv(index=False), force=force)

    def rows_of(self, log: int) -> Sequence[int]:
        """Indices of the windows of a log, counted from 0."""
        return np.flatnonzero(self.history["log"] == log).tolist()

    def since(self, time: float) -> str:
        """Writes a time on the clock of the logs."""
        return when(time, self.origin)
