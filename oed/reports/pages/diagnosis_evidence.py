"""The curves that show a finding: residuals without and with it, over the coordinate on which it shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.findings import Finding
from estimation.diagnosis.results.diagnosis import Diagnosis, Trace
from oed.reports.rendering.joint_units import joint_units
from robots.common.arrays import Array
from robots.terms.base import length_unit


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """The curves of one finding.

    Attributes:
        joint: the joint, from 1, whose residual they show.
        label: the coordinate's label.
        coordinate: its values (N,).
        before: residual of that joint without the finding (N,).
        after: with all findings (N,).
        of: what they are the residual of.
        unit: of the residuals.
    """

    joint: int
    label: str
    coordinate: Array
    before: Array
    after: Array
    of: str
    unit: str


def evidence_of(diagnosis: Diagnosis, index: int) -> Evidence:
    """Gives the curves of one finding: in the torque, outside the model, or from joint encoders.

    Args:
        diagnosis: just made; one that was loaded has no curves.
        index: of the finding.

    Raises:
        ValueError: a diagnosis without curves.
    """
    trace, finding = diagnosis.trace, diagnosis.findings[index]
    if trace is None:
        raise ValueError("a diagnosis that was loaded from a file has no curves")
    robot = diagnosis.model.robot
    measured = index - (len(diagnosis.findings) - len(trace.windups))
    if measured >= 0 and finding.joint is not None:
        load, before, after = trace.windups[measured]
        return Evidence(
            joint=finding.joint,
            label=finding.coordinate,
            coordinate=load,
            before=1e3 * before,
            after=1e3 * after,
            of="wind-up",
            unit=f"m{length_unit(robot, finding.joint - 1)}",
        )
    coordinate = trace.coordinate[index] if index < len(trace.coordinate) else trace.t
    known, joint = bool(np.isfinite(coordinate).any()), _shown_on(finding, trace)
    return Evidence(
        joint=joint,
        label=finding.coordinate if known and finding.coordinate else "time [s]",
        coordinate=coordinate if known else trace.t,
        before=trace.before[:, joint - 1],
        after=trace.after[:, joint - 1],
        of="torque",
        unit=joint_units(robot.chain.kinds, robot.n)[joint - 1].torque,
    )


def _shown_on(finding: Finding, trace: Trace) -> int:
    joint = finding.joint if finding.joint is not None else _most(trace)
    if finding.elsewhere and joint not in finding.gain.joints:
        # Shown on the joint whose error falls most.
        return max(finding.gain.joints, key=lambda k: _fall(trace)[k - 1])
    return joint


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
