"""The verb compare: what is significant, who is named, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, kstest

from estimation import load_model
from estimation.comparisons import compare, read_model_runs, run_of
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.terms import PositionTorque

PAIRS = 60


@pytest.mark.slow
def test_identical_robots_rarely_differ(draw):
    """Pairs of one robot: uniform p-values of the whole model, and any false alarm in at most 1 % of the pairs.

    The Kolmogorov-Smirnov test fails 1 seed in 1000. Of 60 pairs at most 1 % alarm on average; the limit is passed in
    1 of 10,000 seeds (binomial).
    """
    found = [compare([draw(2 * seed), draw(2 * seed + 1)]) for seed in range(PAIRS)]
    whole = [item.of_run(1, "whole")[0].p_value for item in found]
    assert kstest(whole, "uniform").pvalue > 1e-3
    assert sum(bool(item.significant) for item in found) <= binom.ppf(1 - 1e-4, PAIRS, 0.01)
    assert sum(bool(item.damaged) for item in found) <= binom.ppf(1 - 1e-4, PAIRS, 0.01)


@pytest.mark.parametrize("joint", [1, 2, 3])
def test_friction_of_one_joint_is_named(draw, joint):
    """10 % more friction on one joint is found on that joint alone, with its size within 3 points.

    The change is 7 or more standard errors of 1.5 %; the sizes miss 3 points in 1 of 20 seeds (two sigma), which are
    fixed here.
    """
    factors = [1.0, 1.0, 1.0]
    factors[joint - 1] = 1.1
    found = compare([draw(20), draw(21, tuple(factors))])
    assert {item.joint for item in found.damaged} == {joint}
    (change,) = found.damaged
    assert 100 * np.expm1(change.own) == pytest.approx(10.0, abs=3.0)
    assert change.sentence().startswith(f"Joint {joint}: friction +")
    assert "this joint alone" in change.sentence()
    assert f"Friction changed on joint {joint} alone" in found.verdict()
    assert f"differ significantly in friction of joint {joint}." in found.verdict()
    assert {item.name for item in found.significant if item.level == "part"} == {f"friction of joint {joint}"}


def test_heat_is_common_to_all_joints(draw):
    """Friction that falls by 30 % on all joints is common, and the robot is called warmer."""
    found = compare([draw(30), draw(31, (0.7, 0.7, 0.7))])
    assert {item.kind for item in found.friction} == {"common"}
    assert not found.damaged
    assert "the robot was warmer" in found.verdict()
    assert all(100 * np.expm1(item.common) == pytest.approx(-30, abs=4) for item in found.friction)


def test_damage_shows_beside_heat(draw):
    """32 % more friction on joint 2 of a robot that is 20 % warmer is named; the other joints keep the common share."""
    found = compare([draw(40), draw(41, (0.8, 0.8 * 1.32, 0.8))])
    assert [(item.joint, item.kind) for item in found.friction] == [(1, "common"), (2, "own"), (3, "common")]


def test_unequal_heating_is_not_damage(draw):
    """A joint whose friction fell by 35 % while the others fell by 30 % and 25 % is called unequally heated at most."""
    found = compare([draw(50), draw(51, (0.7, 0.65, 0.75))])
    assert {item.kind for item in found.friction} <= {"common", "unequal"}


def test_other_speeds_of_the_bends_are_converted(draw, upright, base):
    """Models whose friction bends at other speeds are compared by their curves: the same curve gives no difference."""
    from robots.terms import BendingFriction

    def model(speed, values):
        terms = default_model(upright, friction=BendingFriction(speed=speed), velocity_scale=1e-3)
        found = find_base_parameters(terms)
        pi = found.from_standard(np.nan_to_num(terms.nominal)) * values
        scale = 0.01 * np.maximum(np.abs(pi), 0.05)
        return replace(
            draw(0),
            torque_model=terms,
            columns=found.independent,
            values=pi,
            covariance=np.diag(scale**2),
            determined=np.ones(found.size, dtype=bool),
            formulas=found.formulas(),
            provenance={
                "recorded": {"position": [[-1] * 3, [1] * 3], "velocity": [[2] * 3], "acceleration": [[9] * 3]}
            },
        )

    found = compare([model(2.0, 1.0), model(2.2, 1.0 + 1e-9)])
    assert found.common.misfit < 1e-2
    for curve in found.curves:
        assert np.abs(curve.difference[1]).max() < 0.01 * np.abs(curve.torque).max()


def test_other_motions_allow_for_model_errors(draw):
    """Runs of different motions have standard errors three times as large, and a note; one motion has neither."""
    recorded = {"position": [[-0.5] * 3, [0.5] * 3], "velocity": [[1.5] * 3], "acceleration": [[9.0] * 3]}
    one, two = draw(70), draw(71)
    moved = replace(two, provenance={**two.provenance, "recorded": recorded})
    same, apart = compare([one, two]), compare([one, moved])
    assert same.common.same_motion
    assert not apart.common.same_motion
    assert apart.common.covariances == pytest.approx(9 * same.common.covariances)
    assert any("different motions" in warning for warning in apart.warnings)
    assert not same.warnings


def test_prior_makes_no_false_alarm(draw):
    """A pull that both runs share leaves differences smaller than stated: p-values are larger, never smaller."""
    one, two = draw(60), draw(61)
    wide = [replace(model, covariance=4 * model.covariance) for model in (one, two)]
    narrow, conservative = compare([one, two]), compare(wide)
    for a, b in zip(narrow.differences, conservative.differences, strict=True):
        assert b.p_value >= a.p_value


def test_dates_order_the_runs(draw):
    """Runs with dates, of time stamps or of names, are put in order of time; the earliest is the baseline."""
    stamped = {"logs": [{"name": "late", "start": 1_772_700_000.0, "samples": 10, "sha256": "b"}]}
    late = run_of(draw(1, **stamped), "late")
    early = run_of(draw(2), "early", "runs/2026-03-01_0800/model.json")
    found = compare([late, early])
    assert found.labels == ("early", "late")
    assert found.order == "date"
    assert found.runs[0].date_text == "2026-03-01 08:00"
    assert found.hours is not None
    assert found.hours[1] == pytest.approx((1_772_700_000 - 1_772_352_000) / 3600)


def test_temperatures_of_the_logs_are_shown(draw):
    """Joint temperatures in the provenance become the run's, weighted by samples."""
    logs = [
        {"name": "a", "start": 0.0, "samples": 30, "sha256": "a", "temperature": [20.0, None, 30.0]},
        {"name": "b", "start": 50.0, "samples": 10, "sha256": "b", "temperature": [40.0, None, 30.0]},
    ]
    run = run_of(draw(1, logs=logs), "warm")
    assert run.temperature == pytest.approx([25.0, np.nan, 30.0], nan_ok=True)
    assert run.to_dict()["temperature"][1] is None


