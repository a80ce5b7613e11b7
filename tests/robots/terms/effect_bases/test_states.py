"""Effects with a memory, against integrators of scipy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from robots.terms.effect_bases.states import best_apart, bristle, change_times
from robots.terms.effects import EFFECTS
from robots.terms.effects.thermal_friction import HOUSING_TIME_RATIO, heat
from robots.terms.situations.situation import situation


@pytest.mark.slow
@pytest.mark.parametrize("travel", [0.02, 2e-4])
def test_the_bristle_follows_dahls_equation(travel):
    """The bristle's deflection is that of Dahl's equation through reversals, even within a sample's travel."""
    T = 4.0
    t = np.linspace(0, T, 1001)

    def speed(t):
        return 0.05 * 2 * np.pi * np.cos(2 * np.pi * t) + 0.03 * 6.4 * np.pi * np.cos(6.4 * np.pi * t)

    q = 0.05 * np.sin(2 * np.pi * t) + 0.03 * np.sin(6.4 * np.pi * t)
    rate = lambda t, z: (speed(t) - abs(speed(t)) * z) / travel  # noqa: E731
    exact = solve_ivp(rate, (0, T), [1.0], t_eval=t, rtol=1e-8, atol=1e-9, max_step=2e-3).y[0]
    got = bristle(t, q, speed(t), (slice(0, len(q)),), travel)
    # Where it turns is known to the third order of 4 ms at 20 rad/s2: some 1e-6 rad, of the travel.
    np.testing.assert_allclose(got, exact, atol=2e-3 if travel > 1e-3 else 3e-2)


def test_a_joint_that_rests_keeps_its_bristle():
    """At rest the bristle stays as it is, and a log at rest begins with an unstrained one."""
    t = 0.01 * np.arange(120)
    dq = np.concatenate([[0.0], np.full(49, 0.2), np.zeros(30), np.full(40, -0.1)])
    q = np.concatenate([[0.0], np.cumsum(dq[1:]) * 0.01])
    z = bristle(t, q, dq, (slice(0, len(q)),), 0.01)
    assert z[0] == 0.0
    np.testing.assert_allclose(z[49:80], z[49])
    assert z[-1] == pytest.approx(-1.0, abs=0.04)  # 2 e^-4 of a whole turn-round
    assert not bristle(t, q, 0 * dq, (slice(0, len(q)),), 0.01).any()


@pytest.mark.parametrize("time_constant", [5.0, 60.0])
def test_heat_is_kept_and_lost(seen, time_constant):
    """The heat follows dx/dt = P - x / T, through an uneven log and the pause between two."""
    random = np.random.default_rng(0)
    even = 0.004 * np.arange(1500)
    uneven = 20 + np.cumsum(random.uniform(0.002, 0.006, 1200))
    now = seen(times=np.concatenate([even, uneven]), starts=(0, 1500))
    power = np.maximum(now.friction[:, 1] * now.dq[:, 1], 0) / 1000

    def integrate(t, p, start, longest=0.05):
        rate = lambda s, x: np.interp(s, t, p) - x / time_constant  # noqa: E731
        return solve_ivp(rate, (t[0], t[-1]), [start], t_eval=t, rtol=1e-8, max_step=longest).y[0]

    first = integrate(even, power[:1500], 0.0)
    cooled = first[-1] * np.exp(-(uneven[0] - even[-1]) / time_constant)
    second = integrate(uneven, power[1500:], cooled)
    got = heat(now, 2, time_constant)
    # The uneven log is interpolated to an even one, by its own spacing.
    np.testing.assert_allclose(got, np.concatenate([first, second]), atol=1e-3 * first.max())


