"""The object for streams: takes rows, gives findings, and is saved and loaded whole."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterable
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from estimation.models.model import model_from_dict
from estimation.monitoring.evaluation import Evaluation
from estimation.monitoring.findings import Finding
from estimation.monitoring.log_row import LogRow
from estimation.monitoring.settings import MonitorSettings
from estimation.monitoring.windows.baseline import Baseline, baseline_of, read_baseline
from estimation.monitoring.windows.projection import SLIDING_SPEED_SHARE
from estimation.monitoring.windows.stream_windows import StreamWindows
from estimation.monitoring.windows.window_rows import settling
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import write_atomic
from robots.common.parallel import one_blas_thread
from robots.common.records import Record, damage_refused, read, read_json


class Monitor(Record, format="robot-oed monitor", whole=True):
    """Follows a robot beside its identified model, and reports changes that temperature does not explain.

    Results depend on the rows alone, not on how they are cut into chunks, nor on restarts.

    Example:
        ``monitor = Monitor(read_baseline("model")); findings = monitor.update(t, q, tau)``

    Args:
        baseline: the identified model of the healthy robot.
        settings: windows, false-alarm rate and heat.

    Raises:
        InputError: settings that do not suit the model.
    """

    ENTRIES = (
        "model=baseline.source",
        "settings",
        "logs",
        "rows",
        "payload=_payload",
        "gravity=_gravity",
        "stream=_windows",
        "evaluation=_evaluation",
    )

    def __init__(self, baseline: Baseline, settings: MonitorSettings | None = None) -> None:
        self.baseline = baseline
        self.settings = settings or MonitorSettings()
        n = baseline.robot.n
        slowest = SLIDING_SPEED_SHARE * np.where(np.isfinite(baseline.speeds), baseline.speeds, 0.0)
        self._windows = StreamWindows(self.settings.window, settling(baseline.cutoff), 2 + 3 * n, slowest)
        self._evaluation: Evaluation | None = None
        self.logs: list[str] = []
        # Stored logs that it has decided on; those that were used in the order of `logs`.
        self.rows: list[LogRow] = []

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings so far, in the order of their alarms."""
        return () if self._evaluation is None else tuple(self._evaluation.findings)

    @property
    def evaluation(self) -> Evaluation:
        """What the windows gave so far.

        Raises:
            InputError: no row has come yet.
        """
        if self._evaluation is None:
            raise InputError("the monitor has seen no motion", remedy="give it rows, or longer logs")
        return self._evaluation

    @property
    def last(self) -> float | None:
        """Time of the newest row [s]; None without rows."""
        newest = self._windows.last
        if newest is None and self._evaluation is not None:
            return self._evaluation.end
        return newest

    def begin(self, log: str = "", *, payload: ArrayLike | None = None, gravity: ArrayLike | None = None) -> None:
        """Begins a recording: what came before is ended.

        Args:
            log: its name.
            payload: ten inertial parameters of what the flange carries in it, as `Log` has them; None for none.
            gravity: in the base frame (3,) [m/s2]; None for the description's.
        """
        self._consume(self._windows.end())
        self.logs.append(log)
        self._payload = None if payload is None else np.asarray(payload, dtype=float)
        self._gravity = None if gravity is None else np.asarray(gravity, dtype=float)

    _payload: Array | None = None
    _gravity: Array | None = None

    def update(
        self,
        t: ArrayLike,
        q: ArrayLike,
        tau: ArrayLike,
        *,
        temperature: ArrayLike | None = None,
        ambient: ArrayLike | None = None,
    ) -> tuple[Finding, ...]:
        """Takes rows of a stream, as many as there are.

        Args:
            t: increasing times (N,) [s], on the clock of all rows before.
            q: positions (N, n) [rad or m].
            tau: joint torques (N, n) [N m or N].
            temperature: of the joints (N, n) [degC], where it is measured.
            ambient: temperature of the surroundings (N,) [degC], where it is measured.

        Returns:
            New findings.

        Raises:
            InputError: arrays of other shapes, numbers that are not finite, or times that do not increase.
        """
        before = len(self.findings)
        rows = self._rows(t, q, tau, temperature, ambient)
        if not self.logs:
            self.logs.append("")
        if self._evaluation is None and len(rows):
            measured = temperature is not None and bool(np.isfinite(np.asarray(temperature, dtype=float)).any())
            self._evaluation = Evaluation(self.baseline, self.settings, measured=measured, begin=float(rows[0, 0]))
        self._consume(self._windows.add(rows))
        return self.findings[before:]

    def copy(self) -> Monitor:
        """A copy that goes its own way; the model is shared."""
        return copy.deepcopy(self, {id(self.baseline): self.baseline})

    def take(self, other: Monitor) -> None:
        """Goes on from the state of a copy."""
        self.__dict__.update(other.copy().__dict__)

    def finish(self) -> tuple[Finding, ...]:
        """Ends the recording, and concludes an alarm with the windows that there are.

        Returns:
            New findings.
        """
        before = len(self.findings)
        self._consume(self._windows.end())
        if self._evaluation is not None:
            self._evaluation.conclude(self.logs)
        return self.findings[before:]

    def _consume(self, windows: Iterable[tuple[Array, float, float, bool]]) -> None:
        for rows, start, end, last in windows:
            if self._evaluation is not None:
                with one_blas_thread():
                    self._evaluation.window(
                        rows, start, end, last=last, payload=self._payload, gravity=self._gravity, logs=self.logs
                    )

    def _rows(
        self, t: ArrayLike, q: ArrayLike, tau: ArrayLike, temperature: ArrayLike | None, ambient: ArrayLike | None
    ) -> Array:
        n = self.baseline.robot.n
        times = np.atleast_1d(np.asarray(t, dtype=float))
        count = len(times)
        parts: list[Array] = [times.reshape(count, 1)]
        for name, value, width, needed in (
            ("q", q, n, True),
            ("tau", tau, n, True),
            ("temp", temperature, n, False),
            ("temp_env", ambient, 1, False),
        ):
            if value is None:
                parts.append(np.full((count, width), np.nan))
                continue
            array = np.asarray(value, dtype=float)
            array = array.reshape(count, -1) if array.size == count * width else array
            if array.shape != (count, width):
                raise InputError(f"shape {array.shape}", column=name, allowed=f"({count}, {width})")
            if needed and not np.isfinite(array).all():
                row = int(np.argmin(np.isfinite(array).all(axis=1))) + 1
                raise InputError("a value that is not finite", column=name, row=row, remedy="leave the row out")
            parts.append(array)
        return np.column_stack(parts)

    def save(self, path: str | PathLike[str], *, force: bool = True) -> None:
        """Writes the state, whole or not at all; an older one is replaced.

        Args:
            path: the file.
            force: whether an existing file is replaced.

        Raises:
            InputError: it cannot be written.
        """
        write_atomic(path, json.dumps(self.to_dict(), allow_nan=False), force=force)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Monitor:
        """Reads a saved state; the monitor goes on as if it had never stopped.

        Raises:
            InputError: a missing or damaged file.
        """
        remedy = "start the monitor anew from the logs"
        data = read_json(path, cls.FORMAT, cls.FORMAT_VERSION, remedy=remedy)
        with damage_refused(path, remedy=remedy):
            found = cls(
                baseline_of(model_from_dict(data["model"]), data["model"]),
                read(MonitorSettings, data["settings"], "settings"),
            )
            found.logs = read(list[str], data["logs"], "logs")
            # A state of an older version has no rows.
            old = [LogRow(name=name) for name in found.logs]
            found.rows = read(list[LogRow], data["rows"], "rows") if "rows" in data else old
            found._payload = read(Array | None, data["payload"], "payload")
            found._gravity = read(Array | None, data["gravity"], "gravity")
            found._windows.restore(data["stream"])
            if data["evaluation"] is not None:
                found._evaluation = Evaluation.restored(data["evaluation"], found.baseline, found.settings)
        return found


def open_monitor(
    model: str | PathLike[str], *, state: Path | None = None, settings: MonitorSettings | None = None
) -> Monitor:
    """Makes a monitor, or goes on with one whose state was saved.

    Args:
        model: of the healthy robot, a `model.json` or its folder.
        state: file of the state; a new monitor where it does not exist.
        settings: of the monitor.

    Raises:
        InputError: a file that is no model or no state, or a state of another model or of other settings.
    """
    baseline, how = read_baseline(model), settings or MonitorSettings()
    if state is None or not state.exists():
        return Monitor(baseline, how)
    found = Monitor.load(state)
    if dict(baseline.source) != dict(found.baseline.source):
        remedy = "give the model of this state, or another --state file"
        raise InputError("the state is of another model", file=state, remedy=remedy)
    if found.settings != how:
        remedy = "give the same settings, or another --state file"
        raise InputError(f"the state has other settings: {found.settings}", file=state, remedy=remedy)
    return found
