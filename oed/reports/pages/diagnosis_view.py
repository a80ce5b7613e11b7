"""The content of a diagnosis report: words, tables and curves, independent of the objects they come from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.experiment_plans.detection_limits import Limit
from estimation.diagnosis.results.diagnosis import Diagnosis, Finding, Trace
from estimation.diagnosis.simulations.simulation_result import Simulation
from oed.reports.rendering.provenance import Recording, recordings_of
from robots.terms.base import length_unit
from robots.terms.effects import EFFECTS, EXPERIMENTS

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class FindingView:
    """One finding as the report shows it.

    Attributes:
        effect: its name in the catalogue; a name that is not there is a pattern without a known cause.
        title: what it is, in words.
        sentence: what its values mean.
        joint: counted from 1; None for the whole robot.
        parameters: name, value, unit, lower and upper end of the 95 % interval (not finite where not determined).
        p_value: probability of an effect this strong under noise alone.
        delta_bic: how much better the model is with it.
        before: error divided by torque RMS without it, on held-out data.
        after: with it.
        interval: 95 % interval of the difference.
        rivals: title and how much worse in BIC, the closest first.
        shown_on: the joint, from 1, whose residual the picture shows.
        label: the coordinate's label.
        coordinate: its values (N,).
        residual_before: of that joint without the finding (N,).
        residual_after: with all findings (N,).
        of: what before and after are the error of.
        unit: of the residuals if they are not torques.
        elsewhere: joints on which before and after are, where those are not its own; begins with a space, or is empty.
        rough: names of the parameters that are not well determined.
    """

    effect: str
    title: str
    sentence: str
    joint: int | None
    parameters: tuple[tuple[str, float, str, float, float], ...]
    p_value: float
    delta_bic: float
    before: float
    after: float
    interval: tuple[float, float]
    rivals: tuple[tuple[str, float], ...]
    shown_on: int
    label: str
    coordinate: Array
    residual_before: Array
    residual_after: Array
    of: str = "torque"
    unit: str = ""
    elsewhere: str = ""
    rough: tuple[str, ...] = ()

    @property
    def named(self) -> bool:
        """Whether it is an effect of the catalogue."""
        return self.effect in EFFECTS


@dataclass(frozen=True, kw_only=True, eq=False)
class DiagnosisView:
    """A diagnosis as the report shows it.

    Attributes:
        robot: its name in reports.
        verdict: none, named, ambiguous or unexplained.
        findings: strongest first.
        joint_names: names (n,).
        kinds: revolute or prismatic (n,).
        t: time [s] of the held-out data (N,).
        measured: torque (N, n).
        base: the base model's (N, n).
        extended: the extended model's (N, n).
        nrmse_before: error divided by torque RMS per joint on held-out data (n,).
        nrmse_after: with what was found (n,).
        nrmse_every: the same with every row counted (n,); NaN where it is not known.
        unseen: which data are held out.
        limits: detection limits of the data.
        next_kind: the next experiment's kind in words; empty for none.
        next_why: why.
        next_resolves: its probability to name one cause.
        next_ranking: kind in words, probability and duration [s], the best first.
        next_logged: which motion of the logs it repeats, in words; empty for a new one.
        next_runs: what to play, as `NextExperiment.runs` has it.
        unexplained: what is left, in words.
        warnings: what a reader must know.
        simulation: the motion simulated without and with what was found; None where nothing was.
        logs: recordings of the fit.
        seed: of the random numbers.
    """

    robot: str
    verdict: str
    findings: tuple[FindingView, ...]
    joint_names: tuple[str, ...]
    kinds: tuple[str, ...]
    t: Array
    measured: Array
    base: Array
    extended: Array
    nrmse_before: Array
    nrmse_after: Array
    nrmse_every: Array
    unseen: str
    limits: tuple[Limit, ...]
    next_kind: str = ""
    next_why: str = ""
    next_resolves: float = float("nan")
    next_ranking: tuple[tuple[str, float, float], ...] = ()
    next_logged: str = ""
    next_runs: tuple[dict[str, Any], ...] = ()
    unexplained: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    simulation: Simulation | None = None
    logs: tuple[Recording, ...] = ()
    seed: int | None = None


def view_of(diagnosis: Diagnosis) -> DiagnosisView:
    """Collects what the report shows of a new diagnosis; a loaded one has no curves.

    Raises:
        ValueError: a diagnosis without curves.
    """
    if diagnosis.trace is None:
        raise ValueError("a diagnosis that was loaded from a file has no curves")
    robot, trace, following = diagnosis.model.robot, diagnosis.trace, diagnosis.next_experiment
    left = [f for f in diagnosis.findings if f.pattern]
    return DiagnosisView(
        robot=robot.title or robot.name,
        verdict=diagnosis.verdict,
        findings=_findings(diagnosis, trace),
        joint_names=robot.joint_names,
        kinds=robot.chain.kinds,
        t=trace.t,
        measured=trace.measured,
        base=trace.measured - trace.before,
        extended=trace.measured - trace.after,
        nrmse_before=diagnosis.baseline,
        nrmse_after=diagnosis.extended,
        nrmse_every=diagnosis.every_row,
        unseen=diagnosis.how_unseen,
        limits=diagnosis.limits,
        next_kind="" if following is None else _experiment(following.kind, following.times),
        next_why="" if following is None else following.why,
        next_resolves=np.nan if following is None else following.resolves,
        next_ranking=()
        if following is None
        else tuple((_experiment(p.kind, p.times), p.resolves, p.duration) for p in following.ranking),
        next_logged="" if following is None else following.logged,
        next_runs=() if following is None else tuple(following.runs),
        unexplained=tuple(f"{f.sentence}" for f in left),
        warnings=diagnosis.notes,
        simulation=diagnosis.simulation,
        logs=recordings_of(diagnosis.model.provenance.get("logs", ())),
        seed=diagnosis.model.provenance.get("seed"),
    )


def _experiment(kind: str, times: int) -> str:
    """Describes a kind of experiment, and how often its motions are made."""
    return EXPERIMENTS.get(kind, kind.replace("_", " ")) + (f", repeated {times} times" if times > 1 else "")


def _findings(diagnosis: Diagnosis, trace: Trace) -> tuple[FindingView, ...]:
    """Collects the findings with their curves: in the torque, outside the model, and from joint encoders."""
    count, last = len(trace.coordinate), len(diagnosis.findings) - len(trace.windups)
    views = [_finding(f, trace, x) for f, x in zip(diagnosis.findings[:count], trace.coordinate, strict=True)]
    views += [_finding(f, trace, trace.t) for f in diagnosis.findings[count:last]]
    for finding, (load, before, after) in zip(diagnosis.findings[last:], trace.windups, strict=True):
        assert finding.joint is not None
        view = _finding(finding, trace, trace.t)
        length = length_unit(diagnosis.model.robot, finding.joint - 1)
        views.append(
            replace(
                view,
                label=finding.coordinate,
                coordinate=load,
                residual_before=1e3 * before,
                residual_after=1e3 * after,
                of="wind-up",
                unit=f"m{length}",
            )
        )
    return tuple(views)


def _finding(finding: Finding, trace: Trace, coordinate: Array) -> FindingView:
    effect = EFFECTS.get(finding.effect)
    title = effect.title if effect is not None else "a pattern without a known cause"
    joint = finding.joint if finding.joint is not None else _most(trace)
    if finding.elsewhere and joint not in finding.gain.joints:
        # Shown on the joint whose error falls most.
        joint = max(finding.gain.joints, key=lambda k: _fall(trace)[k - 1])
    known = bool(np.isfinite(coordinate).any())
    return FindingView(
        effect=finding.effect,
        title=title,
        sentence=finding.sentence,
        joint=finding.joint,
        parameters=tuple((p.name, p.value, p.unit, *p.ci95) for p in finding.parameters),
        p_value=finding.p_value,
        delta_bic=finding.delta_bic,
        before=finding.gain.nrmse_before,
        after=finding.gain.nrmse_after,
        interval=finding.gain.ci95,
        rivals=tuple((name.replace("_", " "), worse) for name, worse in finding.rivals),
        shown_on=joint,
        label=finding.coordinate if known and finding.coordinate else "time [s]",
        coordinate=coordinate if known else trace.t,
        residual_before=trace.before[:, joint - 1],
        residual_after=trace.after[:, joint - 1],
        elsewhere=finding.elsewhere,
        rough=tuple(p.name for p in finding.parameters if not p.determined),
    )


def _most(trace: Trace) -> int:
    """The joint, counted from 1, whose error falls most."""
    return 1 + int(np.argmax(_fall(trace)))


def _fall(trace: Trace) -> Array:
    """Fall of each joint's error as a fraction of its torque RMS (n,)."""
    before, after, size = (_rms(part) for part in (trace.before, trace.after, trace.measured))
    return np.asarray((before - after) / np.maximum(size, 1e-12))


def _rms(values: Array) -> Array:
    """Root mean square of each column's finite values (n,); 0 without any."""
    known = np.isfinite(values)
    sums = np.where(known, values, 0.0) ** 2
    return np.asarray(np.sqrt(sums.sum(axis=0) / np.maximum(known.sum(axis=0), 1)))
