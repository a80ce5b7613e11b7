"""Tests of the held-out validation of findings, with given results instead of measurements."""

from __future__ import annotations

from dataclasses import replace

import pytest

from estimation.diagnosis.calibration import (
    CLOSE_RIVAL_BIC,
    CONTRADICTION_SHARE,
    MAX_RMSE_RATIO,
    MIN_RETAINED_GAIN,
)
from estimation.diagnosis.results.notes import state_change
from estimation.diagnosis.searches.selection import SelectedEffect
from tests.estimation.diagnosis.held_out_bench import (
    FREE,
    HARMS,
    HELPS,
    IDLE,
    LABELS,
    PRESLIDING,
    PUSH,
    SPRING,
    STRIBECK,
    SWING,
    TILT,
    Shown,
    bench_with,
    label_of,
    member_of,
    validated,
)


@pytest.mark.parametrize(("rise", "stays"), [(MAX_RMSE_RATIO - 0.03, True), (MAX_RMSE_RATIO + 0.01, False)])
def test_heat_before_the_unseen_data_is_not_held_against_a_cause(rise: float, stays: bool) -> None:
    """Rows that contradict a thermal effect do not reject it, because stored heat is unknown; a larger error does."""
    warm = member_of("thermal_friction", 2)
    bench = bench_with()
    bench.shows[warm.hypothesis.label] = Shown(-0.004, -0.001, rise, speaks=-0.5)
    assert (validated(bench, SelectedEffect(warm, 1e-9, ())).effects == (warm,)) is stays


def test_another_form_of_a_cause_goes_before_a_rival() -> None:
    """The first equivalent shape that passes the validation replaces a rejected one, before any rival."""
    rival, levers = (PRESLIDING, 2.0), [replace(SPRING, shape=(0.35, centre)) for centre in (0.0, 1.0, 2.0)]
    bench = bench_with(spring=HARMS)
    bench.shows |= {label_of(levers[0]): HARMS, label_of(levers[1]): HELPS, label_of(levers[2]): HELPS}
    result = validated(bench, SelectedEffect(SPRING, 1e-9, (rival,)), forms=levers)
    assert result.findings[0].effect is result.effects[0] is levers[1]
    assert (result.findings[0].p_value, result.findings[0].rivals, result.changes) == (1e-9, (rival,), ())
    bench.shows |= {label_of(lever): HARMS for lever in levers}
    assert validated(bench, SelectedEffect(SPRING, 1e-9, (rival,)), forms=levers).effects[0] is PRESLIDING


def test_a_form_that_does_no_harm_goes_after_a_rival_that_helps() -> None:
    """A shape that neither helps nor harms keeps a finding only if no rival passes the validation."""
    rival, levers = (PRESLIDING, 2.0), [replace(SPRING, shape=(0.35, centre)) for centre in (0.0, 1.0)]
    bench = bench_with(spring=HARMS, presliding_hysteresis=HARMS)
    bench.shows |= {label_of(levers[0]): HARMS, label_of(levers[1]): IDLE}
    result = validated(bench, SelectedEffect(SPRING, 1e-9, (rival,)), forms=levers)
    assert result.effects == (levers[1],)
    assert result.changes == ()
    bench.shows[label_of(PRESLIDING)] = HELPS
    assert validated(bench, SelectedEffect(SPRING, 1e-9, (rival,)), forms=levers).effects == (PRESLIDING,)


def test_what_helps_stays_as_it_was_found() -> None:
    """Findings that held-out data support, or do not contradict, are kept in order."""
    founds = (SelectedEffect(SPRING, 1e-9, ((TILT, 3.0),)), SelectedEffect(STRIBECK, 1e-5, ()))
    bench = bench_with(stribeck=IDLE)
    result = validated(bench, *founds, free=[FREE], p_values=[1e-4])
    assert result.findings == founds
    assert result.effects == (SPRING, STRIBECK, FREE)
    assert result.p_values == (1e-9, 1e-5, 1e-4)
    assert (result.rejected_discrepancies, result.changes) == ((), ())
    assert len(bench.asked) == 1
    assert len(result.measured.gains) == 3


