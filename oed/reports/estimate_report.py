"""The page of an identification."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.estimate import Estimate
from oed.reports.page import Cell, Fact, Page, Section, Table
from oed.reports.parameter_pictures import error_bars_picture, friction_picture, parameter_picture
from oed.reports.pictures import Picture
from oed.reports.saving import footer, save_page
from oed.reports.significant import significant, significant_error
from oed.reports.torque_pictures import residual_picture, torque_picture
from robots.common.files import ResultFolder

Array = NDArray[np.float64]


def save_estimate_report(estimate: Estimate, folder: ResultFolder, *, png: bool = False) -> None:
    """Writes the page of an identification, and its pictures as PNG on request."""
    save_page(estimate_page(estimate), folder, png=png)


def estimate_page(estimate: Estimate) -> Page:
    """Builds the page: how well the torques are explained, by which parameters, known how well."""
    model, joints = estimate.model, estimate.joints
    robot = model.robot
    known = int(model.determined.sum())
    lost = [joint for joint in joints if not joint.identified]
    verdict = (
        f"{known} of {len(model.names)} parameters are determined; torque left out of the fit is predicted to "
        f"{100 * np.median([joint.nrmse for joint in joints]):.1f} % of its RMS on the median joint."
    )
    if lost:
        verdict += f" Not identified: joint {', '.join(str(joint.joint) for joint in lost)}."
    period = float(np.median(np.diff(estimate.t))) if len(estimate.t) > 1 else 1.0
    kinds, names = robot.chain.kinds, robot.joint_names
    residual = estimate.measured - estimate.predicted
    sections = [
        Section(
            title="Torque",
            paragraphs=(
                "Measured and predicted torque on the fitted rows, and what is left. The table says what the model "
                "achieves on blocks of the logs that were left out of the fit, beside a constant and the robot's own "
                "description.",
            ),
            pictures=(
                _errors(estimate),
                torque_picture(estimate.t, estimate.measured, estimate.predicted, joint_names=names, kinds=kinds),
            ),
            tables=(_joints(estimate),),
        ),
        Section(title="Parameters", pictures=_parameter_pictures(estimate), tables=(_parameters(estimate),)),
        Section(
            title="Residual",
            pictures=(residual_picture(residual, estimate.dq, period=period, joint_names=names, kinds=kinds),),
        ),
        Section(
            title="How it was made",
            paragraphs=(
                f"Method {model.provenance['method']}; positions smoothed at {estimate.choice.cutoff:g} Hz without "
                f"phase lag; ridge {estimate.choice.ridge:g} on the Gram matrix with unit columns; both chosen by "
                "predicting contiguous blocks of the logs from the rest. Standard errors come from a sandwich with an "
                "autoregressive model of the residual, joints correlated.",
            ),
            tables=(_logs(estimate),),
            folded=True,
        ),
    ]
    return Page(
        title="Identified dynamics",
        subtitle=robot.title or robot.name,
        verdict=verdict,
        status="good" if estimate.success else "warning",
        facts=(
            Fact(label="Parameters determined", value=f"{known} of {len(model.names)}"),
            Fact(label="Worst joint, left out", value=f"{100 * max(joint.nrmse for joint in joints):.1f} %"),
            Fact(label="Samples", value=len(estimate.t)),
            Fact(
                label="Colour of the residual",
                value=f"{estimate.colour:.1f}",
                note="white-noise standard errors would be too small by this factor",
            ),
        ),
        warnings=estimate.warnings,
        sections=tuple(sections),
        footer=footer(),
    )


def _errors(estimate: Estimate) -> Picture:
    def shares(name: str) -> Array:
        pairs = [(getattr(joint, name), joint.torque_rms) for joint in estimate.joints]
        return np.array([error / scale if scale else np.nan for error, scale in pairs])

    errors = {"fitted": shares("residual_rms"), "left out": shares("held_out_rms"), "constant": shares("torque_spread")}
    nominal = shares("nominal_rms")
    if np.isfinite(nominal).any():
        errors["robot's description"] = nominal
    return error_bars_picture(errors, joint_names=estimate.model.robot.joint_names)


def _joints(estimate: Estimate) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for joint in estimate.joints:
        scale = joint.torque_rms or np.nan
        errors = (joint.residual_rms, joint.held_out_rms, joint.torque_spread, joint.nominal_rms)
        rows.append(
            (
                joint.joint,
                joint.name,
                joint.torque_rms,
                *(None if not np.isfinite(e) else 100 * e / scale for e in errors),
                "yes" if joint.identified else "NO",
            )
        )
    headings = (
        "joint",
        "name",
        "torque RMS",
        "fitted [%]",
        "left out [%]",
        "constant [%]",
        "description [%]",
        "identified",
    )
    return Table(
        headings=headings,
        rows=tuple(rows),
        caption="Shares of each joint's torque RMS; fitted and left out where the joint is not almost at rest.",
    )


def _parameters(estimate: Estimate) -> Table:
    model = estimate.model
    rows: list[tuple[Cell, ...]] = []
    for column, value, error, known, formula in zip(
        model.parameters, model.values, model.standard_errors, model.determined, model.formulas, strict=True
    ):
        if known:
            percent = significant(100 * error / abs(value), digits=2) if value else "–"
            shown = (significant(value, error), significant_error(error), percent)
            rows.append((column.name, *shown, column.unit, formula))
        else:
            rows.append((column.name, "not determined", "–", "–", column.unit, formula))
    return Table(
        headings=("parameter", "value", "standard error", "percent", "unit", "stands for"),
        rows=tuple(rows),
        caption="Values rounded to two digits of their standard errors.",
        align=("left", "right", "right", "right", "left", "left"),
    )


def _parameter_pictures(estimate: Estimate) -> tuple[Picture, ...]:
    model = estimate.model
    known = model.determined
    pictures: list[Picture] = []
    if known.any():
        pictures.append(
            parameter_picture(
                [name for name, k in zip(model.names, known, strict=True) if k],
                model.values[known],
                model.standard_errors[known],
                [column.unit for column, k in zip(model.parameters, known, strict=True) if k],
            )
        )
    n = model.robot.n
    coefficients, covariances = np.zeros((n, 4)), np.zeros((n, 4, 4))
    place = {column.name: i for i, column in enumerate(model.parameters)}
    for joint in range(n):
        found = [(power, place.get(f"f{power + 1}_{joint + 1}")) for power in range(4)]
        for power, i in found:
            if i is None:
                continue
            coefficients[joint, power] = model.values[i]
            for other, k in found:
                if k is not None:
                    covariances[joint, power, other] = model.covariance[i, k]
    speed = np.abs(estimate.dq).max(axis=0)
    if coefficients.any() and (speed > 0).all():
        pictures.append(
            friction_picture(
                coefficients,
                speed,
                covariances=covariances,
                joint_names=model.robot.joint_names,
                kinds=model.robot.chain.kinds,
            )
        )
    return tuple(pictures)


def _logs(estimate: Estimate) -> Table:
    rows = tuple(
        (log["name"], log["samples"], log["duration"], (log["sha256"] or "")[:16])
        for log in estimate.model.provenance["logs"]
    )
    return Table(headings=("log", "samples", "duration [s]", "sha256"), rows=rows)