@pytest.mark.slow
def test_a_warm_housing_keeps_heat_through_a_pause(seen):
    """Gear and housing of two heat nodes: their two exponentials give the gear's heat, in a log and after a pause."""
    even = 0.02 * np.arange(3000)
    now = seen(times=np.concatenate([even, 200 + even]), starts=(0, 3000))
    power = np.maximum(now.friction[:, 1] * now.dq[:, 1], 0) / 1000
    # Two nodes whose eigenvalues are -1 / T and -1 / (c T): y' = p - a y + b z, z' = d (y - z).
    fast, weight = 20.0, 1.5
    slow = HOUSING_TIME_RATIO * fast
    share = weight / HOUSING_TIME_RATIO
    # Laplace: x = p (1 / (s + 1/T) + share / (s + 1/(c T))) = p (1 + share) (s + zero) / ((s + 1/T) (s + 1/(c T))).
    zero = (1 / slow + share / fast) / (1 + share)

    def integrate(t, p, start, longest=0.05):
        def rate(s, x):
            return [x[1], -x[0] / (fast * slow) - x[1] * (1 / fast + 1 / slow) + np.interp(s, t, p)]

        return solve_ivp(rate, (t[0], t[-1]), start, t_eval=t, rtol=1e-9, atol=1e-14, max_step=longest).y

    first = integrate(even, power[:3000], [0.0, 0.0])
    cooled = integrate(np.linspace(even[-1], 200.0, 200), np.zeros(200), first[:, -1], np.inf)[:, -1]
    both = np.hstack([first, integrate(200 + even, power[3000:], cooled)])
    exact = (1 + share) * (both[1] + zero * both[0])
    effect = EFFECTS["thermal_friction"]
    X = effect.columns(now, 2, (fast, weight, 0.0))
    np.testing.assert_allclose(X[:, 1, 1], -exact * now.dq[:, 1], atol=1e-3 * np.abs(X[:, 1, 1]).max())
    # A kilojoule takes ever less; at first as much.
    faded = effect.columns(now, 2, (fast, weight, 2.0))
    wanted = -(1 - np.exp(-2.0 * exact)) / 2.0 * now.dq[:, 1]
    np.testing.assert_allclose(faded[:, 1, 1], wanted, atol=1e-3 * np.abs(wanted).max())


def test_change_times_cover_the_data_and_its_pauses(seen):
    """A change is looked for all through the data, and in each pause between logs."""
    t = np.concatenate([0.004 * np.arange(700), 60 + 0.004 * np.arange(800)])
    now = seen(times=t, starts=(0, 700))
    times = np.array(change_times(now))
    assert 60.0 in times
    assert times.min() > 0
    assert times.max() < t[-1]
    samples = np.searchsorted(t, times)
    assert np.diff(np.concatenate([[0], samples, [len(t)]])).max() <= 1500 / 24 + 1


def test_a_friction_step_begins_at_its_time(seen):
    """A step leaves what was before it alone."""
    now = seen()
    X = EFFECTS["friction_step"].columns(now, 2, (2.5,))
    before = now.t < 2.5
    assert not X[before].any()
    np.testing.assert_array_equal(X[~before, 1, 1], now.dq[~before, 1])


def test_flat_tops_are_flagged(seen):
    """Samples at a torque that is cut off are flagged, and noise that reaches its largest once is not."""
    now = seen()
    clipping = EFFECTS["current_clipping"]
    torque = now.torque + np.random.default_rng(0).normal(size=now.torque.shape)
    assert not clipping.gate(now, 2, torque).any()
    level = float(np.quantile(np.abs(torque[:, 1]), 0.9))
    cut = torque.copy()
    cut[:, 1] = np.clip(cut[:, 1], -level, level)
    flagged = clipping.gate(now, 2, cut)
    assert not flagged[:, [0, 2, 3]].any()
    assert not flagged[np.abs(torque[:, 1]) < 0.999 * level, 1].any()
    assert flagged[:, 1].sum() > 0.7 * np.sum(np.abs(torque[:, 1]) > level)  # all but tops of one or two samples


def test_a_few_flat_tops_are_no_chance_where_torque_is_reported_finely(seen):
    """Two peaks that are cut off are; the same torque in coarse steps stays at its top as it does elsewhere."""
    t = 0.004 * np.arange(5000)
    now, clipping = seen(times=t), EFFECTS["current_clipping"]
    torque = np.zeros(now.torque.shape)
    between = (np.pi / 2 + 2 * np.pi * 12.5) / 8.0
    size = 6.0 * np.exp(-0.1 * (t - between) ** 2)
    torque[:, 1] = size * np.sin(8.0 * t) + 0.01 * np.random.default_rng(0).normal(size=len(t))

    def chance(measured):
        """Of torque that is known but for what is cut off."""
        return clipping.chance(replace(now, beyond=torque - now.torque), 2, measured)

    assert chance(torque) > 1e-4
    cut = np.minimum(torque, 0.99 * torque.max())
    cut[:, 1] *= np.where(cut[:, 1] < 0, 0.9, 1.0)
    top = cut == cut.max()
    assert 6 <= np.sum(top) < 30
    assert chance(cut) < 1e-6
    # A model that does not come near the tops does not know the torque that they cut.
    assert clipping.chance(replace(now, beyond=0.5 * torque - now.torque), 2, cut) == 1.0
    flagged = clipping.gate(now, 2, cut)
    assert 6 <= flagged.sum() <= top.sum()
    assert top[flagged].all()
    coarse = np.round(torque / 0.2) * 0.2
    assert chance(coarse) > 1e-3
    assert not clipping.gate(now, 2, np.round(torque / 0.05) * 0.05).any()
    assert chance(np.zeros(torque.shape)) == 1.0