def test_a_name_that_surely_harms_is_left_out_with_a_note() -> None:
    """A rejected finding without a rival is left out with a note, and the others are measured again."""
    result = validated(bench_with(spring=HARMS), SelectedEffect(SPRING, 1e-9, ()), SelectedEffect(STRIBECK, 1e-5, ()))
    assert result.effects == (STRIBECK,)
    assert [found.effect for found in result.findings] == [STRIBECK]
    assert result.p_values == (1e-5,)
    assert len(result.measured.gains) == 1
    note = state_change(*result.changes)
    assert "spring of joint 2" in note
    assert "rejected" in note


@pytest.mark.parametrize(
    ("p_value", "kind", "named", "reported"),
    [
        (1e-4, "load", False, False),
        (1e-10, "load", False, True),
        (1e-4, "time", False, True),
        (1e-4, "sway", False, False),
        (1e-6, "sway", False, True),
        (1e-4, "load", True, True),
    ],
)
def test_a_faint_free_function_that_unseen_data_deny_is_noise(
    p_value: float, kind: str, named: bool, reported: bool
) -> None:
    """A free function with a weak p-value and contradicting held-out data is dropped as noise if nothing else is found.

    Functions of time are exempt, because other logs say nothing about them. Oscillations need a lower p-value, because
    they find a frequency in any noise.
    """
    free = member_of(f"pattern:{kind}:0:even", 3)
    bench = bench_with()
    bench.shows[free.hypothesis.label] = HARMS
    founds = (SelectedEffect(STRIBECK, 1e-5, ()),) if named else ()
    result = validated(bench, *founds, free=[free], p_values=[p_value])
    assert [member for member, *_ in result.rejected_discrepancies] == ([free] if reported else [])
    assert not result.refuted
    assert len(result.changes) == 1


@pytest.mark.parametrize("shown", [HELPS, HARMS])
def test_what_a_refuted_name_was_for_is_reported_as_unexplained(shown: Shown) -> None:
    """A free function replaces a rejected finding; it is in the model only if it passes the validation."""
    free = member_of("pattern:load:0:odd", 2)
    bench = bench_with(spring=HARMS)
    bench.shows[free.hypothesis.label] = shown
    result = validated(
        bench, SelectedEffect(SPRING, 1e-9, ()), SelectedEffect(STRIBECK, 1e-5, ()), unnamed=(free, 1e-7)
    )
    assert [found.effect for found in result.findings] == [STRIBECK]
    assert result.effects == ((STRIBECK, free) if shown is HELPS else (STRIBECK,))
    assert result.p_values == ((1e-5, 1e-7) if shown is HELPS else (1e-5,))
    assert [member for member, *_ in result.rejected_discrepancies] == ([] if shown is HELPS else [free])
    assert [member for member, *_ in result.refuted] == [SPRING]


@pytest.mark.parametrize(
    ("shown", "stays"),
    [
        (Shown(-0.002, 0.001, MAX_RMSE_RATIO + 0.01), False),  # much larger errors, though not significantly
        (Shown(-0.002, 0.001, MAX_RMSE_RATIO - 0.01), True),
        (Shown(kept=MIN_RETAINED_GAIN - 0.01), False),  # it fits only the rows of its fit
        (Shown(kept=MIN_RETAINED_GAIN + 0.01), True),
        (
            Shown(kept=MIN_RETAINED_GAIN - 0.1, speaks=MIN_RETAINED_GAIN + 0.01),
            True,
        ),  # errors of the base model hide the support of the rows
        (Shown(kept=MIN_RETAINED_GAIN - 0.1, speaks=MIN_RETAINED_GAIN - 0.01), False),
        (Shown(-0.001, 0.003, kept=MIN_RETAINED_GAIN - 0.1, speaks=MIN_RETAINED_GAIN + 0.01), False),
        (Shown(astray=True), False),  # a joint whose base model is not determined
    ],
)
def test_reasons_to_leave_a_name_out(shown: Shown, stays: bool) -> None:
    """A finding is rejected for a 5 % larger error, less than a fifth of its gain, or an unreliable joint."""
    result = validated(bench_with(spring=shown), SelectedEffect(SPRING, 1e-9, ()), held_out=False)
    assert bool(result.effects) is stays
    assert bool(result.changes) is not stays


def test_what_comes_and_goes_need_not_last_on_other_stretches() -> None:
    """The retained gain is ignored for effects in time, whose energy is in few stretches."""
    step = member_of("friction_step", 2)
    bench = bench_with()
    bench.shows[step.hypothesis.label] = Shown(kept=0.0)
    assert validated(bench, SelectedEffect(step, 1e-9, ()), held_out=False).effects == (step,)


