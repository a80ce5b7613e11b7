"""Pages of small results, made by hand, in a real browser; those of larger results are in their own files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.external_forces.contacts import Contact
from estimation.external_forces.localisation import Place
from estimation.external_forces.result import ForceEstimate
from estimation.monitoring import LogRow
from estimation.monitoring.findings import Finding
from estimation.monitoring.fleets import FleetResult, RobotRow
from estimation.monitoring.result import MonitorResult
from estimation.payloads import PayloadEstimate
from estimation.payloads.body import Body
from estimation.payloads.result import JointEvidence
from estimation.predictions.prediction import Prediction
from estimation.thermal import ThermalRun, fit_thermal
from estimation.thermal.results.campaign_estimate import CampaignEstimate
from oed.campaigns.loops.result import LoopResult
from oed.campaigns.loops.state import Experiment, LoopRun, Verdict
from oed.exports import write_trajectory
from oed.reports import Page, force_page, loop_page, payload_page, prediction_page
from oed.reports.pages.monitoring.fleet_report import fleet_page
from oed.reports.pages.monitoring.monitor_report import monitor_page
from oed.reports.pages.thermal_report import thermal_page
from robots import load_robot
from robots.signals import Log, Motion
from robots.thermal import SecondOrder
from tests.oed.reports.said_once import said_twice

pytestmark = pytest.mark.slow

N = 300
T = 0.01 * np.arange(N)
WAVE = np.sin(3.0 * T)[:, None] * np.array([1.0, 0.5])
KINDS = ("revolute", "revolute")
MONDAY = 1_738_310_400.0  # 2025-01-31, 08:00 UTC


def forces() -> ForceEstimate:
    """One contact, and a stretch in which a component of the force is not known."""
    spread = np.full((N, 3), 2.0)
    spread[100:120, 0] = np.inf
    contact = Contact(
        detected=1.0,
        start=0.9,
        end=1.2,
        peak=1.1,
        peak_time=1.0,
        force=np.array([30.0, 0.0, 5.0]),
        covariance=np.eye(3),
        torque=np.ones(2),
        place=Place(link=2, reacting=(1, 2), tool=True),
        extrapolates=False,
    )
    return ForceEstimate(
        robot="two",
        joint_names=("J1", "J2"),
        t=T,
        torque=WAVE,
        direct=1.1 * WAVE,
        deviation=np.full((N, 2), 0.2),
        statistic=np.abs(WAVE[:, 0]),
        force=np.column_stack([WAVE, WAVE[:, 0]]),
        force_deviation=spread,
        wrench=np.zeros((N, 6)),
        wrench_deviation=np.ones((N, 6)),
        extrapolates=np.zeros(N, dtype=bool),
        flagged=np.zeros(N, dtype=bool),
        contacts=(contact,),
        calibration=SimpleNamespace(check=None, threshold=SimpleNamespace(rate=1.0, peaks=25, seconds=43.0)),  # type: ignore[arg-type]
        warnings=("The model extrapolates in 3 % of the rows.",),
    )


def monitored() -> MonitorResult:
    """A damage of joint 2 in the second of two logs that are a day apart."""
    start = MONDAY + np.concatenate([30.0 * np.arange(20), 86_400.0 + 30.0 * np.arange(20)])
    friction = np.zeros((40, 2))
    friction[20:, 1] = 0.2
    finding = Finding(
        kind="damage",
        joint=2,
        size=22.0,
        low=18.0,
        high=26.0,
        unit="%",
        earliest=start[19],
        latest=start[20],
        detected=start[25],
        sigmas=9.0,
        log="tuesday",
    )
    return MonitorResult(
        robot="two",
        joint_names=("J1", "J2"),
        heat="none",
        false_alarm_hours=1000.0,
        findings=(finding,),
        logs=(
            LogRow(name="monday", start=start[0], end=start[19]),
            LogRow(name="tuesday", start=start[20], end=start[39], findings=("damage",)),
            LogRow.left_out("broken", "the clock jumps"),
        ),
        notes=("The clocks agree.",),
        history={
            "start": start,
            "end": start + 30.0,
            "friction": friction,
            "heat": np.zeros((40, 2)),
            "rest": friction,
            "error": np.full((40, 2), 0.01),
            "log": np.repeat([0.0, 1.0], 20),
        },
        origin=start[0],
        change_points=None,
    )


def payload() -> PayloadEstimate:
    body = Body.of(2.0, [0.0, 0.01, 0.08], 0.01 * np.eye(3))
    return PayloadEstimate(
        robot="two",
        method="model",
        body=body,
        nearest=body.parameters,
        values=body.parameters,
        covariance=1e-6 * np.eye(10),
        joints=(JointEvidence(joint=1, name="J1", torque_rms=10.0, without=2.0, residual=0.3),),
        rows=1000,
        warnings=("The log is short.",),
        provenance={"logs": [{"name": "with", "start": MONDAY, "duration": 40.0}]},
    )


def heated() -> CampaignEstimate:
    """Two hours of one joint: warm-up at 60 W, rest, and 25 W."""
    truth = SecondOrder(alpha=-0.0141, beta=1.0, K1=4.41, K2=4.57, C1=737.61, C2=9163.45)
    t = np.arange(0.0, 7200.0, 40.0)
    power = np.where(t < 3600.0, 60.0, np.where(t < 4800.0, 0.0, 25.0))
    temperature = truth.temperatures(power[:-1], np.diff(t))[:, 0]
    noise = 1.0 + 0.01 * np.random.default_rng(0).standard_normal(len(t))
    run = ThermalRun(t=t, power=power, friction=truth.friction_factor(temperature) * noise, cold_friction=1.0, name="1")
    chain = SimpleNamespace(kinds=("revolute",))
    robot = SimpleNamespace(
        name="one",
        title="",
        joint_names=("J1",),
        n=1,
        chain=chain,
        limits=SimpleNamespace(velocity=np.ones(1)),
    )
    columns = tuple(SimpleNamespace(name=f"f{k}_1") for k in range(1, 5))
    model = SimpleNamespace(robot=robot, parameters=columns, values=(3.0, 2.0, 0.0, 0.0))
    return CampaignEstimate(
        torque_model=SimpleNamespace(model=model),  # type: ignore[arg-type]
        thermal=(fit_thermal(run, order="first", start="ambient", starts=1),),
        residual_rms=np.array([0.2]),
        residual_without=np.array([0.5]),
        rounds=3,
        notes=("The ambient temperature was not measured.",),
    )


def loop(folder: Path) -> LoopResult:
    """One experiment of the er3a after which a backlash is named."""
    robot = load_robot("er3a")
    parts = (0.1 * np.sin(3.0 * T), 0.3 * np.cos(3.0 * T), -0.9 * np.sin(3.0 * T))
    motion = Motion(T, *(np.tile(part[:, None], (1, 6)) for part in parts))
    write_trajectory(folder / "first.csv", motion)
    finding = {
        "effect": "backlash",
        "joint": 2,
        "p_value": 1e-6,
        "sentence": "Joint 2 has 0.1 mrad of play.",
        "gain": {"nrmse_before": 0.05, "nrmse_after": 0.02},
    }
    verdict = Verdict(
        folder="diagnosis_1",
        verdict="named",
        findings=[finding],
        before=[0.05] * 6,
        after=[0.02] * 6,
        summary="backlash of joint 2",
    )
    recorded = SimpleNamespace(log="log_1.csv", rows=N, lost=0, delay=0.002)
    run = LoopRun(trajectory="first.csv", pause=60.0, recorded=recorded)  # type: ignore[arg-type]
    experiment = Experiment(kind="excitation", why="first experiment", resolves=None, runs=[run], diagnosis=verdict)
    return LoopResult(
        robot=robot,
        place="127.0.0.1",
        folder=str(folder),
        experiments=(experiment,),
        ended="every cause is named",
        success=True,
        duration=100.0,
    )


def prediction() -> Prediction:
    extrapolates = np.zeros((N, 2), dtype=bool)
    extrapolates[:30] = True
    return Prediction(
        motion=Motion(T, WAVE, WAVE, WAVE),
        predicted=10.0 * WAVE,
        measured=10.1 * WAVE,
        joint_names=("J1", "J2"),
        band=np.full((N, 2), 0.5),
        extrapolates=extrapolates,
        cutoff=10.0,
    )


def test_what_was_found_is_said_once(tmp_path: Path) -> None:
    """The verdict or one row says what was found; tables and sections show the evidence."""
    result = monitored()
    fleet = FleetResult(rows=(RobotRow.of("robot 7", result), RobotRow(name="x", light="green", text="-")))
    pages = [
        monitor_page(result),
        fleet_page(fleet),
        payload_page(payload()),
        force_page(forces(), ("revolute",) * 2),
        loop_page(loop(tmp_path)),
    ]
    assert [said_twice(page) for page in pages] == [[]] * len(pages)
    assert any(page.findings for page in pages)


def test_external_forces(in_browser: Callable[[Page], None]) -> None:
    """A contact asks for action, and the page passes all checks of `browser_checks`."""
    page = force_page(forces(), KINDS)
    assert page.level == "act"
    in_browser(page)


def test_prediction(in_browser: Callable[[Page], None]) -> None:
    """An extrapolation is noted, and the page passes all checks of `browser_checks`."""
    page = prediction_page(prediction(), "two", KINDS)
    assert [finding.code for finding in page.findings] == ["prediction.extrapolates"]
    in_browser(page)


def test_payload(in_browser: Callable[[Page], None]) -> None:
    """The recording's date is on the first screen, and the page passes all checks of `browser_checks`."""
    page = payload_page(payload())
    assert page.dates == ("2025-01-31 08:00 UTC",)
    in_browser(page)


def test_monitor_and_fleet(in_browser: Callable[[Page], None]) -> None:
    """Damage asks for action on both pages, which pass all checks of `browser_checks`."""
    result = monitored()
    page = monitor_page(result)
    assert page.level == "act"
    assert page.verdict.startswith("Inspect joint 2")
    assert [finding.code for finding in page.findings] == ["change.act", "log.left_out", "monitor.note"]
    in_browser(page)
    fleet = fleet_page(FleetResult(rows=(RobotRow.of("robot 7", result), RobotRow(name="x", light="green", text="-"))))
    assert fleet.level == "act"
    assert "Begin with robot 7." in fleet.verdict
    in_browser(fleet)


def test_thermal(in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    log = Log(t=np.array([0.0, 1.0]), q=np.array([[0.0], [0.5]]), name="run")
    in_browser(thermal_page(heated(), [log], joint=1))


def test_loop(in_browser: Callable[[Page], None], tmp_path: Path) -> None:
    """A fault that the loop found asks for action, and the page passes all checks of `browser_checks`."""
    page = loop_page(loop(tmp_path))
    assert page.level == "act"
    assert "Inspect the gear of joint 2" in page.findings[0].action
    in_browser(page)
