"""The page of a prediction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.predictions.prediction import Prediction
from oed.reports.pictures.torque_pictures import torque_picture
from oed.reports.rendering.page import Cell, Fact, Finding, Page, Section, Table, findings_of
from oed.reports.rendering.provenance import Recording, footer
from robots.common.plain import finite, percent


def prediction_page(
    prediction: Prediction, robot_name: str, kinds: tuple[str, ...], logs: tuple[Recording, ...] = ()
) -> Page:
    """Builds the page: torque with its band, errors where torque was logged, and what the fit has not seen.

    Args:
        prediction: the torques.
        robot_name: name of the robot.
        kinds: "revolute" or "prismatic" of each joint (n,).
        logs: the recording that was predicted.
    """
    measured = prediction.measured
    nothing = np.full_like(prediction.predicted, np.nan)
    if measured is None:
        verdict = "The torques are predicted; the log has none to compare with."
    else:
        verdict = (
            f"The model predicts this motion to {100 * np.median(prediction.nrmse):.1f} % of the torque RMS (median)."
        )
    extrapolates = prediction.extrapolates
    share = None if extrapolates is None else 100 * extrapolates.mean(axis=0)
    return Page(
        title="Prediction",
        robot=robot_name,
        verdict=verdict,
        logs=logs,
        findings=_findings(prediction, share),
        facts=(
            Fact(label="Samples", value=len(prediction.motion)),
            Fact(label="Duration", value=f"{prediction.motion.duration:.4g} s"),
            Fact(label="Motion known below", value=f"{prediction.cutoff:.3g} Hz"),
        ),
        sections=(
            Section(
                title="Torque",
                paragraphs=(
                    "The band is to hold 95 % of the measured torque. It is that of the fitted logs, widened by the "
                    "errors of the parameters where the motion differs from them.",
                ),
                pictures=(
                    torque_picture(
                        prediction.motion.t,
                        nothing if measured is None else measured,
                        prediction.predicted,
                        band=prediction.band,
                        joint_names=prediction.joint_names,
                        kinds=kinds,
                    ),
                ),
                tables=(_joints(prediction),),
            ),
        ),
        footer=footer(),
    )


def _findings(prediction: Prediction, share: NDArray[np.float64] | None) -> tuple[Finding, ...]:
    texts = []
    if share is not None and share.any():
        texts = [f"{percent(share.mean() / 100)} of the torques extrapolate: the fit has seen no such motion."]
    gate = () if prediction.gate is None else prediction.gate.findings
    return (
        *findings_of("prediction.extrapolates", (*texts, *prediction.beyond)),
        *(Finding(code=f"log.{finding.severity}", text=f"{finding}.") for finding in gate),
    )


def _joints(prediction: Prediction) -> Table:
    """Errors, coverage of the band and share of extrapolation, joint by joint."""
    n = prediction.predicted.shape[1]
    extrapolates = np.full(n, np.nan) if prediction.extrapolates is None else prediction.extrapolates.mean(axis=0)
    errors = (prediction.error_rms, prediction.nrmse, prediction.relative_spread)
    columns = (*errors, prediction.band_coverage, extrapolates)
    rows: list[tuple[Cell, ...]] = []
    for joint, (name, rms, *shares) in enumerate(zip(prediction.joint_names, *columns, strict=True), start=1):
        rows.append((joint, name, finite(rms), *(finite(100 * share) for share in shares)))
    return Table(
        headings=(
            "joint",
            "name",
            "error RMS [N m or N]",
            "of torque RMS [%]",
            "standard deviation, of torque's [%]",
            "in the 95 % band [%]",
            "extrapolates [%]",
        ),
        rows=tuple(rows),
        caption="A sample extrapolates if the parameters' errors matter more there than in any recorded sample.",
    )