def test_a_close_rival_that_helps_takes_the_place() -> None:
    """A rival that passes the validation takes place and p-value, with the remaining rivals, and a note names both."""
    rivals = ((STRIBECK, 2.0), (TILT, 5.0), (PRESLIDING, CLOSE_RIVAL_BIC + 1.0))
    bench = bench_with(spring=HARMS, stribeck=HARMS)
    result = validated(bench, SelectedEffect(SPRING, 1e-9, rivals), free=[FREE], p_values=[1e-4])
    assert result.effects == (TILT, FREE)
    assert result.p_values == (1e-9, 1e-4)
    (found,) = result.findings
    assert (found.effect, found.p_value, found.rivals) == (TILT, 1e-9, ())
    note = state_change(*result.changes)
    assert "spring of joint 2" in note
    assert "base_tilt" in note
    first = validated(bench_with(spring=HARMS), SelectedEffect(SPRING, 1e-9, rivals)).findings[0]
    assert first.effect is STRIBECK
    assert first.rivals == ((TILT, 3.0),)


@pytest.mark.parametrize("shown", [HARMS, IDLE, Shown(kept=0.1), Shown(rise=1.1)])
def test_a_rival_that_is_not_confirmed_takes_no_place(shown: Shown) -> None:
    """A rival that harms, or does not significantly help, does not replace a finding."""
    result = validated(
        bench_with(spring=HARMS, stribeck=shown), SelectedEffect(SPRING, 1e-9, ((STRIBECK, 1.0),)), held_out=False
    )
    assert (result.findings, result.effects, result.p_values) == ((), (), ())
    note = state_change(*result.changes)
    assert "rejected" in note


def test_a_rival_that_fits_far_worse_takes_no_place() -> None:
    """A rival beyond the BIC limit does not replace a finding."""
    bench = bench_with(spring=HARMS)
    assert validated(bench, SelectedEffect(SPRING, 1e-9, ((STRIBECK, CLOSE_RIVAL_BIC),))).effects == ()
    assert all(LABELS["stribeck"] not in asked for asked in bench.asked)


def test_the_surest_goes_first_and_others_are_measured_anew() -> None:
    """The clearest contradiction is rejected first; a finding that harms only beside it stays."""
    bench = bench_with(spring=HARMS)
    bench.beside[LABELS["stribeck"], LABELS["spring"]] = Shown(-0.002, -0.0005, 1.0)
    result = validated(bench, SelectedEffect(STRIBECK, 1e-9, ()), SelectedEffect(SPRING, 1e-5, ()))
    assert result.effects == (STRIBECK,)
    assert len(result.changes) == 1
    assert "spring" in state_change(result.changes[0])


def test_a_free_function_that_errs_is_reported_and_no_part_of_the_model() -> None:
    """A rejected free function is reported with p-value and gain, but not part of the model."""
    bench = bench_with(load=HARMS)
    result = validated(bench, SelectedEffect(SPRING, 1e-9, ()), free=[FREE, SWING], p_values=[1e-4, 1e-3])
    assert result.effects == (SPRING, SWING)
    assert result.p_values == (1e-9, 1e-3)
    ((member, p_value, gain),) = result.rejected_discrepancies
    assert (member, p_value, gain.ci95) == (FREE, 1e-4, (HARMS.low, HARMS.high))
    note = state_change(*result.changes)
    assert note.startswith("Part of the residual of joint 3 is unexplained")


def test_a_free_function_that_brings_nothing_beside_others_is_no_part_of_the_model() -> None:
    """A free function without a held-out gain is left out beside other findings, and kept alone."""
    slightly = Shown(-0.003, 0.001, 1.0)
    result = validated(bench_with(load=slightly), SelectedEffect(SPRING, 1e-9, ()), free=[FREE], p_values=[1e-4])
    assert result.effects == (SPRING,)
    assert [member for member, *_ in result.rejected_discrepancies] == [FREE]
    alone = validated(bench_with(load=slightly), free=[FREE], p_values=[1e-7])
    assert alone.effects == (FREE,)


