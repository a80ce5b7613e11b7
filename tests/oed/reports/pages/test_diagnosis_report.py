"""The page of a diagnosis, and of a planned experiment's limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.choices import Proposal
from estimation.diagnosis.experiment_plans.detection_limits import Limit
from estimation.diagnosis.experiment_plans.experiment_motions import Stage
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment
from estimation.diagnosis.findings import Finding, Gain, Parameter
from estimation.diagnosis.results.diagnosis import Diagnosis, Trace
from estimation.diagnosis.simulations.simulation_result import Curves, Simulation
from oed.reports import Page
from oed.reports.pages.diagnosis_limits import limits_page, limits_section
from oed.reports.pages.diagnosis_report import diagnosis_page
from oed.reports.pictures.diagnosis_pictures import binned, cause_picture, gain_picture
from oed.reports.rendering.html import render
from robots.common.errors import InputError
from robots.plants.closed_loop import Loop
from robots.signals import Motion
from robots.terms.effects import EFFECTS
from tests.oed.reports.said_once import said_twice

N = 400
LIMITS = tuple(
    Limit(
        effect=name, joint=joint, detectable=size, at_worst=worst, attributable=2 * size, toughest="spring", visible=0.3
    )
    for name, joint, size, worst in (
        ("stribeck", 1, 0.01, 0.07),
        ("stribeck", 2, np.inf, np.inf),
        ("encoder_offset", 2, 0.004, 0.004),
        ("base_tilt", None, 0.02, np.inf),
    )
)


@pytest.fixture
def found():
    random = np.random.default_rng(0)
    t = 0.01 * np.arange(N)
    speed = np.sin(t)
    base = random.normal(size=(N, 2))
    bend = np.column_stack([np.zeros(N), np.exp(-np.abs(speed) / 0.1) * np.sign(speed)])
    finding = Finding(
        effect="stribeck",
        sentence="Joint 2 needs 1 N m more than its Coulomb friction to break away.",
        joint=2,
        parameters=tuple(
            Parameter(name=name, value=value, unit=unit, ci95=(low, high), standard_error=np.nan, determined=True)
            for name, value, unit, low, high in (
                ("stribeck_torque", 1.0, "N m", 0.9, 1.1),
                ("exponent", 1.3, "1", np.nan, np.nan),
                ("order", 320.0, "periods per turn", 319.967, 320.033),
                ("friction_share", 1.0, "1", 1.0, 1.0),
            )
        ),
        p_value=0.001,
        delta_bic=86.0,
        gain=Gain(nrmse_before=0.1, nrmse_after=0.05, ci95=(0.03, 0.07)),
        rivals=(("presliding", 40.0),),
        visible=0.5,
        coordinate="velocity of joint 2 [rad/s]",
    )
    kinds = SimpleNamespace(kinds=("prismatic", "revolute"))
    robot = SimpleNamespace(name="two", title="two <joints>", joint_names=("lift", "swing"), chain=kinds, n=2)
    noise = 0.1 * random.normal(size=(N, 2))
    return Diagnosis(
        verdict="named",
        findings=(finding,),
        baseline=np.array([0.05, 0.1]),
        extended=np.array([0.05, 0.05]),
        explained=1.0,
        excess=np.full((2, 3), np.nan),
        limits=LIMITS,
        next_experiment=NextExperiment(
            kind="sweep",
            joint=None,
            why="it would show them apart",
            resolves=0.98,
            ranking=(Proposal(kind="sweep", resolves=0.98, duration=60.0),),
        ),
        model=SimpleNamespace(robot=robot, provenance={"unseen_nrmse": [0.07, None]}),
        how_unseen="a log that the fit has not seen",
        trace=Trace(t=t, measured=base + bend, before=bend + noise, after=noise, coordinate=(speed,)),
    )


@pytest.mark.slow
def test_the_page_tells_all(found):
    """The page holds verdict, finding, parameters, rivals, gain, limits and next step, and escapes names."""
    text = render(diagnosis_page(found))
    for part in ("Joint 2 needs 1 N m more", "stribeck torque", "0.900 to 1.10", "presliding", "10 → 5 %", "hidden"):
        assert part in text, part
    assert "not determined by these logs" in text
    assert "319.967 to 320.033" in text
    assert "chosen from a list of usual values" in text
    assert "Record constant speeds" in text
    assert "two <joints>" not in text


def test_a_finding_is_said_once(found):
    """One finding stands in the verdict, several stand in rows; sections show the evidence without their sentences."""
    (one,) = found.findings
    other = replace(one, effect="spring", sentence="A spring acts on joint 2 that is stiffer than the gear.")
    pattern = replace(
        one, effect="unexplained", pattern="p", sentence="A pattern repeats with the position of joint 1."
    )
    trace = replace(found.trace, coordinate=found.trace.coordinate * 3)
    several = replace(found, findings=(one, other, pattern), trace=trace)
    for verdict in ("named", "unexplained", "ambiguous"):
        assert said_twice(diagnosis_page(replace(several, verdict=verdict))) == []
    assert said_twice(diagnosis_page(found)) == []
    assert one.sentence in diagnosis_page(found).verdict


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verdict", "expected", "stated", "following", "level"),
    [
        (
            "none",
            "No missing effect was found",
            "Of 3 effects and places half would have shown from 1.0 % of the joint&#39;s torque on, nine in ten from "
            "1.8 %; at any size hidden: stribeck of joint 2.",
            "No further experiment is needed.",
            "good",
        ),
        (
            "unexplained",
            "no effect of the catalogue explains",
            "Part of the residual is not noise",
            "no experiment of the catalogue can identify it",
            "act",
        ),
    ],
)
def test_a_page_without_findings(verdict, expected, stated, following, level, found):
    """Where nothing is named, the verdict says so, what would have been seen, and what to do."""
    page = diagnosis_page(replace(found, verdict=verdict, findings=(), next_experiment=None))
    assert expected in page.verdict
    assert page.level == level
    assert stated in render(page)
    assert following in render(page)


@pytest.mark.slow
def test_no_chance_is_reported_that_nobody_knows(found):
    """What the smallest number of a computer says of a probability is no probability."""
    sure = replace(found, findings=(replace(found.findings[0], p_value=2.2e-308),))
    text = render(diagnosis_page(sure))
    assert "e-308" not in text
    assert "1e-12" in text


@pytest.mark.parametrize(("interval", "stated"), [((0.03, 0.07), True), ((-0.01, 0.02), False)])
def test_what_brings_nothing_explains_nothing(interval, stated, found):
    """A free function that stands out of the noise and does not surely help elsewhere explains no part of the error."""
    finding = replace(found.findings[0], gain=replace(found.findings[0].gain, ci95=interval))
    page = diagnosis_page(replace(found, verdict="unexplained", findings=(finding,)))
    assert ("part of the error has no known cause" in page.verdict) == stated
    assert page.level == "act"
    assert any(one.text == finding.sentence for one in page.findings)


def test_the_error_of_every_row_is_reported_where_it_is_known(found):
    """Beside the error of rows that count stands that of `oed predict`, which has them all."""
    (table,) = next(s for s in diagnosis_page(found).sections if s.title.startswith("Measured")).tables
    assert table.headings[-1] == "all rows [%]"
    assert [row[-1] for row in table.rows] == [pytest.approx(7.0), None]


def test_the_error_reported_is_that_of_a_joint_with_a_finding(found):
    """Another joint may change by more, for what the base model makes of it: that is not what was found."""
    page = diagnosis_page(replace(found, baseline=np.array([0.2, 0.1]), extended=np.array([0.1, 0.11])))
    assert page.facts[1].label == "Error of joint 2, held-out data"
    whole = replace(found.findings[0], joint=None)
    page = diagnosis_page(replace(found, findings=(whole,), baseline=np.array([0.2, 0.1])))
    assert page.facts[1].label == "Error of joint 1, held-out data"


@pytest.mark.slow
def test_what_has_no_name_is_not_stated_to_need_no_experiment(found):
    """Findings without a name leave the cause open: the page says how to look for it."""
    named, unexplained = (
        render(diagnosis_page(replace(found, verdict=verdict, next_experiment=None)))
        for verdict in ("named", "unexplained")
    )
    assert "No further experiment is needed" in named
    assert "No further experiment is needed" not in unexplained
    assert "Move the joint alone" in unexplained


@pytest.mark.slow
def test_a_rare_rival_that_fits_as_well_is_not_passed_over(found):
    """A cause is named although what few robots have fits about as well: the next step says so."""
    close = replace(found.findings[0], rivals=(("shear thinning", 7.9), ("presliding", 40.0)))
    text = render(diagnosis_page(replace(found, findings=(close,), next_experiment=None)))
    assert "If your robot may have it" in text
    assert "about as well: shear thinning." in text


@pytest.mark.slow
def test_what_to_play_next_is_reported(found):
    """The page lists which motion is played when, with what payload and base, and where the motion comes from."""
    t = 0.1 * np.arange(4)
    motion = Motion(t=t, q=np.zeros((4, 2)), dq=np.zeros((4, 2)), ddq=np.zeros((4, 2)))
    run = Stage(motion=motion, pause=2.0, payload=0.0, gravity=None)
    tilted = replace(run, pause=60.0, payload=4.5, gravity=np.array([2.54, 0.0, -9.475]))
    plan = replace(found.next_experiment, logged="monday from t = 0 to 40 s", stages=(run, tilted))
    text = render(diagnosis_page(replace(found, next_experiment=plan)))
    for part in ("next_experiment_1.csv", "2.54, 0, -9.475", "4.5", "The motion is that of monday from t = 0 to 40 s"):
        assert part in text, part


def test_a_note_is_reported_of_the_places_it_is_of():
    """Effects that one note is of on different joints are not stated as if it were of all of them on all joints."""
    hidden = [
        Limit(
            effect=effect,
            joint=joint,
            detectable=np.inf,
            at_worst=np.inf,
            attributable=np.inf,
            toughest=None,
            visible=0.0,
            note="nothing shows",
        )
        for effect, joint in (("backlash", 2), ("backlash", 3), ("encoder_offset", 1), ("encoder_eccentricity", 1))
    ]
    (note,) = limits_section(hidden).paragraphs[1:]
    titles = {name: EFFECTS[name].title for name in ("backlash", "encoder_offset", "encoder_eccentricity")}
    assert note == (
        f"{titles['backlash']} on joints 2, 3 / {titles['encoder_offset']}; {titles['encoder_eccentricity']} on joint "
        "1: nothing shows."
    )


@pytest.mark.slow
def test_the_simulated_motion_is_reported(found):
    """The page says what was simulated under which loop, per joint in its unit, and draws the joint that changes."""
    t = 0.01 * np.arange(N)
    two = np.column_stack([np.sin(t), np.cos(t)])
    curves = Curves(t=t, measured=two, torque=(0.9 * two, two), deviation=(1e-3 * two, 1e-4 * two))
    simulation = Simulation(
        start=2.0,
        end=7.0,
        loop=Loop(bandwidth=5.0),
        torque=(np.array([0.05, 0.1]), np.array([0.05, 0.02])),
        motion=(np.array([1e-3, 2e-3]), np.array([1e-3, 4e-4])),
        note="As it is.",
        curves=curves,
    )
    page = diagnosis_page(replace(found, simulation=simulation))
    (picture,) = (picture for picture in page.pictures if picture.name == "simulation")
    assert "swing" in picture.title
    assert picture.panels[1].y_label == "error [mrad]"
    assert picture.panels[1].series[0].y == pytest.approx(two[:, 1])
    text = render(page)
    for part in ("Simulated motion", "from 2.0 to 7.0 s", "The controller is assumed", "5 Hz", "As it is.", "mm"):
        assert part in text, part
    again = diagnosis_page(replace(found, simulation=replace(simulation, curves=None)))
    assert "simulation" not in [picture.name for picture in again.pictures]


def test_an_ambiguous_verdict_is_no_good_news(found):
    """An ambiguous diagnosis says so, and warns."""
    page = diagnosis_page(replace(found, verdict="ambiguous"))
    assert page.level == "act"
    assert "several causes fit" in page.verdict


@pytest.mark.slow
def test_without_unseen_data_no_gain_is_claimed(found):
    """Where no run was left to measure on, the page shows no error bars and no percentages."""
    none = np.full(2, np.nan)
    finding = replace(found.findings[0], gain=Gain(nrmse_before=np.nan, nrmse_after=np.nan, ci95=(np.nan, np.nan)))
    page = diagnosis_page(replace(found, baseline=none, extended=none, findings=(finding,)))
    assert [picture.name for picture in page.pictures] == ["torque", "cause-1"]
    assert "percentage points" not in render(page)
    assert all("unseen" not in fact.label for fact in page.facts)


def test_the_mean_of_a_stretch_is_that_of_its_samples():
    """Binned means are those of as many samples each, in the order of the coordinate."""
    random = np.random.default_rng(1)
    x = random.permutation(6000).astype(float)
    middle, mean, error = binned(x, 2.0 * x + random.normal(size=6000))
    assert (np.diff(middle) > 0).all()
    np.testing.assert_allclose(mean, 2.0 * middle, atol=3.0)  # the median of a hundred numbers against their mean
    assert len(middle) == 60
    assert (error > 0).all()


def test_neighbours_in_time_count_as_one():
    """Samples in succession at one place do not make a mean more certain."""
    values = np.random.default_rng(2).normal(size=3000)
    slow, quick = np.repeat(np.arange(60.0), 50), np.tile(np.arange(60.0), 50)
    assert binned(slow, values)[2].mean() > 5 * binned(quick, values)[2].mean()


def test_a_picture_that_does_not_change_is_drawn_once():
    """Where both residuals look the same there is one panel, and the caption says why; else there are two."""
    x = np.linspace(0.0, 1.0, 500)
    before = np.sin(40 * x)
    same = cause_picture("x [1]", x, before, before + 1e-4, title="same")
    assert len(same.panels) == same.columns == 1
    assert "is not drawn again" in same.caption
    assert len(cause_picture("x [1]", x, before, 0.5 * before, title="changed").panels) == 2


def test_pictures_of_nothing():
    """A coordinate without a value, and one that never changes, are drawn without complaint."""
    nothing = np.full(5, np.nan)
    assert cause_picture("x [1]", nothing, nothing, nothing, title="none").panels
    assert cause_picture("x [1]", np.zeros(5), np.ones(5), np.zeros(5), title="one").panels
    with pytest.raises(InputError, match=r"shapes \(2,\)"):
        cause_picture("x [1]", np.zeros(2), np.ones(5), np.zeros(5), title="bad")
    with pytest.raises(InputError, match=r"allowed: \(n,\), both"):
        gain_picture(np.zeros(2), np.zeros(3))


def test_the_page_of_a_plan():
    """A planned experiment's page counts what would be named, and lists what is hidden."""
    page = limits_page((*LIMITS, replace(LIMITS[0], joint=3, note="joint hardly moves")), "two")
    text = render(page)
    assert "finds and names 3 of 5 pairs of effect and joint at 2 %" in page.verdict
    assert "1 (7) / 2" in text
    assert "2 (never) / 4" in text
    assert "0.4 / 0.8" in text
    assert "on joint 3: joint hardly moves." in text
    assert "hidden" in text
    assert "Stribeck friction" in page.findings[0].text


@pytest.mark.slow
def test_works_in_a_browser(found: Diagnosis, in_browser: Callable[[Page], None]) -> None:
    """The pages of a diagnosis and of a plan pass all checks of `browser_checks`."""
    in_browser(diagnosis_page(found))
    in_browser(limits_page(LIMITS, "two"))
