"""Result of a diagnosis: verdict, findings, gain of the extended model, and detection limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from estimation.diagnosis.experiment_plans.detection_limits import Limit, summarise_limits
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment
from estimation.diagnosis.findings import Finding, list_parameters
from estimation.diagnosis.results.actions import (
    action_for,
    close_causes,
    close_rivals,
    format_p_value,
    sentence_for,
    state_verdict,
)
from estimation.diagnosis.results.standing import standing_of, standing_text, standing_verdict
from estimation.diagnosis.simulations.simulation_result import Simulation
from estimation.diagnosis.validations.extended_model import all_row_errors
from estimation.models.model import Model, load_model
from robots.common.arrays import Array
from robots.common.records import Finding as Remark
from robots.common.records import Result, axes_for, effect_code, findings_of, read, read_json
from robots.terms.base import length_unit

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


DIAGNOSIS, MODEL = "diagnosis.json", "model.json"
Verdict = Literal["none", "named", "ambiguous", "unexplained"]


@dataclass(frozen=True, eq=False)
class Trace:
    """Curves on held-out data, for plots.

    Attributes:
        t: time [s], (M,).
        measured: measured torque (M, n) [N m or N].
        before: residual of the base model (M, n) [N m or N]; NaN in rows that do not count.
        after: residual of the extended model (M, n) [N m or N]; NaN in rows that do not count.
        coordinate: per finding from the torque the values (M,) of its plot axis.
        windups: per finding from link encoders the gear load, and the link position, measured minus predicted, with a
            rigid and with an elastic gear; all (K,).
    """

    t: Array
    measured: Array
    before: Array
    after: Array
    coordinate: tuple[Array, ...]
    windups: tuple[tuple[Array, ...], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Diagnosis(Result):
    """The result of `diagnose`.

    Attributes:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        findings: findings from the torque, the largest BIC gain first; then rejected ones of an unexplained residual;
            then findings from link encoders.
        baseline: NRMSE of the base model per joint (n,), on held-out data.
        extended: NRMSE of the extended model per joint (n,), on held-out data.
        explained: share of the residual above noise that the named effects explain; 1 if nothing is left.
        excess: per joint the shares (n, 3) of the base model's squared residual that are noise, that repeat with the
            motion, and that change with time; NaN where the motion does not repeat.
        limits: detection limits per effect and joint.
        next_experiment: proposed experiment that separates the remaining causes; None if none is proposed.
        model: the extended model.
        how_unseen: how the held-out data were separated.
        notes: limitations of this diagnosis.
        trace: curves for plots; None after loading from a file.
        simulation: forward simulation of a stretch of held-out data, without and with the findings; None without
            findings.
    """

    FILE = DIAGNOSIS
    ENTRIES = (
        "robot.name=model.robot.name",
        "verdict",
        "findings",
        "baseline.nrmse=baseline",
        "extended.nrmse=extended",
        "explained",
        "excess=excess_shares",
        "limits",
        "next_experiment",
        "unseen=how_unseen",
        "simulation",
        "notes",
    )

    verdict: str
    findings: tuple[Finding, ...]
    baseline: Array
    extended: Array
    explained: float
    excess: Array
    limits: tuple[Limit, ...]
    next_experiment: NextExperiment | None
    model: Model
    how_unseen: str
    notes: tuple[str, ...] = ()
    trace: Trace | None = field(default=None, repr=False)
    simulation: Simulation | None = None

    def __repr__(self) -> str:
        places = [f"{f.effect} of joint {f.joint}" if f.joint else f.effect for f in self.findings]
        return f"Diagnosis({self.model.robot.name!r}, {self.verdict}: {', '.join(places) or 'no effect'})"

    @property
    def success(self) -> bool:
        """Whether the verdict is conclusive: ``none`` or ``named``."""
        return self.verdict in ("none", "named")

    @property
    def excess_shares(self) -> list[dict[str, float]]:
        """The shares of `excess`, by name."""
        return [dict(zip(("noise", "state", "time"), row, strict=True)) for row in self.excess.tolist()]

    @property
    def every_row(self) -> Array:
        """NRMSE (n,) of the extended model on all held-out rows, as in `predict`; NaN where unknown.

        `baseline` and `extended` leave out rows in which a joint's direction of motion is not known.
        """
        return all_row_errors(self.model)

    @property
    def _errors(self) -> tuple[Array, Array, Array]:
        return self.baseline, self.extended, self.every_row

    @property
    def conclusion(self) -> str:
        """What to do, in a sentence or two."""
        forbidden = standing_verdict(self.verdict, *self._errors, self.limits)
        following = "" if self.next_experiment is None else self.next_experiment.words
        if forbidden:
            return f"{forbidden} Record {following} and diagnose again." if following else forbidden
        if self.verdict == "none":
            return "No missing effect was found: use the model as it is."
        if self.verdict == "named":
            known = sentence_for((finding.effect, finding.joint) for finding in self.findings)
            return f"{known} {self.findings[0].sentence}" if len(self.findings) == 1 else known
        # A free function does not name a cause, whatever its gain.
        helps = any(finding.gain.ci95[0] > 0 and finding.named for finding in self.findings)
        why = "part of the error has no known cause" if helps else "no effect of the catalogue explains the residual"
        if self.verdict == "ambiguous":
            why = "several causes fit"
        if following:
            return f"Record {following} and diagnose again: {why}."
        return f"Check logs and robot: {why}, and no known experiment finds it."

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """Effects, unexplained residuals, close rivals and notes."""
        standing = standing_of(self.verdict, *self._errors)
        confirmed = standing != "unconfirmed"
        found = [
            Remark(
                code="diagnosis.unexplained"
                if not finding.named
                else effect_code(finding.effect)
                if confirmed
                else "diagnosis.note",
                subject=f"{finding.title[:1].upper()}{finding.title[1:]}:",
                text=finding.sentence,
                action=action_for(finding.effect, [finding.joint]) if finding.named and confirmed else "",
            )
            for finding in self.findings
        ]
        if standing != "sound":
            text = standing_text(self.verdict, *self._errors, self.limits)
            found += findings_of(f"diagnosis.{standing}", [text])
        if self.verdict == "unexplained" and not any(item.code == "diagnosis.unexplained" for item in found):
            found += findings_of("diagnosis.unexplained", ["Part of the residual is not noise and has no known cause."])
        if self.verdict == "ambiguous":
            texts = [
                f"{f.title[:1].upper()}{f.title[1:]} explains the logs hardly better than {', '.join(close_causes(f))}."
                for f in self.findings
                if close_causes(f)
            ]
            found += findings_of("diagnosis.ambiguous", texts or ["Several causes explain the logs about as well."])
        seen = summarise_limits(self.limits) if self.verdict == "none" else ""
        done = [f"{seen}."] if seen else []
        return (*found, *findings_of("diagnosis.note", self.notes), *findings_of("done", done))

    def summary(self) -> str:
        """Returns the verdict, findings, held-out errors, simulation, next experiment and notes as text."""
        robot = self.model.robot
        lines = [f"{robot.name}: {state_verdict(self.verdict, self.findings)}"]
        errors = (self.baseline, self.extended, self.every_row)
        for say in (standing_verdict, standing_text):
            lines += [f"  {text}"] if (text := say(self.verdict, *errors, self.limits)) else []
        if self.verdict == "none" and (seen := summarise_limits(self.limits)):
            lines.append(f"  {seen[0].lower()}{seen[1:]}")
        for finding in self.findings:
            where = f"joint {finding.joint}" if finding.joint else "whole robot"
            gain = finding.gain
            lines.append(f"  {finding.effect} ({where}), p {format_p_value(finding.p_value)}: {finding.sentence}")
            of = "wind-up" if finding.measured_by else "torque"
            before, after = (f"{100 * value:.3g}" for value in (gain.nrmse_before, gain.nrmse_after))
            decrease = " to ".join(f"{100 * value:.3g}" for value in gain.ci95)
            # The gain of one effect compares the whole model with the model that lacks this effect alone.
            others = ", other findings included" if len(self.findings) > 1 and not finding.measured_by else ""
            lines.append(
                f"    held-out error{finding.elsewhere} {before} -> {after} % of the {of}{others} "
                f"(95 % interval of the decrease: {decrease} %)"
            )
            # The single coefficients of a free function have no meaning.
            parameters = finding.parameters if finding.effect != "unexplained" else ()
            if known := [parameter.text for parameter in parameters if parameter.determined]:
                lines.append(f"    95 % intervals: {list_parameters(known)}")
            if open_ := [parameter.text for parameter in parameters if not parameter.determined]:
                lines.append(f"    not well determined by these logs: {list_parameters(open_)}")
            if close := close_rivals(finding):
                lines.append(f"    cannot be distinguished from (BIC difference): {', '.join(close)}")
        before, after, every = (
            " ".join(f"{100 * value:.2f}" if np.isfinite(value) else "-" for value in errors)
            for errors in (self.baseline, self.extended, self.every_row)
        )
        rows = {"held-out error per joint [% of torque RMS]": before}
        if self.findings:
            rows["with the extended model"] = after
        if np.isfinite(self.every_row).any():
            rows[f"all rows in motion, as in `oed predict{' --before' if self.model.keeps_heat else ''}`"] = every
        width = 2 + max(map(len, rows))
        lines += [f"{name:>{width}}: {errors}" for name, errors in rows.items()]
        lines.append(f"  measured on {self.how_unseen}")
        if self.simulation is not None:
            lengths = [length_unit(robot, j) for j in range(robot.n)]
            lines.append(f"  {self.simulation.summary(lengths)}")
        if self.next_experiment is not None:
            lines.append(f"  next experiment: {self.next_experiment.why}")
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Returns a table with one row per finding and parameter."""
        import pandas as pd

        rows = [
            {
                "effect": finding.effect,
                "joint": finding.joint,
                "parameter": parameter.name,
                "value": parameter.value,
                "unit": parameter.unit,
                "low": parameter.ci95[0],
                "high": parameter.ci95[1],
                "determined": parameter.determined,
                "p_value": finding.p_value,
                "delta_bic": finding.delta_bic,
            }
            for finding in self.findings
            for parameter in finding.parameters
        ]
        names = ["effect", "joint", "parameter", "value", "unit", "low", "high", "determined", "p_value", "delta_bic"]
        return pd.DataFrame(rows, columns=names)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Plots the held-out error of each joint for both models, on `ax` or on a new figure; returns the axes."""
        axes = axes_for(ax, (6, 4))
        joints = np.arange(1, len(self.baseline) + 1)
        axes.bar(joints - 0.2, 100 * self.baseline, 0.4, label="base model")
        axes.bar(joints + 0.2, 100 * self.extended, 0.4, label="extended model")
        axes.set_xlabel("joint")
        axes.set_ylabel("held-out error / torque RMS [%]")
        axes.legend()
        return axes

    def _save_beside(self, folder: Path, *, force: bool) -> None:
        """Writes `model.json`."""
        self.model.save(folder / MODEL, force=force)

    @staticmethod
    def load(folder: str | Path) -> Diagnosis:
        """Reads the files of `save`. They contain neither curves nor the motions of the next experiment.

        Args:
            folder: folder with `diagnosis.json` and `model.json`.

        Raises:
            InputError: a file is missing or not a valid diagnosis.
        """
        file, remedy = Path(folder) / DIAGNOSIS, "give the folder written by `oed diagnose`"
        data, model = read_json(file, remedy=remedy), load_model(Path(folder) / MODEL)
        read(Verdict, data.get("verdict"), "verdict", file=file, remedy=remedy)
        rows = read(list[dict[str, float]], data.get("excess"), "excess", file=file, remedy=remedy)
        return Diagnosis.from_dict(
            data,
            file=file,
            remedy=remedy,
            model=model,
            excess=np.array([list(row.values()) for row in rows]),
        )
