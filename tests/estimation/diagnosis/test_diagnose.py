"""Tests of `diagnose`: named and unexplained effects, the extended model, and bad input."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import load_model, predict
from estimation.diagnosis import Diagnosis, diagnose
from estimation.logs.clocks import UNKNOWN_PAUSE
from estimation.predictions.earlier_logs import clock_shift
from oed.reports import diagnosis_page
from robots.common.errors import InputError, NotIdentifiableError
from robots.plants import simulate
from robots.plants.effects import plant_effect
from robots.robot import Robot
from robots.signals import Log

pytestmark = pytest.mark.slow

SOME = ("asymmetric_friction", "friction_step", "load_dependent_friction", "stribeck", "spring", "payload_change")
# The arm has no higher powers; one motion hardly determines them, and they would add errors on another.
SIMPLE = "coulomb-viscous"


@pytest.fixture(scope="module")
def hidden(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> Callable[..., tuple[Log, Log]]:
    """Simulates the arm with an effect, and returns logs of two motions."""

    def build(effect: str | None, joint: int | None = None, seed: int = 0, **values: float) -> tuple[Log, Log]:
        plant = arm_plant(torque_noise=0.02)
        if effect is not None:
            plant = replace(plant, effects=(plant_effect(arm, effect, joint, values),))
        first, second = fourier_motion(arm, 0), fourier_motion(arm, 1)
        later = replace(second, t=np.asarray(second.t) + 100.0)
        return simulate(plant, first, seed=seed), simulate(plant, later, seed=seed + 1)

    return build


@pytest.fixture(scope="module")
def stepped(arm: Robot, hidden: Callable[..., tuple[Log, Log]]) -> tuple[Diagnosis, Log]:
    """Returns the diagnosis of an arm whose second joint's friction rises at 8 s."""
    log, unseen = hidden("friction_step", 2, coulomb_step=0.4, viscous_step=0.1, change_time=8.0)
    return diagnose(arm, log, held_out=unseen, candidates=SOME, friction=SIMPLE), unseen


def test_a_log_without_effects_has_nothing_found(arm: Robot, hidden: Callable[..., tuple[Log, Log]]) -> None:
    """Without an effect the verdict is `none`, with the base model as the extended model.

    A false alarm has a chance of 1 %.
    """
    log, _ = hidden(None)
    result = diagnose(arm, log, candidates=SOME)
    assert result.verdict == "none"
    assert result.findings == ()
    assert result.model.extensions == ()
    assert result.baseline == pytest.approx(result.extended)
    assert "only log" in result.how_unseen


def test_a_step_of_friction_is_named_with_its_joint_its_time_and_its_gain(stepped: tuple[Diagnosis, Log]) -> None:
    """A friction step is named with joint, time to 0.2 s and coefficients, and reduces the held-out error."""
    result, _ = stepped
    assert result.verdict in ("named", "ambiguous")
    finding = result.findings[0]
    assert (finding.effect, finding.joint) == ("friction_step", 2)
    values = {parameter.name: parameter for parameter in finding.parameters}
    assert values["change_time"].value == pytest.approx(8.0, abs=0.2)
    step = values["coulomb_step"]
    assert abs(step.value - 0.4) < 4 * step.standard_error
    assert finding.gain.ci95[0] > 0
    assert result.extended[1] < result.baseline[1]
    assert finding.p_value < 0.01


def test_the_extended_model_predicts_an_unseen_log_as_its_file_does(
    stepped: tuple[Diagnosis, Log], tmp_path: Path
) -> None:
    """A saved model predicts the same after loading, and better than without its extension."""
    result, unseen = stepped
    result.save(tmp_path)
    model = load_model(tmp_path)
    assert [extension.effect for extension in model.extensions] == [f.effect for f in result.findings]
    whole = predict(model, unseen)
    assert whole.predicted == pytest.approx(predict(result.model, unseen).predicted)
    alone = predict(replace(model, extensions=()), unseen)
    assert whole.nrmse[1] < alone.nrmse[1]
    # The stated held-out error is that of a prediction, including rows near reversals.
    np.testing.assert_allclose(result.every_row, whole.nrmse, rtol=1e-9)
    np.testing.assert_allclose(result.extended, whole.nrmse, rtol=0.15)
    assert " ".join(f"{100 * value:.2f}" for value in whole.nrmse) in result.summary()
    with pytest.raises(InputError, match="exists"):
        result.save(tmp_path)