def test_written_comparison_is_complete(draw, tmp_path):
    """compare.json holds every test and every curve, and the merged model.json is read again."""
    found = compare([draw(seed) for seed in range(5)])
    found.save(tmp_path)
    data = json.loads((tmp_path / "compare.json").read_text())
    assert data["verdict"] == found.verdict()
    assert len(data["differences"]) == len(found.differences)
    assert len(data["drift"]) == len(found.drifts)
    merged = load_model(tmp_path)
    assert merged.values == pytest.approx(found.merged.model.values)
    assert found.summary().startswith("upright: 5 runs")
    assert len(found.to_frame()) == len(found.differences)
    assert found.plot().get_ylabel() == "change of friction [%]"


def test_one_model_alone_is_refused(draw):
    """One model alone is refused."""
    with pytest.raises(InputError, match="1 model to compare; allowed: two or more"):
        compare([draw(1)])


def test_the_same_model_twice_is_refused(draw):
    """A model that is given twice is refused, with both labels."""
    with pytest.raises(InputError, match="run 2 and run 1 are the same model"):
        compare([draw(1), draw(1)])


def test_models_of_one_log_are_refused(draw):
    """Two models of one log have common errors, and are refused."""
    logs = [{"name": "monday.csv", "sha256": "abc", "start": 0.0, "samples": 10}]
    with pytest.raises(InputError, match=r"same log monday\.csv: their errors are not independent"):
        compare([draw(1, logs=logs), draw(2, logs=logs)])


def test_other_columns_are_named(draw, upright):
    """Models with other parameters are refused, and the missing parameters are named."""
    terms = default_model(upright, friction="polynomial", velocity_scale=1e-3)
    found = find_base_parameters(terms)
    other = replace(
        draw(1),
        torque_model=terms,
        columns=found.independent,
        values=np.ones(found.size),
        covariance=np.eye(found.size),
        determined=np.ones(found.size, dtype=bool),
        formulas=found.formulas(),
    )
    with pytest.raises(InputError, match=r"run 1 lacks the parameters f3_1, f4_1, f3_2.*--friction"):
        compare([draw(2), other])


@pytest.mark.parametrize("stated", [0.0, 0.5])
def test_a_torque_by_position_that_one_model_lacks_is_zero_there(draw, upright, stated):
    """A model without a torque by position compares with one that has it: it differs where that torque is not zero."""
    plain, other = draw(60), draw(61)
    terms = replace(other.torque_model, terms=(*other.torque_model.terms, PositionTorque()))
    columns = tuple(terms.names.index(name) for name in (*other.names, "sin2_2", "cos2_2"))
    size = len(columns)
    covariance = 1e-4 * np.eye(size)
    covariance[:-2, :-2] = other.covariance
    with_torque = replace(
        other,
        torque_model=terms,
        columns=columns,
        values=np.concatenate([other.values, [stated, 0.0]]),
        covariance=covariance,
        determined=np.ones(size, dtype=bool),
        formulas=tuple(terms.columns[i].name for i in columns),
        provenance={**other.provenance, "prior_share": [0.0] * size},
    )
    for pair in ([plain, with_torque], [with_torque, plain]):
        parts = {item.name for item in compare(pair).significant if item.level == "part"}
        assert parts == ({"position torque of joint 2"} if stated else set())


