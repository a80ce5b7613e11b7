"""Result of a comparison: differences, friction changes, drift, and the merged model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from estimation.comparisons.common_parameters import CommonParameters
from estimation.comparisons.differences import Difference
from estimation.comparisons.drift import Drift
from estimation.comparisons.friction_changes import FrictionChange, interval_of, percent_of
from estimation.comparisons.friction_curves import FrictionCurves
from estimation.comparisons.merging import MergedModel
from estimation.comparisons.payload_differences import PayloadDifference
from estimation.comparisons.runs import Run
from robots.common.arrays import Array
from robots.common.plain import joints_in_words
from robots.common.records import Finding, Result, axes_for, findings_of, plain

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


COMPARISON, MODEL = "compare.json", "model.json"
# Parts and parameters that the summary lists of each run.
LISTED_DIFFERENCES = 8


@dataclass(frozen=True, kw_only=True)
class ModelComparison(Result, format="robot-oed comparison", shares=("labels", "alpha")):
    """Runs against each other.

    Attributes:
        runs: in order; the first is the baseline.
        order: what the order is by: date, clock of the logs, or as given.
        hours: of each run since the first (k,); None without a common clock.
        alpha: chance of any false alarm among all tests.
        common: parameters of all runs in one basis.
        payloads: bodies on the flange by which runs differ from the first.
        tested: the parameters without these payloads, which the tests compare.
        differences: tests, each run against the first and all together.
        curves: friction of the joints.
        friction: change of each joint's friction, split into common and own.
        drifts: course of each quantity; empty for fewer than four runs.
        merged: the merged estimate.
        warnings: limitations.
    """

    FILE = COMPARISON
    ENTRIES = (
        "robot=robot_name",
        "verdict",
        "alpha",
        "correction",
        "order",
        "hours",
        "runs",
        "payloads",
        "differences",
        "friction",
        "friction_curves=curves",
        "drift=drifts",
        "merged.model=merged_file",
        "merged.scatter_between_runs=scatter",
        "warnings",
    )

    runs: tuple[Run, ...]
    order: str
    hours: Array | None
    alpha: float
    common: CommonParameters
    payloads: tuple[PayloadDifference, ...]
    tested: CommonParameters
    differences: tuple[Difference, ...]
    curves: tuple[FrictionCurves, ...]
    friction: tuple[FrictionChange, ...]
    drifts: tuple[Drift, ...]
    merged: MergedModel
    warnings: tuple[str, ...]

    correction = "Holm within each of three families, Bonferroni between them"
    merged_file = MODEL

    def __repr__(self) -> str:
        return f"ModelComparison({len(self.runs)} runs of {self.robot_name!r}, {len(self.significant)} significant)"

    @property
    def robot_name(self) -> str:
        """Name of the first model's robot."""
        return self.runs[0].model.robot.name

    @property
    def scatter(self) -> dict[str, float]:
        """Scatter of each parameter between the runs."""
        return dict(zip((column.name for column in self.common.columns), self.merged.scatter.tolist(), strict=True))

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the runs (k,)."""
        return tuple(run.label for run in self.runs)

    @property
    def significant(self) -> tuple[Difference, ...]:
        """Differences that are real at the stated rate of false alarms."""
        return tuple(item for item in self.differences if item.adjusted < self.alpha)

    @property
    def damaged(self) -> tuple[FrictionChange, ...]:
        """Changes of friction that one joint has alone."""
        return tuple(item for item in self.friction if item.kind == "own")

    def of_run(self, run: int | None, level: str) -> tuple[Difference, ...]:
        """Gives the tests of one level of one run against the first.

        Args:
            run: index of the run; None for all runs together.
            level: as in `Difference.level`.
        """
        return tuple(item for item in self.differences if item.run == run and item.level == level)

    @property
    def compared(self) -> tuple[int | None, ...]:
        """Indices of the runs that are compared with the first; None for all together, where there are more."""
        return (*range(1, len(self.runs)), *([None] if len(self.runs) > 2 else []))

    def parts(self, run: int | None) -> tuple[str, ...]:
        """Names the parts in which a run differs significantly from the first, as `FrictionChange.sentence` does.

        Args:
            run: index of the run; None for all runs together.
        """
        found = [item for item in self.of_run(run, "part") if item.adjusted < self.alpha]
        if run is None:
            return tuple(item.name for item in found)
        changes = {item.joint: item for item in self.friction if item.run == run and item.differs}
        found = [item for item in found if not (item.friction and item.joint in changes)]
        return (
            *(item.name for item in found),
            *(
                f"friction of joint {joint}" if change.kind != "unchanged" else f"friction curve of joint {joint}"
                for joint, change in changes.items()
            ),
        )

    @property
    def conclusion(self) -> str:
        """What differs."""
        return self.verdict()

    @property
    def remarks(self) -> tuple[Finding, ...]:
        """Changes of one joint alone, payloads, parts that differ, and warnings."""
        found = [
            Finding(
                code="difference.joint",
                subject=f"{self.labels[item.run]}:",
                text=item.sentence(),
            )
            for item in self.damaged
        ]
        found += [
            Finding(code="difference.payload", subject=f"{self.labels[item.run]}:", text=item.sentence(self.labels))
            for item in self.payloads
        ]
        runs: dict[str, list[str]] = {}
        for run in range(1, len(self.runs)):
            for name in self.parts(run):
                runs.setdefault(name, []).append(self.labels[run])
        found += [
            Finding(code="difference", subject=f"{name}:", text=f"differs from {self.labels[0]} in {', '.join(those)}.")
            for name, those in runs.items()
        ]
        return (*found, *findings_of("comparison.note", self.warnings))

    def verdict(self) -> str:
        """Says in one or two sentences what differs."""
        carried = " ".join(item.sentence(self.labels) for item in self.payloads)
        parts = sorted({name for run in self.compared for name in self.parts(run)})
        if parts:
            text = f"The runs differ significantly in {listed(grouped(parts))}."
        elif self.significant:
            text = "The runs differ significantly, but no single part of a joint does."
        else:
            text = "No difference is significant: the runs agree within their errors."
        if carried:
            text = f"{carried} Without the payload: {text[0].lower()}{text[1:]}"
        joints = sorted({item.joint for item in self.damaged})
        if joints:
            text += f" Friction changed on joint {listed([str(j) for j in joints])} alone: inspect it."
        shared = self.shared_change(len(self.runs) - 1)
        if shared is not None:
            mean, error = shared
            warmer = "fell: the robot was warmer" if mean < 0 else "rose: the robot was colder"
            text += (
                f" In {self.labels[-1]} friction common to all joints {warmer} "
                f"({percent_of(mean)}, {interval_of(mean, error)})."
            )
            if any(item.kind == "unequal" for item in self.friction if item.run == len(self.runs) - 1):
                text += (
                    " Joints heat unequally, which hides smaller changes of one joint: compare runs of one temperature."
                )
        return text

    def shared_change(self, run: int) -> tuple[float, float] | None:
        """Gives the log ratio of the friction that joints share in a run, with its standard error.

        Args:
            run: index of the run.

        Returns:
            The ratio and its error; None unless more joints changed together than stayed as they were.
        """
        items = [item for item in self.friction if item.run == run and item.kind in ("common", "unequal")]
        others = [item for item in self.friction if item.run == run and item.kind == "unchanged"]
        if len(items) <= len(others) or not items:
            return None
        values = np.array([item.total for item in items])
        scatter = float(values.std(ddof=1)) if len(values) > 1 else items[0].total_error
        return float(values.mean()), scatter / np.sqrt(len(values))

    def summary(self) -> str:
        """Lists runs, differences, friction changes and drift."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.robot_name}: {len(self.runs)} runs, order: {self.order}; baseline {self.labels[0]}"
        for run in self.runs:
            warm = "" if run.temperature is None else f"  joints {np.nanmean(run.temperature):.1f} degC"
            yield f"  {run.label:24} {run.date_text}{warm}".rstrip()
        yield self.verdict()
        yield f"  family-wise false-alarm rate {100 * self.alpha:g} % (Holm)"
        yield "  run                      chi-square    dof   adjusted p   parts that differ"
        for compared in self.compared:
            (whole, *_) = self.of_run(compared, "whole") or (None,)
            if whole is None:
                continue
            parts = list(self.parts(compared))
            label = "all together" if compared is None else self.labels[compared]
            yield (
                f"  {label[:24]:24} {whole.statistic:10.1f} {whole.dof:6d} {whole.adjusted:12.2g}   "
                f"{listed(grouped(parts)) if parts else 'none'}"
            )
        last = len(self.runs) - 1
        yield f"  friction, {self.labels[last]} against {self.labels[0]}:"
        for change in self.friction:
            if change.run == last:
                yield f"    {change.sentence()}"
        yield from self._parameter_lines(last)
        yield from self._drift_lines()
        yield from (f"  {warning}" for warning in self.warnings)

    def _parameter_lines(self, run: int) -> Iterator[str]:
        # The friction of a joint has a sentence, which its single coefficients would only repeat.
        found = sorted(
            (i for i in self.of_run(run, "parameter") if i.adjusted < self.alpha and not i.friction),
            key=lambda i: -i.statistic,
        )
        if found:
            yield f"  parameters that differ, {self.labels[run]} against {self.labels[0]}:"
        for item in found[:LISTED_DIFFERENCES]:
            yield (
                f"    {item.name:12} {item.change:+11.4g} ± {item.error:<9.2g} {item.unit:12} "
                f"{item.percent:+8.2f} %   adjusted p {item.adjusted:.2g}"
            )
        if len(found) > LISTED_DIFFERENCES:
            yield f"    and {len(found) - LISTED_DIFFERENCES} more"

    def _drift_lines(self) -> Iterator[str]:
        if not self.drifts:
            return
        moving = [item for item in self.drifts if item.adjusted < self.alpha]
        per = "hour" if self.hours is not None else "run"
        yield f"  drift: {len(moving)} of {len(self.drifts)} quantities have a significant trend"
        for item in moving[:LISTED_DIFFERENCES]:
            settled = "not settled" if item.settled is None else f"settled from {self.labels[item.settled]}"
            yield (
                f"    {item.name:32} {item.slope:+.3g} ± {item.slope_error:.2g} {item.unit} per {per}; {settled}; "
                f"first {item.percent:+.1f} % off the last"
            )

    def to_frame(self) -> pd.DataFrame:
        """Gives a row per test."""
        import pandas as pd

        return pd.DataFrame(plain(self.differences, labels=self.labels, alpha=self.alpha))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws each run's friction at 0.6 of the largest speed, relative to the first run.

        Args:
            ax: where to draw; a new figure by default.
        """
        axes = axes_for(ax, (7, 4))
        x = np.arange(len(self.runs)) if self.hours is None else self.hours
        for curve in self.curves:
            base = abs(curve.level[0]) or 1.0
            axes.errorbar(
                x, 100 * (curve.level / base - 1), 196 * curve.level_error / base, label=f"joint {curve.joint}"
            )
        axes.set_xlabel("run" if self.hours is None else "time [h]")
        axes.set_ylabel("change of friction [%]")
        axes.legend()
        return axes

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes the merged `model.json`."""
        self.merged.model.save(folder / MODEL, force=force)


def grouped(parts: Iterable[str]) -> list[str]:
    """Puts the parts of one kind together: friction of joints 1, 2 and 4."""
    kinds: dict[str, list[str]] = {}
    for part in parts:
        kind, _, joint = part.partition(" of joint ")
        kinds.setdefault(kind, []).append(joint)
    return [kind if not joints[0] else f"{kind} of {joints_in_words(joints)}" for kind, joints in kinds.items()]


def listed(names: list[str], most: int = 6) -> str:
    """Lists some names, and says how many more there are."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
