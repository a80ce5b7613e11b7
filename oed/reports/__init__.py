"""Reports: pictures and pages from plain arrays, one HTML file each, readable without a network."""

from __future__ import annotations

from oed.reports.animations.animation import Animation
from oed.reports.animations.building import animate
from oed.reports.pages.campaign_report import campaign_page, save_campaign_report
from oed.reports.pages.comparisons.comparison_report import comparison_page, save_comparison_report
from oed.reports.pages.design_report import design_page, save_design_report
from oed.reports.pages.diagnosis_limits import limits_page, save_limits_report
from oed.reports.pages.diagnosis_report import diagnosis_page, save_diagnosis_report
from oed.reports.pages.estimate_report import estimate_page, save_estimate_report
from oed.reports.pages.forces.force_report import force_page, save_force_report
from oed.reports.pages.loops.loop_report import loop_page, save_loop_report
from oed.reports.pages.motions.motion_report import motion_page
from oed.reports.pages.pareto_report import pareto_page, save_pareto_report
from oed.reports.pages.payload_report import payload_page, save_payload_report
from oed.reports.pages.prediction_report import prediction_page
from oed.reports.pages.retime_report import retime_page, save_retime_report
from oed.reports.pictures.parameter_pictures import error_bars_picture, friction_picture, parameter_picture
from oed.reports.pictures.torque_pictures import residual_picture, torque_picture
from oed.reports.pictures.trajectory_pictures import margins_picture, spectrum_picture, trajectory_picture
from oed.reports.rendering.html import render
from oed.reports.rendering.matplotlib_ import save_png, to_matplotlib
from oed.reports.rendering.page import Fact, Finding, Page, Section, Table
from oed.reports.rendering.picture import Band, Line, Panel, Picture, Series, Span
from oed.reports.rendering.plotly_ import to_plotly
from oed.reports.rendering.provenance import Footer, InputFile, Recording
from oed.reports.rendering.severity import severity
from oed.reports.rendering.significant import percent, significant, significant_error, with_error

__all__ = [
    "Animation",
    "Band",
    "Fact",
    "Finding",
    "Footer",
    "InputFile",
    "Line",
    "Page",
    "Panel",
    "Picture",
    "Recording",
    "Section",
    "Series",
    "Span",
    "Table",
    "animate",
    "campaign_page",
    "comparison_page",
    "design_page",
    "diagnosis_page",
    "error_bars_picture",
    "estimate_page",
    "force_page",
    "friction_picture",
    "limits_page",
    "loop_page",
    "margins_picture",
    "motion_page",
    "parameter_picture",
    "pareto_page",
    "payload_page",
    "percent",
    "prediction_page",
    "render",
    "residual_picture",
    "retime_page",
    "save_campaign_report",
    "save_comparison_report",
    "save_design_report",
    "save_diagnosis_report",
    "save_estimate_report",
    "save_force_report",
    "save_limits_report",
    "save_loop_report",
    "save_pareto_report",
    "save_payload_report",
    "save_png",
    "save_retime_report",
    "severity",
    "significant",
    "significant_error",
    "spectrum_picture",
    "to_matplotlib",
    "to_plotly",
    "torque_picture",
    "trajectory_picture",
    "with_error",
]
