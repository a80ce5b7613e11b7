"""Identified drives of several runs, days or robots against each other: what is common, and what differs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import f

from estimation.actuators import Actuators, load_actuators
from estimation.comparisons.hypothesis_tests import adjust_holm, agreement_test
from estimation.comparisons.runs import date_in, distinct_labels, unique_labels
from estimation.logs.provenance import are_same_log
from estimation.uncertainty.quantiles import NORMAL_95, chi2_limit, normal_limit
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import number, percent
from robots.common.records import Finding, Record, Result, axes_for, findings_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


FALSE_ALARMS = 0.01
"""Chance of any false alarm among all tests of a comparison."""
EFFICIENCY = 0.37
"""Efficiency of a median of chi-squares of one degree of freedom, beside their mean."""
FEWEST = 3
"""Joints from which on a change may be called common to all."""
CAUSES = {
    ("viscous", "coulomb", "stribeck"): "temperature, lubrication or wear of all joints",
    ("kp", "kd", "kr", "kv", "ki", "torque_limit", "stall_torque", "no_load_speed"): "supply voltage or settings",
    ("torque_constant",): "temperature of the motors, or another scale of the current",
    ("armature", "stiffness", "backlash", "mass_factor"): "another robot, gear or load",
    ("delay",): "the path of the commands",
    ("torque_offset", "encoder_zero"): "another pose of the base, cables, or a new calibration",
}
"""What usually changes a parameter of all joints."""


@dataclass(frozen=True, kw_only=True)
class DriveRun(Record):
    """One result among those compared.

    Attributes:
        label: its name in tables and pictures.
        robot: its robot.
        error: held-out error of the simulated position [rad or m].
        date: seconds since 1970, from a date in a file's or a log's name; None without.
        temperature: mean of all joints [degC]; NaN where no log states it.
        effects: effects that were found, with their joints.
        file: where it was read from.
    """

    label: str
    robot: str
    error: float
    date: float | None = None
    temperature: float = np.nan
    effects: tuple[str, ...] = ()
    file: str = ""


@dataclass(frozen=True, kw_only=True)
class DriveDifference(Record):
    """One parameter in all runs.

    Attributes:
        parameter: such as ``viscous``.
        group: the joint or class that has it.
        unit: its unit.
        values: of the runs (k).
        errors: standard errors (k), with what the runs scatter beyond their own errors.
        statistic: Cochran's Q.
        p_value: probability of a larger one if the runs agree.
        adjusted: p-value by Holm over all parameters.
        differs: whether the difference is significant.
        common: weighted mean of the runs.
        common_error: its standard error.
    """

    parameter: str
    group: str
    unit: str
    values: tuple[float, ...]
    errors: tuple[float, ...]
    statistic: float
    p_value: float
    adjusted: float
    differs: bool
    common: float
    common_error: float

    @property
    def name(self) -> str:
        """Parameter and group."""
        return f"{self.parameter} {self.group}"

    def change(self, run: int) -> float:
        """Gives the change of a run against the first, as a fraction of the first."""
        return (self.values[run] - self.values[0]) / abs(self.values[0]) if self.values[0] else np.nan


@dataclass(frozen=True, kw_only=True)
class CommonChange(Record):
    """A change that all joints share.

    Attributes:
        parameter: such as ``viscous``.
        run: index of the run, against the first.
        change: mean of the joints' changes, as a fraction.
        lower: end of its 95 % interval, from the scatter of the joints.
        upper: the other end.
        joints: number of joints or classes.
    """

    parameter: str
    run: int
    change: float
    lower: float
    upper: float
    joints: int

    @property
    def cause(self) -> str:
        """What usually changes this parameter of all joints."""
        return next((cause for names, cause in CAUSES.items() if self.parameter in names), "one cause for all joints")


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveComparison(Result, format="robot-oed drive comparison"):
    """Drives of several runs against each other.

    Attributes:
        robot: name of the first run's robot.
        runs: in the given order, or by their dates; the first is the baseline.
        alpha: chance of any false alarm among all tests.
        spread: factor on all standard errors: what the runs scatter beyond their own errors, 1 or more.
        differences: parameters that all runs determine.
        shared: changes that all joints share.
        notes: limitations.
    """

    FILE = "compare.json"
    ENTRIES = ("robot", "verdict=conclusion", "runs", "alpha", "spread", "differences", "shared", "notes")

    robot: str
    runs: tuple[DriveRun, ...]
    alpha: float
    spread: float
    differences: tuple[DriveDifference, ...]
    shared: tuple[CommonChange, ...]
    notes: tuple[str, ...] = ()

    @property
    def different(self) -> tuple[DriveDifference, ...]:
        """Parameters that differ, the surest first."""
        return tuple(sorted((item for item in self.differences if item.differs), key=lambda item: item.p_value))

    @property
    def effects(self) -> dict[str, tuple[str, ...]]:
        """Effects that some runs have and others have not, with the labels of those that have them."""
        every = dict.fromkeys(effect for run in self.runs for effect in run.effects)
        having = {effect: tuple(run.label for run in self.runs if effect in run.effects) for effect in every}
        return {effect: labels for effect, labels in having.items() if len(labels) < len(self.runs)}

    @property
    def alone(self) -> tuple[DriveDifference, ...]:
        """Parameters that differ in single joints, beside what all joints share."""
        common = {item.parameter for item in self.shared}
        return tuple(item for item in self.different if item.parameter not in common)

    @property
    def conclusion(self) -> str:
        """What differs."""
        parts = []
        for item in self.shared:
            parts.append(
                f"{item.parameter} of all joints changed by {percent(item.change)} in {self.runs[item.run].label} "
                f"({item.cause})"
            )
        single = self.alone
        if single:
            names = ", ".join(item.name for item in single[:5]) + (", ..." if len(single) > 5 else "")
            parts.append(f"single joints differ in {names}")
        if not parts:
            return "No difference is significant: the runs agree within their errors."
        return f"The runs differ: {'; '.join(parts)}."

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Changes of all joints, of single ones, effects of some runs, and notes."""
        found = [
            Finding(
                code="difference",
                subject=f"{item.parameter} of all {item.joints} joints:",
                text=f"{percent(item.change)} in {self.runs[item.run].label} (95 % interval {percent(item.lower)} to "
                f"{percent(item.upper)}). Usual causes: {item.cause}.",
            )
            for item in self.shared
        ]
        found += [
            Finding(
                code="difference.joint",
                subject=f"{item.name}:",
                text=", ".join(
                    f"{value:.4g} ± {error:.2g} in {run.label}"
                    for value, error, run in zip(item.values, item.errors, self.runs, strict=True)
                )
                + f" {item.unit}.",
            )
            for item in self.alone
        ]
        found += [
            Finding(code="difference", subject=f"{effect}:", text=f"found in {', '.join(labels)} only.")
            for effect, labels in self.effects.items()
        ]
        return (*found, *findings_of("comparison.note", self.notes))

    def summary(self) -> str:
        """Lists runs, changes of all joints, parameters that differ, and what is common."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.robot}: drives of {len(self.runs)} runs; baseline {self.runs[0].label}"
        for run in self.runs:
            warm = f"  joints {run.temperature:.1f} degC" if np.isfinite(run.temperature) else ""
            yield f"  {run.label:24} held-out error {1e3 * run.error:.3g} mrad{warm}"
        yield self.conclusion
        yield (
            f"  chance of any false alarm {100 * self.alpha:g} % (Holm); standard errors times {self.spread:.2g}, "
            "by which the runs scatter"
        )
        for effect, labels in self.effects.items():
            yield f"  {effect}: found in {', '.join(labels)} only"
        yield "  parameter                          " + "".join(f"{run.label[:14]:>16}" for run in self.runs) + "   p"
        for item in self.differences:
            mark = "differs" if item.differs else ""
            values = "".join(f"{value:16.4g}" for value in item.values)
            yield f"  {item.name[:34]:34} {values}   {item.adjusted:.2g} {mark}".rstrip()
        yield from (f"  {note}" for note in self.notes)

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per parameter."""
        import pandas as pd

        rows = []
        for item in self.differences:
            own: dict[str, object] = {
                f"value, {run.label}": value for run, value in zip(self.runs, item.values, strict=True)
            }
            own.update({f"error, {run.label}": error for run, error in zip(self.runs, item.errors, strict=True)})
            tested: dict[str, object] = {"adjusted_p": item.adjusted, "differs": item.differs, "common": item.common}
            named: dict[str, object] = {"parameter": item.parameter, "group": item.group, "unit": item.unit}
            rows.append(named | own | tested)
        return pd.DataFrame(rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each parameter's deviation from the common value, in standard errors of that run.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (8, 4))
        place = np.arange(len(self.differences))
        for k, run in enumerate(self.runs):
            off = [(item.values[k] - item.common) / item.errors[k] for item in self.differences]
            axes.plot(place, off, "o", label=run.label)
        axes.axhspan(-NORMAL_95, NORMAL_95, alpha=0.15)
        axes.set_xticks(place, [item.name for item in self.differences], rotation=90)
        axes.set_ylabel("deviation from the common value [standard errors]")
        axes.legend()
        return axes


def read_drive_runs(paths: Sequence[str | Path]) -> tuple[tuple[Actuators, ...], tuple[str, ...]]:
    """Reads results of `oed actuators`, and labels them by what distinguishes their paths.

    Args:
        paths: of ``actuators.json`` files, or their folders.

    Raises:
        InputError: a missing file, or one that holds no drives.
    """
    files = [Path(path) / Actuators.FILE if Path(path).is_dir() else Path(path) for path in paths]
    results = tuple(load_actuators(file) for file in files)
    stems = [file.parent / "model.json" if file.name == Actuators.FILE else file for file in files]
    return results, tuple(distinct_labels(stems))


def compare_drives(
    results: Sequence[Actuators], labels: Sequence[str] = (), *, alpha: float = FALSE_ALARMS
) -> DriveComparison:
    """Compares identified drives: which parameters differ, in all joints or in single ones, and what is common.

    Each parameter is tested by Cochran's Q. What a drive's model lacks makes runs scatter beyond their standard errors.
    That is estimated from the median statistic of all parameters, and all errors grow by it (Birge ratio): only what
    differs more than the others do is significant.

    Args:
        results: two or more, of robots with the same joints.
        labels: their names; the robots' names by default.
        alpha: chance of any false alarm among all tests.

    Raises:
        InputError: fewer than two results, other joints or laws, or two results of one log.

    Source:
        Cochran 1954; Birge 1932; Holm 1979.
    """
    names = list(unique_labels(list(labels) or [result.robot for result in results]))
    _require_comparable(results, names)
    runs = [_run(result, label) for result, label in zip(results, names, strict=True)]
    order = list(range(len(runs)))
    dates = [run.date for run in runs]
    if all(date is not None for date in dates) and len(set(dates)) == len(dates):
        order.sort(key=lambda k: dates[k] or 0.0)
    results, runs = [results[k] for k in order], [runs[k] for k in order]
    tables = [{(v.parameter, v.group): v for v in result.parameters} for result in results]
    both = [key for key in tables[0] if all(key in table for table in tables)]
    known = [key for key in both if all(t[key].status == "identified" and t[key].standard_error > 0 for t in tables)]
    if not known:
        raise InputError(
            "no parameter is determined in all runs", remedy="identify longer logs, or richer motions, of each run"
        )
    values = np.array([[table[key].value for table in tables] for key in known])
    errors = np.array([[table[key].standard_error for table in tables] for key in known])
    spread = _spread(values, errors)
    tests = [agreement_test(x[:, None], (spread * e)[:, None, None] ** 2) for x, e in zip(values, errors, strict=True)]
    # A spread that is estimated from few parameters is uncertain itself: Snedecor's F instead of chi-square.
    ahead, behind = len(runs) - 1, EFFICIENCY * len(known) * (len(runs) - 1)
    p_values = [float(f.sf(test.statistic / ahead, ahead, behind)) if spread > 1 else test.p_value for test in tests]
    adjusted = adjust_holm(p_values)
    weights = errors**-2.0
    means = (values * weights).sum(axis=1) / weights.sum(axis=1)
    found = tuple(
        DriveDifference(
            parameter=key[0],
            group=key[1],
            unit=tables[0][key].unit,
            values=tuple(x.tolist()),
            errors=tuple((spread * e).tolist()),
            statistic=test.statistic,
            p_value=p_value,
            adjusted=float(p),
            differs=bool(p < alpha),
            common=float(mean),
            common_error=float(spread * w.sum() ** -0.5),
        )
        for key, x, e, test, p_value, p, mean, w in zip(
            known, values, errors, tests, p_values, adjusted, means, weights, strict=True
        )
    )
    notes = []
    left = [f"{parameter} {group}" for parameter, group in both if (parameter, group) not in known]
    if left:
        listed = ", ".join(left[:6]) + (", ..." if len(left) > 6 else "")
        notes.append(f"not compared, because a run does not determine it: {listed}")
    if spread > 2:
        notes.append(
            f"the runs scatter {spread:.2g} times more than their standard errors say: their models lack an effect, or "
            "their motions differ; smaller differences would show with one motion for all"
        )
    return DriveComparison(
        robot=results[0].robot,
        runs=tuple(runs),
        alpha=alpha,
        spread=spread,
        differences=found,
        shared=tuple(_shared(found, len(runs), alpha)),
        notes=tuple(notes),
    )


def _spread(values: Array, errors: Array) -> float:
    """Birge ratio from the median of the parameters' statistics, which some real differences do not move; 1 or more."""
    weights = errors**-2.0
    mean = (values * weights).sum(axis=1, keepdims=True) / weights.sum(axis=1, keepdims=True)
    statistics = ((values - mean) ** 2 * weights).sum(axis=1)
    return float(np.sqrt(max(1.0, np.median(statistics) / chi2_limit(0.5, values.shape[1] - 1))))


def _shared(found: Sequence[DriveDifference], runs: int, alpha: float) -> Iterator[CommonChange]:
    """Changes of a parameter in all its joints by one factor: the joints' mean is off zero beyond their scatter."""
    for parameter in dict.fromkeys(item.parameter for item in found):
        own = [item for item in found if item.parameter == parameter and min(item.values) > 0]
        if len(own) < FEWEST or not any(item.differs for item in own):
            continue
        for run in range(1, runs):
            logs = np.array([np.log(item.values[run] / item.values[0]) for item in own])
            errors = np.array(
                [np.hypot(item.errors[0] / item.values[0], item.errors[run] / item.values[run]) for item in own]
            )
            deviation = np.hypot(logs.std(ddof=1), np.sqrt(np.mean(errors**2))) / np.sqrt(len(own))
            alike = np.abs(np.sign(logs).sum()) == len(logs) and logs.std(ddof=1) < abs(logs.mean())
            if alike and abs(logs.mean()) > normal_limit(alpha) * deviation:
                ends = np.expm1(logs.mean() + np.array([-1, 0, 1]) * NORMAL_95 * deviation)
                yield CommonChange(
                    parameter=parameter,
                    run=run,
                    change=float(ends[1]),
                    lower=float(ends[0]),
                    upper=float(ends[2]),
                    joints=len(own),
                )


def _run(result: Actuators, label: str) -> DriveRun:
    logs = result.provenance.get("logs", ())
    known = [number(value, np.nan) for log in logs for value in log.get("temperature") or ()]
    warm = float(np.nanmean(known)) if np.isfinite(known).any() else np.nan
    return DriveRun(
        label=label,
        robot=result.robot,
        error=result.held_out_error,
        date=date_in([label, *(str(log.get("name", "")) for log in logs[:1])]),
        temperature=warm,
        effects=tuple(f"{item.title} of {item.name}" for item in result.findings),
    )


def _require_comparable(results: Sequence[Actuators], labels: Sequence[str]) -> None:
    if len(results) < 2:
        raise InputError(f"{len(results)} result to compare", allowed="two or more")
    first = results[0]
    for result, label in zip(results[1:], labels[1:], strict=True):
        if result.joints != first.joints:
            raise InputError(
                f"{label} has the joints {', '.join(result.joints)}", allowed=f"{', '.join(first.joints)}, in one order"
            )
        if result.law != first.law:
            raise InputError(
                f"{label} has other control laws than {labels[0]}", remedy="identify all with one gains file"
            )
    for i, result in enumerate(results):
        for k in range(i):
            for log in result.provenance.get("logs", ()):
                others = results[k].provenance.get("logs", ())
                if log.get("sha256") and any(are_same_log(log, other) for other in others if other.get("sha256")):
                    raise InputError(
                        f"{labels[i]} and {labels[k]} were identified from the same log {log.get('name')}: their "
                        "errors are not independent",
                        allowed="results of different logs",
                    )