def test_what_errs_on_all_joints_is_reported_of_the_whole_robot() -> None:
    """A rejected function of all joints is reported for the whole robot."""
    result = validated(bench_with(swinging=HARMS), free=[SWING], p_values=[1e-10])
    assert [member for member, _, _ in result.rejected_discrepancies] == [SWING]
    assert state_change(result.changes[0]).startswith("Part of the residual of the whole robot is unexplained")


def test_a_passing_effect_is_not_judged_on_other_logs() -> None:
    """A transient effect is validated on stretches left out, not on other logs."""
    found = SelectedEffect(PUSH, 1e-9, ((STRIBECK, 1.0),))
    assert validated(bench_with(external_contact=HARMS), found).effects == (PUSH,)
    assert validated(bench_with(external_contact=HARMS), found, held_out=False).effects == (STRIBECK,)
    # For the same reason it cannot replace another finding by other logs.
    bench = bench_with(stribeck=HARMS, external_contact=HARMS)
    assert validated(bench, SelectedEffect(STRIBECK, 1e-9, ((PUSH, 1.0),))).effects == ()


@pytest.mark.parametrize(("speaks", "stays"), [(-0.9 * CONTRADICTION_SHARE, True), (-1.1 * CONTRADICTION_SHARE, False)])
def test_unseen_data_speak_against_a_cause_by_a_share_of_its_gain(speaks: float, stays: bool) -> None:
    """A contradiction counts only beyond a fraction of the gain, because the base model has errors there, too."""
    bench = bench_with(spring=Shown(-0.004, -0.001, 1.02, speaks=speaks))
    assert (validated(bench, SelectedEffect(SPRING, 1e-9, ())).effects == (SPRING,)) is stays


@pytest.mark.parametrize(("speaks", "stays"), [(0.6, True), (MIN_RETAINED_GAIN - 0.1, False), (-0.5, False)])
def test_a_name_that_unseen_rows_speak_for_stays_whatever_base_parameters_do_there(speaks: float, stays: bool) -> None:
    """With enough held-out support a finding stays despite an error that is 17 % larger."""
    bench = bench_with(spring=Shown(-0.008, -0.0002, 1.17, speaks=speaks))
    assert bool(validated(bench, SelectedEffect(SPRING, 1e-9, ())).findings) is stays


def test_a_name_that_ruins_unseen_data_is_left_out_whatever_rows_say() -> None:
    """A finding that increases the error by more than 20 % is rejected despite support, unless its gain is positive."""
    ruins = Shown(low=-0.018, high=0.004, rise=1.23, speaks=0.46)
    assert validated(bench_with(spring=ruins), SelectedEffect(SPRING, 1e-9, ())).effects == ()
    for shown in (Shown(low=-0.004, high=0.001, rise=1.1, speaks=0.46), Shown(low=0.001, rise=1.23, speaks=0.46)):
        assert validated(bench_with(spring=shown), SelectedEffect(SPRING, 1e-9, ())).effects == (SPRING,)


def test_a_name_that_unseen_rows_plainly_speak_for_stays() -> None:
    """With strong support a finding stays, although it retains no gain on stretches left out."""
    plain = Shown(low=-0.003, high=0.001, rise=1.02, kept=-0.4, speaks=0.48)
    assert validated(bench_with(spring=plain), SelectedEffect(SPRING, 1e-9, ()), held_out=False).effects == (SPRING,)
    for shown in (Shown(low=-0.003, high=0.001, rise=1.02, kept=-0.4, speaks=0.25),):
        assert validated(bench_with(spring=shown), SelectedEffect(SPRING, 1e-9, ()), held_out=False).effects == ()


def test_what_was_undone_before_the_unseen_data_stays() -> None:
    """A payload change that is absent in the held-out data is kept, with a note; other effects are not."""
    payload = member_of("payload_change", None)
    bench = bench_with()
    bench.shows["payload_change"] = HARMS
    bench.without["payload_change"] = HELPS
    result = validated(bench, SelectedEffect(payload, 1e-9, ()))
    assert result.effects == (payload,)
    note = state_change(*result.changes)
    assert "absent from the held-out data" in note
    bench.without["payload_change"] = IDLE
    assert validated(bench, SelectedEffect(payload, 1e-9, ())).effects == ()
    # A spring is permanent.
    bench.shows["spring of joint 2"], bench.without["spring of joint 2"] = HARMS, HELPS
    assert validated(bench, SelectedEffect(SPRING, 1e-9, ())).effects == ()