def test_another_robot_is_named(draw, arm, upright):
    """A robot with another number of joints, or with a joint elsewhere, is refused with what differs."""
    terms = default_model(arm, friction="coulomb-viscous", velocity_scale=1e-3)
    found = find_base_parameters(terms)
    small = replace(
        draw(1),
        torque_model=terms,
        columns=found.independent,
        values=np.ones(found.size),
        covariance=np.eye(found.size),
        determined=np.ones(found.size, dtype=bool),
        formulas=found.formulas(),
    )
    with pytest.raises(InputError, match="arm has 2 joints, upright has 3"):
        compare([draw(2), small])
    joints = list(upright.chain.joints)
    joints[2] = replace(joints[2], translation=joints[2].translation + np.array([0.05, 0.0, 0.0]))
    longer = replace(upright, chain=replace(upright.chain, joints=tuple(joints)))
    model = draw(1)
    moved = replace(model, torque_model=replace(model.torque_model, robot=longer))
    with pytest.raises(InputError, match=r"joint 3 of upright stands otherwise .* by 0\.05 m"):
        compare([draw(2), moved])


def test_a_model_without_covariance_is_refused(draw, tmp_path):
    """A model file without covariance, or with zeros, is refused, and the file is named."""
    for name, seed in (("a", 1), ("b", 2)):
        draw(seed).save(tmp_path / f"{name}.json")
    data = json.loads((tmp_path / "b.json").read_text())
    (tmp_path / "c.json").write_text(json.dumps({key: value for key, value in data.items() if key != "covariance"}))
    with pytest.raises(InputError, match=r"c\.json: the model has no covariance"):
        read_model_runs([tmp_path / "a.json", tmp_path / "c.json"])
    data["covariance"] = np.zeros((len(data["parameters"]),) * 2).tolist()
    (tmp_path / "d.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"d\.json: the model has no covariance"):
        compare(read_model_runs([tmp_path / "a.json", tmp_path / "d.json"]))


def test_an_impossible_rate_is_refused(draw):
    """A false-alarm rate outside 0 to 0.5 is refused."""
    with pytest.raises(InputError, match="false-alarm rate 0"):
        compare([draw(1), draw(2)], alpha=0.0)


def test_friction_has_one_statement(draw, base):
    """A curve that differs where its mean does not is stated as that, in the verdict, the table and the sentence."""
    one, two = draw(80), draw(80)
    f1, f2 = (
        next(i for i, c in enumerate(base.columns) if c.friction and c.symbol == s and c.joint == 2)
        for s in ("f1", "f2")
    )
    values = two.values + 1e-6
    change = 0.3 * values[f1]
    values[f1] += change
    # The mean over the speeds stays: the viscous part makes up for the other.
    curve = compare([one, replace(two, values=two.values + 1e-6)]).curves[1]
    values[f2] -= change * curve.mean_row[f1] / curve.mean_row[f2]
    found = compare([one, replace(two, values=values)])
    assert found.friction[1].kind == "unchanged"
    assert found.parts(1) == ("friction curve of joint 2",)
    assert "friction curve of joint 2" in found.verdict()
    assert "friction of joint 2" not in found.summary()
    assert "not significant in the mean; the curve differs, most at " in found.friction[1].sentence()
    low, high = found.friction[1].curve.low, found.friction[1].curve.high
    assert low < found.friction[1].curve.percent < high
    assert low * high > 0
    assert "f1_2" not in found.summary()


def test_curves_of_another_sign_width_are_compared_by_their_mean(draw, base):
    """Coefficients that make up for another width of the sign are no difference; the note names the joint."""
    one, two = draw(81), draw(82)
    terms = tuple(
        replace(term, velocity_scale=(1e-3, 5e-3, 1e-3)) if hasattr(term, "velocity_scale") else term
        for term in two.torque_model.terms
    )
    f1, f2 = (
        next(i for i, c in enumerate(base.columns) if c.friction and c.symbol == s and c.joint == 2)
        for s in ("f1", "f2")
    )
    values = two.values.copy()
    rows = compare([one, two]).curves[1].mean_row
    values[f1] *= 1.3
    values[f2] -= 0.3 * two.values[f1] * rows[f1] / rows[f2]
    other = replace(two, torque_model=replace(two.torque_model, terms=terms), values=values)
    found = compare([one, other])
    assert not found.significant
    assert any("different widths in the models (joint 2)" in warning for warning in found.warnings)
    assert compare([one, replace(two, values=values)]).significant
