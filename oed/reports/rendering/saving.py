"""Every result has one page: which function builds it, and its files."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from oed.reports.rendering.html import render
from oed.reports.rendering.matplotlib_ import save_png
from oed.reports.rendering.page import Page
from robots.common.files import ResultFolder, write_atomic
from robots.common.records import Record

REPORT = "report.html"

PAGES = {
    "Actuators": "drives.actuators_report.actuators_page",
    "Calibration": "calibrations.calibration_report.calibration_page",
    "Campaign": "campaign_report.campaign_page",
    "Design": "design_report.design_page",
    "DetectionLimits": "diagnosis_limits.plan_page",
    "Diagnosis": "diagnosis_report.diagnosis_page",
    "Discrimination": "discrimination_report.discrimination_page",
    "DriveComparison": "comparisons.drive_comparison_report.drive_comparison_page",
    "DriveDesign": "drives.design_report.drive_design_page",
    "Estimate": "estimate_report.estimate_page",
    "FleetResult": "monitoring.fleet_report.fleet_page",
    "ForceEstimate": "forces.force_report.force_page",
    "LoopResult": "loops.loop_report.loop_page",
    "ModelComparison": "comparisons.comparison_report.comparison_page",
    "MonitorResult": "monitoring.monitor_report.monitor_page",
    "ParetoFront": "pareto_report.pareto_page",
    "PayloadEstimate": "payload_report.payload_page",
    "PoseDesign": "calibrations.pose_design_report.pose_design_page",
    "Prediction": "prediction_report.prediction_page",
    "RetimedExperiment": "retime_report.retime_page",
    "ThermalIdentification": "thermal_report.thermal_result_page",
}
"""The function of `oed.reports.pages` that builds the page of each class of results."""


def page_for(result: Record, **beside: Any) -> Page:
    """Builds the page of a result.

    Args:
        result: of any command.
        beside: what its page shows beside it, see the function of its class in `PAGES`.
    """
    module, _, name = PAGES[type(result).__name__].rpartition(".")
    build: Callable[..., Page] = getattr(import_module(f"oed.reports.pages.{module}"), name)
    return build(result, **beside)


def save_report(result: Record, folder: ResultFolder, *, png: bool = False, **beside: Any) -> None:
    """Writes the page of a result as ``report.html`` and, on request, each of its pictures as PNG.

    Args:
        result: of any command.
        folder: where the files go.
        png: whether to write the pictures.
        beside: see `page_for`.
    """
    page = page_for(result, **beside)
    write_atomic(folder.path(REPORT), render(page))
    if png:
        for picture in page.pictures:
            save_png(picture, folder.path(f"{picture.name}.png"))