@pytest.mark.parametrize(("delay", "sharp"), [(0.003, 0.2), (0.008, 2e-3), (0.0003, 2e-3), (-0.001, 2e-3)])
def test_a_delayed_torque_is_the_one_before(seen, motion, delay, sharp):
    """A delay changes the torque as taking it a moment earlier does, also where friction turns round in a sample."""
    now = seen(velocity_scale=sharp)
    X = EFFECTS["time_delay"].columns(now, None, (delay,))[:, :, 0]
    early = seen(velocity_scale=sharp, times=now.t - delay)
    change = early.torque - now.torque
    error = delay * X - change
    assert np.sqrt(np.mean(error[2:-3] ** 2)) < 0.01 * np.sqrt(np.mean(change**2))


def test_what_other_effects_do_is_late_as_well(seen):
    """A torque beside the base model's is the one of a moment before, too; none of it leaves the column as it was."""
    now = seen(velocity_scale=2e-3)
    delay, rate = 0.006, np.array([2.0, 3.0, 5.0, 7.0])
    plain = EFFECTS["time_delay"].columns(now, None, (delay,))[:, :, 0]
    both = replace(now, beyond=np.sin(rate * now.t[:, None]))
    late = EFFECTS["time_delay"].columns(both, None, (delay,))[:, :, 0]
    change = np.sin(rate * (now.t[:, None] - delay)) - both.beyond
    # Straight lines between the samples, which are 4 ms apart: what jumps must not swing.
    np.testing.assert_allclose(delay * (late - plain)[5:], change[5:], atol=(0.004 * rate.max()) ** 2 / 8 * 1.01)
    # What is kept for all joints is kept of each situation.
    shift = EFFECTS["time_delay"].shapes[0].grid[-1]
    kept = [EFFECTS["time_delay"].columns(state, None, (shift,)) for state in (now, both, now)]
    assert np.array_equal(kept[0], kept[2])
    assert not np.array_equal(kept[0], kept[1])


def test_friction_of_a_joint_that_breaks_loose_is_late_as_well(seen):
    """A joint that creeps and breaks loose at 8 rad/s2 had crept a moment before: it had not turned round."""
    still = seen(velocity_scale=2e-3)
    friction = np.where([c.friction for c in still.model.columns], still.parameters, 0.0)
    loose, delay = float(still.t[700]) + 0.001, 0.005

    def at(times):
        after = np.maximum(times - loose, 0.0)[:, None] * np.ones(4)
        q = 1e-3 * times[:, None] + 4.0 * after**2
        return situation(still.model, friction, times, q, 1e-3 + 8.0 * after, 8.0 * (after > 0))

    now, early = at(still.t), at(still.t - delay)
    change = (early.torque - now.torque)[695:715]
    columns = delay * EFFECTS["time_delay"].columns(now, None, (delay,))[695:715, :, 0]
    assert np.all(np.abs(change).max(axis=0) > 0.4 * np.abs(now.friction).min(axis=0).max())
    # Between the two samples about the jump the velocity is known to some hundredths of its change.
    assert np.all(np.abs(columns - change).max(axis=0) < 0.25 * np.abs(change).max(axis=0))


def test_a_joint_at_rest_is_not_late(seen):
    """Velocities that are rounding, below the smallest normal number even, make no warning and no torque."""
    still = seen(velocity_scale=2e-3)
    zero = np.zeros((40, 4))
    dq = 5e-324 * np.arange(40.0)[:, None] * np.ones(4)
    now = situation(still.model, still.parameters, 0.004 * np.arange(40), zero, dq, zero)
    X = EFFECTS["time_delay"].columns(now, None, (0.003,))
    np.testing.assert_allclose(X, 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["time_delay", "current_lag"])
