"""The evaluation: window by window, from rows to quantities, charts, alarms and findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.control_charts.charts import BurstChart
from estimation.monitoring.control_charts.quantities import Quantity, Sample, start_limit
from estimation.monitoring.findings import Finding
from estimation.monitoring.history import History
from estimation.monitoring.initial_quantities import initial_quantities
from estimation.monitoring.naming import changes_at, name_changes
from estimation.monitoring.observations import observed_values
from estimation.monitoring.settings import MonitorSettings
from estimation.monitoring.windows.baseline import Baseline
from estimation.monitoring.windows.heat import HeatState
from estimation.monitoring.windows.projection import WINDOW_NOISE_ORDER, Colour, Window, project
from estimation.monitoring.windows.window_rows import WindowRows, rows_of_window
from robots.common.arrays import Array
from robots.common.records import Record, read
from robots.terms.base import force_unit


class Evaluation(Record):
    """State of a monitor besides rows that wait.

    Args:
        baseline: the model.
        settings: of the monitor.
        measured: whether joint temperatures are measured.
        begin: time of the first row [s].
    """

    ENTRIES = (
        "measured",
        "begin",
        "end",
        "first",
        "heat",
        "quantities",
        "history=history.rows",
        "findings",
        "event",
        "forces",
        "colour=colour_sum,colour_rows,colour_count",
        "bursts",
        "bursts_in_row",
    )

    end: float | None
    first: float | None
    quantities: list[Quantity]
    findings: list[Finding]
    event: Event | None
    forces: list[tuple[float, float, int, int, float]]
    colour_sum: Array
    colour_rows: Array
    colour_count: Array
    bursts: BurstChart
    bursts_in_row: int

    def __init__(self, baseline: Baseline, settings: MonitorSettings, *, measured: bool, begin: float) -> None:
        kind = settings.heat
        if kind == "auto":
            kind = "model" if baseline.thermal is not None else "temperature" if measured else "common"
        self.baseline, self.settings, self.measured, self.begin = baseline, settings, measured, begin
        self.heat = HeatState(kind, baseline)
        self.n = baseline.robot.n
        self.end = None
        self.first = None
        self.quantities = []
        self.history = History(self.n)
        self.findings = []
        self.event = None
        self.forces = []
        self.colour_sum = np.zeros((self.n, WINDOW_NOISE_ORDER + 1))
        self.colour_rows = np.zeros(self.n)
        self.colour_count = np.zeros(self.n)
        self.bursts_in_row = 0
        self.bursts = BurstChart(self._run_length(1))
        self.noise_threshold = self.bursts.threshold

    def _run_length(self, count: int) -> float:
        """Windows between false alarms of each of all tests: three of each quantity, and that of short forces."""
        quantities = 3 * self.n + self.baseline.payload_count + 1
        hours = self.settings.false_alarm_hours * (3 * quantities + 1) / count
        return hours * 3600.0 / self.settings.window

    def window(
        self,
        rows: Array,
        start: float,
        end: float,
        *,
        last: bool,
        payload: Array | None,
        gravity: Array | None,
        logs: Sequence[str],
    ) -> None:
        """Evaluates one window.

        Args:
            rows: time, positions, torques, temperatures, ambient, with margins (N, 2 + 3 n).
            start: of the window [s].
            end: of the window [s].
            last: whether a pause follows.
            payload: that the recording states, or None.
            gravity: that the recording states, or None.
            logs: names of the recordings so far.
        """
        found = rows_of_window(self.baseline, rows, start, end, last=last, payload=payload, gravity=gravity)
        if found is None:
            return
        if self.end is not None:
            self.heat.pause(start - self.end, found.ambient)
        self.heat.temperatures = found.temperatures
        cold = np.maximum((found.directions.friction * found.dq).mean(axis=0), 0.0)
        self.heat.advance(cold * self._expected(), (end - start) / 2, found.ambient)
        window = self._project(found, start, end)
        if self.first is None:
            self.first = start
            self.quantities = initial_quantities(
                self.baseline, self.heat, self.settings, window, found.directions.payload, self._run_length(1)
            )
        factors = np.where(self._known(window), window.values[: self.n], self._expected())
        burst = self.bursts.update(window.burst)
        self.bursts_in_row = self.bursts_in_row + 1 if burst else 0
        # Windows in a row with a short force, from which the force is a lasting one.
        short = burst and self.bursts_in_row < 3
        # What a force at the end of the last window leaves in this one belongs to that force.
        # Longest time [s] that a short force goes on after its middle.
        ends = any(start - force[1] < 1.0 for force in self.forces)
        self._observe(window, len(logs) - 1, skip=short or ends)
        # What comes again in the next cycles is an error of the model on this motion.
        # A short force with more than this share of its chi-square in one of the next three windows is none.
        self.forces = [force for force in self.forces if window.burst < 0.25 * force[4]]
        # A motion on which the model errs more fills the window with error. A short force stands above it.
        if short and float(np.sum((window.burst_joints / window.burst_scatter) ** 2)) > self.noise_threshold:
            self._note_force(window, len(logs) - 1)
        self.heat.advance(cold * factors, (end - start) / 2, found.ambient)
        self.end = end
        # Windows between tests for steps, where no pause comes before.
        if self.event is None and (last or len(self.history.rows) % 30 == 0):
            self._test_steps(len(logs) - 1)
        self._settle(logs)

    def _test_steps(self, log: int) -> None:
        """Opens an event where the windows of a quantity hold a step; they have confirmed it already."""
        if self.end is None or self.first is None:
            return
        first, limit = self.first, start_limit(len(self.quantities))
        sources = [i for i, q in enumerate(self.quantities) if q.step_alarm() or q.differs_from_start(first, limit)]
        if sources:
            self.event = Event(time=self.end, log=log, sources=sources, windows=self.settings.confirm)

    def _expected(self) -> Array:
        """Expected friction factors (n,): by heat and the level so far."""
        found = np.ones(self.n)
        for j in range(self.n):
            features = self.heat.features(j)
            if features is None:
                continue
            mean = self.quantities[j].level.coefficients if self.quantities else self.heat.prior[0]
            found[j] = np.exp(np.clip(features @ mean, -3.0, 3.0))
        return found

    def _project(self, found: WindowRows, start: float, end: float) -> Window:
        seen = np.maximum(self.colour_count, 1.0)[:, None]
        colour = Colour.fit(self.colour_sum / seen, self.colour_rows).of(self.colour_count > 0)
        speeds = self.baseline.speeds
        usual = np.where(np.isfinite(speeds), speeds, np.abs(found.dq).max(axis=0))
        window = project(
            found.t,
            found.dq,
            found.tau,
            found.directions,
            colour=colour,
            expected=self._expected(),
            usual_speed=usual,
            edges=(start, end),
        )
        # Windows whose residual gives the colour of the noise.
        new = window.moves & (self.colour_count < 30)
        self.colour_sum += np.where(new[:, None], window.colour, 0.0)
        self.colour_rows += np.where(new, window.rows, 0.0)
        self.colour_count += new
        return window

    def _known(self, window: Window) -> NDArray[np.bool_]:
        """Joints (n,) whose friction factor the window determines."""
        factor = window.values[: self.n]
        error = np.sqrt(np.diag(window.covariance))[: self.n]
        # A friction factor with a larger relative standard error is not used in its window.
        return np.asarray(window.determined[: self.n] & (factor > 0.05) & (error < 0.25 * np.abs(factor)))

    def _observe(self, window: Window, log: int, *, skip: bool) -> None:
        """Gives each quantity its value in the window."""
        values, seen = observed_values(self.heat, self.quantities, window, self._known(window))
        known, heat = seen.known, seen.heat
        baseline = self.baseline.residual
        stated = window.moves & np.isfinite(baseline)
        misfit = float(np.median(window.residual_rms[stated] / baseline[stated])) if stated.any() else 1.0
        self.history.add(
            window.start,
            window.end,
            log,
            seen.friction,
            np.sqrt(seen.noise),
            np.where(known, heat, np.nan),
            seen.friction - heat,
            misfit,
        )
        if skip:
            return
        alarms = [
            v.index
            for v in values
            if self.quantities[v.index].observe(
                Sample(window.start, window.end, window.t, v.value, v.variance, v.features, v.unlogged),
                learn=self.event is None,
            )
        ]
        if self.event is not None:
            self.event.windows += 1
        elif alarms:
            self.event = Event(time=window.end, log=log, sources=alarms)

    def _note_force(self, window: Window, log: int) -> None:
        """Keeps a short force until later windows show whether a lasting change began."""
        felt = np.flatnonzero(np.abs(window.burst_joints) > 3.0)
        link = int(felt.max()) + 1 if len(felt) else 0
        self.forces.append((window.start, window.burst_at, log, link, window.burst))

    def _settle(self, logs: Sequence[str]) -> None:
        if self.event is not None and self.event.windows >= self.settings.confirm:
            self.conclude(logs)
        if self.event is None and self.end is not None:
            # Two windows without an alarm after it: what acted is over.
            over = [force for force in self.forces if self.end - force[0] > 3.5 * self.settings.window]
            self.findings += [contact_finding(force, logs) for force in over]
            self.forces = [force for force in self.forces if force not in over]

    def unsettled(self, logs: Sequence[str]) -> tuple[Finding, ...]:
        """Short forces in the newest windows: later ones show whether a lasting change began with them."""
        return tuple(replace(contact_finding(force, logs), settled=False) for force in self.forces)

    def conclude(self, logs: Sequence[str]) -> None:
        """Ends the confirmation of an alarm: names what changed, takes it as the new level, and goes on."""
        event, self.event = self.event, None
        if event is None:
            return
        sources = [self.quantities[i] for i in event.sources]
        changes = changes_at(self.quantities, sources, self.begin if self.first is None else self.first)
        robot = self.baseline.robot
        unit = "K" if self.heat.kind == "model" else "%"
        found = name_changes(
            changes,
            joints=self.n,
            units=[force_unit(robot, j) for j in range(self.n)],
            common_unit=unit,
            detected=event.time,
            log=logs[event.log],
        )
        self.findings += found
        if found:
            # What acted in the window of the change is the change itself.
            near = [f.earliest for f in found], [f.latest for f in found]
            low, high = min(near[0]) - self.settings.window, max(near[1]) + self.settings.window
            self.forces = [force for force in self.forces if not low <= force[1] <= high]
        for change in changes:
            q = change.quantity
            q.level.restart(*q.before[change.window], change.size, change.error**2)
            q.samples, q.before = [], []
        for q in self.quantities:
            q.chart.reset()

    @classmethod
    def restored(cls, data: Mapping[str, Any], baseline: Baseline, settings: MonitorSettings) -> Evaluation:
        """Reads `to_dict`."""
        known = {name: data[name] for name in ("measured", "begin")}
        found = cls.from_dict(data, whole=True, baseline=baseline, settings=settings, **known)
        found.heat = HeatState.from_dict(data["heat"], kind=data["heat"]["kind"], baseline=baseline)
        found.history.rows = read(list[list[float]], data["history"], "history")
        # A state of an older version has one number for all joints.
        found.colour_count = np.ones(found.n) * found.colour_count
        return found


@dataclass
class Event(Record, as_list=True):
    """An alarm that is being confirmed.

    Attributes:
        time: end of the window with the alarm [s].
        log: number of the log, from 0.
        sources: indices of the quantities with an alarm.
        windows: seen since.
    """

    time: float
    log: int
    sources: list[int]
    windows: int = 0


def contact_finding(force: tuple[float, float, int, int, float], logs: Sequence[str]) -> Finding:
    """The finding of a short force.

    Args:
        force: start of its window [s], its time [s], number of the log from 0, highest joint that felt it (0 for
            none), and its chi-square.
        logs: names of the logs.
    """
    _, at, log, link, _ = force
    return Finding(
        kind="contact",
        joint=None,
        size=0.0,
        low=0.0,
        high=0.0,
        unit="",
        earliest=at - 0.5,
        latest=at + 0.5,
        detected=at,
        sigmas=0.0,
        log=logs[log],
        text=f" (felt in the torque of joint {link} and below)" if link else "",
    )
