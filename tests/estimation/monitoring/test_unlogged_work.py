"""Days with a minute of logged motion after each pause of unlogged work, on an arm with different gears."""

import dataclasses

import numpy as np
import pytest

from estimation.monitoring import Monitor
from estimation.thermal import ThermalTorqueModel
from robots.thermal import FirstOrder

pytestmark = pytest.mark.slow

# Time constants [min] and the friction that is lost at most.
MINUTES, FALL = np.array([6.0, 30.0, 12.0, 20.0, 8.0, 25.0]), 0.35


@pytest.fixture(scope="module")
def warming(arm, baseline):
    """The arm's baseline with a thermal model per joint."""
    power = (arm.friction * arm.v).mean(axis=0)
    # f = 1 / (1 + |alpha| W / K) in the steady state.
    K = 0.01 * power / (1.0 / (1.0 - FALL) - 1.0)
    models = tuple(
        FirstOrder(alpha=-0.01, beta=1.0, ambient=20.0, K=float(k), C=float(k * 60.0 * m))
        for k, m in zip(K, MINUTES, strict=True)
    )
    return dataclasses.replace(baseline, thermal=ThermalTorqueModel(model=baseline.model, thermal=models))


def day_logs(arm, warming, seed, damage=None):
    """Three days of five logs. In each pause of 25 min a joint works as in the logs, give or take 35 %."""
    rng, models = np.random.default_rng(seed), warming.thermal.thermal
    power = (arm.friction * arm.v).mean(axis=0)
    alpha, K, C = (np.array([getattr(m, name) for m in models]) for name in ("alpha", "K", "C"))

    def heated(T, share, step):
        return T + step * (power * share * (1.0 + alpha * (T - 20.0)) * scale - K * (T - 20.0)) / C

    number = 0
    for day in range(3):
        clock, T = 86400.0 * day, np.full(6, 20.0)
        for k in range(5):
            number += 1
            scale = np.ones(6)
            if damage is not None and number > 5:
                scale[damage[0] - 1] += damage[1]
            if k:
                share = np.clip(1.0 + 0.35 * rng.normal(size=6), 0.0, None)
                for _ in range(300):
                    T = heated(T, share, 5.0)
                clock += 1500.0
            path = [T]
            for _ in range(60):
                path.append(heated(path[-1], np.ones(6), 1.0))
            T, table = path[-1], scale * (1.0 + alpha * (np.array(path) - 20.0))

            def factor(t, start=clock, table=table):
                return np.stack([np.interp(t - start, np.arange(61.0), column) for column in table.T], axis=1)

            yield arm.log(clock, factor=factor, seed=seed, name=f"day {day + 1}, log {k + 1}")
            clock += 60.0


def findings(arm, warming, seed, **options):
    monitor = Monitor(warming)
    for log in day_logs(arm, warming, seed, **options):
        monitor.begin(log.name)
        monitor.update(log.t, log.q, log.tau)
    monitor.finish()
    return [f for f in monitor.findings if f.severity != "info"]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_unlogged_work_is_no_damage(arm, warming, seed):
    """A healthy robot that works unseen is not red. Without an allowance for it each of these three has 9 findings."""
    assert [f.sentence(0.0) for f in findings(arm, warming, seed) if f.severity == "act"] == []


@pytest.mark.parametrize("joint", [2, 5])
def test_damage_shows_in_spite_of_unlogged_work(arm, warming, joint):
    """25 % more friction from the second day on is found at its joint, and its interval holds the size."""
    found = findings(arm, warming, 4, damage=(joint, 0.25))
    assert [(f.kind, f.joint) for f in found] == [("damage", joint)]
    assert found[0].low <= 25.0 <= found[0].high
    # Its date: the night before the second day.
    assert found[0].latest <= 86400.0 + 20.0
