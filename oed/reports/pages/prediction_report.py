"""The page of a prediction."""

from __future__ import annotations

import numpy as np

from estimation.predictions.prediction import Prediction
from oed.reports.pictures.torque_pictures import torque_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.provenance import Recording
from robots.common.plain import finite


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
    return page_of(
        prediction,
        title="Prediction",
        robot=robot_name,
        logs=logs,
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
