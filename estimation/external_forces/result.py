"""Forces of a log: contacts, and force and moment at the tool at each sample."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.contacts import Contact
from estimation.external_forces.thresholds.calibrations import Calibration
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import percent
from robots.common.records import Finding, Result, axes_for, findings_of, read, read_json
from robots.common.tables.table_files import read_table, write_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


AXES = ("x", "y", "z")
TABLE = "forces.csv"
REMEDY = "give the folder written by `oed force`"

_FORCE = [f"f{axis}" for axis in AXES]
_WRENCH = [f"w{what}{axis}" for what in "fm" for axis in AXES]
_OF_JOINTS = (("torque", "tau_ext", ""), ("deviation", "tau_ext", "_sd"), ("direct", "direct", ""))
"""Columns of the table that each joint has: the field, and how its name begins and ends."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceEstimate(Result, format="robot-oed forces", version=2):
    """External forces of one log.

    Attributes:
        robot: its name.
        joint_names: names (n,).
        t: times (N,) [s].
        torque: external joint torque by the momentum observer (N, n) [N m or N].
        direct: the same by inverse dynamics and the observer's filter (N, n) [N m or N].
        deviation: standard deviation of `torque` on a healthy robot (N, n) [N m or N].
        statistic: squared distance of the torque from zero over the threshold (N,): a contact where it exceeds 1.
        force: at the tool in the base frame, if there is no moment (N, 3) [N].
        force_deviation: standard deviation of its components (N, 3) [N].
        wrench: force and moment at the tool in the base frame (N, 6) [N, N m].
        wrench_deviation: standard deviation of its components (N, 6); infinite where the joints do not feel one.
        extrapolates: where (N,) the model extrapolates.
        flagged: where (N,) a contact is detected, see `find_contacts`.
        contacts: in the order of time.
        calibration: error model and threshold.
        warnings: limitations of the result.
    """

    FILE = "forces.json"
    ENTRIES = (
        "robot",
        "joint_names",
        "samples=t.size",
        "duration",
        "contacts",
        "flagged=flagged.mean",
        "extrapolates=extrapolates.mean",
        "false_alarm_rate=calibration.check.summary",
        "force_standard_deviation=median_deviation",
        "calibration",
        "warnings",
    )

    robot: str
    joint_names: tuple[str, ...]
    t: Array
    torque: Array
    direct: Array
    deviation: Array
    statistic: Array
    force: Array
    force_deviation: Array
    wrench: Array
    wrench_deviation: Array
    extrapolates: NDArray[np.bool_]
    flagged: NDArray[np.bool_]
    contacts: tuple[Contact, ...]
    calibration: Calibration
    warnings: tuple[str, ...] = ()

    @property
    def median_deviation(self) -> Array:
        """Median standard deviation of the force's components (3,) [N]; NaN where the joints never feel one."""
        known = np.where(np.isfinite(self.force_deviation), self.force_deviation, np.nan)
        return np.array([np.nan if np.isnan(column).all() else float(np.nanmedian(column)) for column in known.T])

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def reliability(self) -> str:
        """Says whether healthy motion confirms the false-alarm rate, and how much of the log extrapolates."""
        check = self.calibration.check
        rate = "the false-alarm rate is the model's claim: no healthy log tests it" if check is None else check.text()
        share = percent(float(self.extrapolates.mean()))
        return f"{rate}\n{share} of the samples extrapolate from the fitted motions: the threshold is higher there"

    @property
    def conclusion(self) -> str:
        """Whether there is a contact, and which is the largest."""
        largest = max(self.contacts, key=lambda contact: contact.magnitude, default=None)
        if largest is None:
            return "No contact was found in this log."
        count, alone = len(self.contacts), len(self.contacts) == 1
        return (
            f"Check the robot's surroundings: {'one contact' if alone else f'{count} contacts'}, "
            f"{'at' if alone else 'the largest at'} {largest.start:.4g} s with {largest.magnitude:.3g} N at the tool."
        )

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """The contacts, and warnings."""
        contacts = (
            Finding(
                code="contact",
                subject=f"{contact.start:.4g} s:",
                text=f"contact at {contact.place.text(self.joint_names)}, {contact.magnitude:.3g} N, for "
                f"{contact.end - contact.start:.2g} s.",
                action="Check what the robot touched.",
            )
            for contact in self.contacts
        )
        return (*contacts, *findings_of("force.note", self.warnings))

    def summary(self) -> str:
        """Says what was found, a line per contact."""
        threshold = self.calibration.threshold
        count = len(self.contacts)
        found = "no contact" if not count else "one contact" if count == 1 else f"{count} contacts"
        alarms = "1 false alarm" if threshold.rate == 1 else f"{threshold.rate:g} false alarms"
        lines = [
            f"{found} in {self.duration:.4g} s; threshold for {alarms} per hour, from {threshold.peaks} independent "
            f"peaks in {threshold.seconds:.3g} s of different motion",
            self.reliability,
        ]
        if count:
            lines.append("  start [s]  duration [s]  mean force at the tool [N]  x, y, z [N]            where")
        for contact in self.contacts:
            low, high = contact.magnitude_interval
            size = f"{contact.magnitude:.3g}" + (f" ({low:.3g} to {high:.3g})" if np.isfinite(high) else "")
            parts = ", ".join(f"{value:.3g}" for value in contact.force)
            where = contact.place.text(self.joint_names)
            lines.append(
                f"  {contact.start:9.2f}  {contact.end - contact.start:12.3g}  {size:>26}  {parts:22}  {where}"
            )
        if count:
            lines.append("  in parentheses: 95 % interval, by noise and the model's error")
        median = np.median(self.force_deviation, axis=0)
        if np.isfinite(median).any():
            words = ", ".join(f"{value:.2g}" if np.isfinite(value) else "unknown" for value in median)
            lines.append(f"median standard deviation of the force at the tool: {words} N along x, y, z of the base")
        else:
            lines.append("the joints do not feel all directions of a force at the tool, so its size is not known")
        return "\n".join([*lines, *self.warnings])

    def to_frame(self) -> pd.DataFrame:
        """Gives the samples as a table, see `save`."""
        import pandas as pd

        return pd.DataFrame(self._columns())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the force at the tool over time, and marks the contacts.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (7, 4))
        for name, values in zip(AXES, self.force.T, strict=True):
            axes.plot(self.t, values, linewidth=0.8, label=name)
        for number, contact in enumerate(self.contacts):
            axes.axvspan(contact.start, contact.end, alpha=0.2, color="red", label="contact" if number == 0 else None)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("force at the tool [N]")
        axes.legend()
        return axes

    @classmethod
    def load(cls, folder: str | Path) -> ForceEstimate:
        """Reads the files of `save`.

        Args:
            folder: with `forces.json` and `forces.csv`.

        Raises:
            InputError: a missing or damaged file, or one of an earlier version.
        """
        file, table = Path(folder) / cls.FILE, Path(folder) / TABLE
        data = read_json(file, cls.FORMAT, cls.FORMAT_VERSION, remedy=REMEDY)
        columns = {name: np.asarray(values, dtype=float) for name, values in read_table(table).columns.items()}
        names = read(tuple[str, ...], data.get("joint_names"), "joint_names", file=file, remedy=REMEDY)
        joints = range(1, 1 + len(names))

        def stacked(names: list[str]) -> Array:
            lacking = [name for name in names if name not in columns]
            if lacking:
                raise InputError("is missing", file=table, column=lacking[0], remedy=REMEDY)
            return np.column_stack([columns[name] for name in names])

        of_joints: dict[str, Any] = {
            field: stacked([f"{name}{j}{end}" for j in joints]) for field, name, end in _OF_JOINTS
        }
        return cls.from_dict(
            data,
            file=file,
            remedy=REMEDY,
            t=columns["t"],
            statistic=columns["statistic"],
            extrapolates=columns["extrapolates"] > 0.0,
            flagged=columns["contact"] > 0.0,
            force=stacked(_FORCE),
            force_deviation=stacked([f"{name}_sd" for name in _FORCE]),
            wrench=stacked(_WRENCH),
            wrench_deviation=stacked([f"{name}_sd" for name in _WRENCH]),
            **of_joints,
        )

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes ``forces.csv``.

        The table has t, contact (0 or 1, from when the statistic passes the threshold until it has been below for the
        observer's memory), statistic (1 is the threshold), extrapolates, the force fx.. at the tool if
        there is no moment, force and moment wfx.., wmx.., each with _sd, and the external joint torques tau_ext1..
        """
        units = {"t": "s", **{f"f{k}{end}": "N" for k in AXES for end in ("", "_sd")}}
        write_table(folder / TABLE, self._columns(), {"content": "external forces"}, units=units, force=force)

    def _columns(self) -> dict[str, Array]:
        columns = {"t": self.t, "contact": self.flagged.astype(float), "statistic": self.statistic}
        columns["extrapolates"] = self.extrapolates.astype(float)
        loads = ((_FORCE, self.force, self.force_deviation), (_WRENCH, self.wrench, self.wrench_deviation))
        for names, values, deviations in loads:
            for k, name in enumerate(names):
                columns[name], columns[f"{name}_sd"] = values[:, k], deviations[:, k]
        for j in range(self.torque.shape[1]):
            for field, name, end in _OF_JOINTS:
                columns[f"{name}{j + 1}{end}"] = getattr(self, field)[:, j]
        return columns