def test_a_log_that_began_its_clock_anew_is_predicted_as_after_the_change(
    stepped: tuple[Diagnosis, Log], tmp_path: Path
) -> None:
    """A log that overlaps the fit's log in time is predicted as recorded after it; the fit's own log is not."""
    result, unseen = stepped
    result.save(tmp_path)
    model = load_model(tmp_path)
    anew = replace(unseen, t=unseen.t - unseen.t[0] + 0.5)
    later, word = clock_shift(model, anew)
    assert later == pytest.approx(model.provenance["logs"][0]["duration"] + UNKNOWN_PAUSE - 0.5)
    assert "taken as recorded 60 s after" in word
    np.testing.assert_allclose(predict(model, anew).predicted, predict(model, unseen).predicted, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(predict(model, anew).motion.t, predict(model, unseen).motion.t - 99.5, atol=1e-6)
    assert clock_shift(model, unseen) == clock_shift(replace(model, extensions=()), anew) == (0.0, "")


def test_a_diagnosis_survives_its_file(stepped: tuple[Diagnosis, Log], tmp_path: Path) -> None:
    """A saved diagnosis is loaded unchanged, and its file has the documented keys."""
    result, _ = stepped
    result.save(tmp_path)
    data = json.loads((tmp_path / "diagnosis.json").read_text())
    assert set(data) >= {"verdict", "findings", "baseline", "extended", "limits", "next_experiment"}
    assert set(data["findings"][0]) >= {"effect", "joint", "parameters", "p_value", "delta_bic", "gain", "rivals"}
    assert set(data["findings"][0]["parameters"][0]) >= {"name", "value", "unit", "ci95"}
    assert len(data["baseline"]["nrmse"]) == 2
    again = Diagnosis.load(tmp_path)
    assert again.verdict == result.verdict
    assert again.to_dict() == result.to_dict()
    assert again.summary() == result.summary()


def test_the_summary_names_cause_joint_and_gain(stepped: tuple[Diagnosis, Log]) -> None:
    """The summary states effect, joint, parameters with intervals, and the data of the gain."""
    text = stepped[0].summary()
    assert "friction_step (joint 2)" in text
    for parameter in stepped[0].findings[0].parameters:
        assert f"{parameter.name} (" in parameter.text
        assert parameter.text in text
    assert "not seen" in text
    assert len(stepped[0].to_frame()) == sum(len(f.parameters) for f in stepped[0].findings)


def test_a_cause_outside_the_candidates_is_not_forced_into_a_name(
    arm: Robot, hidden: Callable[..., tuple[Log, Log]]
) -> None:
    """An effect outside the candidates is unexplained, with its joint and a gain."""
    log, unseen = hidden("position_dependent_friction", 1, cosine=0.9, sine=0.3, order=3.0)
    result = diagnose(arm, log, held_out=unseen, candidates=("payload_change", "torque_sensor_drift"), friction=SIMPLE)
    assert result.verdict == "unexplained"
    finding = result.findings[0]
    assert (finding.effect, finding.joint) == ("unexplained", 1)
    assert "position" in finding.sentence
    assert result.extended[0] < result.baseline[0]


def test_peaks_that_are_cut_off_are_named_though_they_explain_little(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable
) -> None:
    """Flat tops of 120 samples are named as clipping; 40 samples give a note only."""
    log = simulate(arm_plant(torque_noise=0.1), fourier_motion(arm, 0), seed=0)
    some = ("current_clipping", "spring", "friction_step")

    def cut(rows: int) -> tuple[float, Diagnosis]:
        limit = float(np.sort(np.abs(log.tau[:, 0]))[-rows])
        tau = np.column_stack([np.clip(log.tau[:, 0], -limit, limit), log.tau[:, 1]])
        assert np.sum(np.abs(tau[:, 0]) == limit) == rows
        return limit, diagnose(arm, replace(log, tau=tau), candidates=some, friction=SIMPLE)

    limit, result = cut(120)
    (finding,) = result.findings
    assert (finding.effect, finding.joint) == ("current_clipping", 1)
    assert finding.p_value < 1e-4
    (level,) = (p for p in finding.parameters if p.name == "level")
    assert level.value == pytest.approx(limit, rel=0.1)
    limit, result = cut(40)
    assert result.verdict == "none"
    assert any(
        note.startswith(f"Joint 1: the torque stays at its maximum, {limit:.3g} N m, for") for note in result.notes
    )
    whole = diagnose(arm, log, candidates=some, friction=SIMPLE)
    assert whole.verdict == "none"
    assert not any("at its maximum" in note for note in whole.notes)


def test_noise_that_is_a_third_of_the_torque_is_said(arm: Robot, fourier_motion: Callable, arm_plant: Callable) -> None:
    """Noise of a third of the torque gives a note on its joint, and no finding."""
    log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, 0), seed=0)
    loud = replace(
        log, tau=log.tau + np.random.default_rng(1).normal(size=log.tau.shape) * [0.0, 0.35 * log.tau[:, 1].std()]
    )
    result = diagnose(arm, loud, candidates=("payload_change",), friction=SIMPLE)
    assert result.verdict == "none"
    (note,) = (note for note in result.notes if "treated as noise" in note)
    assert note.startswith("Joint 2: ")