@pytest.mark.parametrize("shift", [1e-3, 1.5e-3])
def test_what_is_late_beside_other_effects_is_theirs(seen, name, shift):
    """A situation beside one torque and then beside another gives the second's columns, on the grid and off it."""
    now, random = seen(3, seed=4), np.random.default_rng(4)
    first, second = random.normal(size=(2, *now.q.shape)).cumsum(axis=1)
    effect, joint = EFFECTS[name], None if name == "time_delay" else 1
    alone = effect.columns(now, joint, (shift,))
    effect.columns(now.beside(first), joint, (shift,))
    beside = effect.columns(now.beside(second), joint, (shift,))
    before = np.interp(now.t - shift, now.t, second[:, 0])
    expected = alone[:, 0, 0] + (before - second[:, 0]) / shift
    np.testing.assert_allclose(beside[:, 0, 0], expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["time_delay", "current_lag"])
@pytest.mark.parametrize("shift", [-0.008, 0.0, 0.0002, 0.004])
def test_a_delay_is_near_that_of_the_reversals(name, shift, random_robot):
    """A quotient over 8 ms is no rate: it measures a delay of 2 ms by the torque's second derivative as well."""
    ((low, high),) = EFFECTS[name].ranges(random_robot(3, 4), 1, (shift,))
    assert low < high
    late = [0.0002 * k for k in range(-100, 101)]
    allowed = [d for d in late if low <= d <= high]
    if name == "current_lag":
        assert all(d >= 0 for d in allowed)
    assert all(abs(shift) / 3 < abs(d) < 3 * abs(shift) for d in allowed if d)
    assert shift in [pytest.approx(d) for d in allowed] or (name, shift) == ("current_lag", -0.008)


def test_a_zero_that_wanders_is_followed(seen):
    """Drifts of each stretch add up to straight lines between knots, constant after the last, and after the data."""
    now = seen()
    duration = float(now.t[-1])
    X = EFFECTS["torque_sensor_drift"].local(now, 1, (0.0, duration / 4, duration))
    steps = np.array([1.0, -2.0, 0.5, 3.0, *[9.0] * 12])
    knots = np.linspace(0, duration, 5)
    np.testing.assert_allclose(X @ steps, np.interp(now.t, knots, [0, 1, -1, -0.5, 2.5]), atol=1e-9)
    ended = EFFECTS["torque_sensor_drift"].local(now, 1, (0.0, duration / 4, duration / 8))
    np.testing.assert_allclose(ended @ steps, np.interp(now.t, [0, duration / 8], [0, 0.5]), atol=1e-9)


@pytest.mark.parametrize(("share", "ramps"), [(0.4, 3), (0.6, 4)])
def test_a_zero_that_wanders_stays_in_a_stretch_that_is_hardly_begun(seen, share, ramps):
    """Three stretches and a bit: the bit is a ramp if the data have half of it; else they said anything of its size."""
    now = seen()
    duration = float(now.t[-1])
    stretch = duration / (3 + share)
    X = EFFECTS["torque_sensor_drift"].local(now, 1, (0.0, stretch, duration))
    assert X.any(axis=0).sum() == ramps
    np.testing.assert_allclose(X[:, :ramps], np.clip(now.t[:, None] / stretch - np.arange(ramps), 0.0, 1.0))


def test_the_documentation_lists_every_effect():
    """The page of effects names each effect of the catalogue."""
    text = (Path(__file__).parents[4] / "docs" / "effects.md").read_text()
    missing = [name for name in EFFECTS if f"`{name}`" not in text]
    assert not missing


@pytest.mark.parametrize("name", ["thermal_friction", "torque_constant_heat", "load_heat"])
def test_heat_has_forms_of_all_time_constants_that_a_log_may_show(seen, name):
    """Two minutes and a half show time constants up to three times that: unseen data may choose of those."""
    now, effect = seen(2, times=0.1 * np.arange(1501)), EFFECTS[name]
    reported = list(dict.fromkeys(shape[0] for shape in effect.forms(now, 2)))
    assert reported == [value for value in effect.shapes[0].grid if value <= 450.0]
    assert len(reported) > 1


def test_the_best_places_are_apart():
    """The best first; neighbours of one that is chosen are not, nor what has no score."""
    scores = np.array([1.0, 9.0, 10.0, 8.0, 7.0, np.nan, 3.0])
    assert best_apart(scores, 3, 1) == [2, 4, 6]
    assert best_apart(scores, 9, 0) == [2, 1, 3, 4, 6, 0]