def test_unseen_motion_that_is_faster_than_friction_was_fitted_for_is_said(
    arm: Robot, fourier_motion: Callable, arm_plant: Callable
) -> None:
    """Held-out motion at twice the fitted speed gives a note, unless friction has no higher powers."""
    motion = fourier_motion(arm, 0)
    half = np.asarray(motion.t) / 2.0
    fast = replace(motion, t=half, dq=2.0 * motion.dq, ddq=4.0 * motion.ddq)
    plant = arm_plant(torque_noise=0.02)
    log, unseen = simulate(plant, motion, seed=0), simulate(plant, replace(fast, t=half + 100.0), seed=1)

    def reported(friction: str, held_out: Log) -> list[str]:
        result = diagnose(arm, log, held_out=held_out, candidates=("payload_change",), friction=friction)
        return [note for note in result.notes if "times as fast" in note]

    (note,) = reported("polynomial", unseen)
    assert note.startswith("Joints 1, 2: up to 2.0 times")
    assert reported(SIMPLE, unseen) == []
    assert reported("polynomial", simulate(plant, replace(motion, t=2 * half + 100.0), seed=2)) == []
    # A log with a gap counts as two stretches.
    kept = np.abs(unseen.t - unseen.t.mean()) > 0.5
    torn = replace(unseen, t=unseen.t[kept], q=unseen.q[kept], tau=unseen.tau[kept])
    (note,) = reported("polynomial", torn)
    assert note.startswith("Joints 1, 2: up to 2.0 times")


def test_a_finding_that_is_no_part_of_the_model_is_shown(stepped: tuple[Diagnosis, Log]) -> None:
    """The report shows a finding that the model does not contain."""
    result, _ = stepped
    left = replace(result.findings[0], effect="unexplained", pattern="pattern:time:0:even")
    page = diagnosis_page(replace(result, findings=(*result.findings, left)))
    titles = [section.title for section in page.sections if section.title.startswith("Finding")]
    assert len(titles) == len(result.findings) + 1
    assert "a pattern without a known cause" in titles[-1]


def test_bad_input_is_named(arm: Robot, hidden: Callable[..., tuple[Log, Log]]) -> None:
    """Each bad input raises an error that names it."""
    log, _ = hidden(None)
    with pytest.raises(InputError, match="unknown effect"):
        diagnose(arm, log, candidates=("stribek",))
    with pytest.raises(InputError, match="no logs"):
        diagnose(arm, [])
    with pytest.raises(InputError, match="false-alarm"):
        diagnose(arm, log, false_alarm=2.0)
    with pytest.raises(InputError, match="given twice"):
        diagnose(arm, [log, log])
    with pytest.raises(InputError, match="one of the logs"):
        diagnose(arm, log, held_out=log)
    with pytest.raises(InputError, match=r"s of usable logs"):
        diagnose(arm, log.rows(slice(0, 200)))
    still = replace(log, q=np.zeros_like(log.q))
    with pytest.raises(NotIdentifiableError, match="moves"):
        diagnose(arm, still)
