"""The Poisson interval of a rate of false alarms, and what is said of it."""

from __future__ import annotations

import pytest

from estimation.external_forces.thresholds.rate_checks import RateCheck


@pytest.mark.parametrize(
    ("alarms", "interval"),
    [(0, (0.0, 3.689)), (1, (0.0253, 5.572)), (10, (4.795, 18.390))],
)
def test_interval_is_the_published_one(alarms, interval):
    """The exact 95 % limits of Garwood (1936), of one hour."""
    assert RateCheck(alarms=alarms, hours=1.0, rate=1.0).interval == pytest.approx(interval, rel=1e-3)


@pytest.mark.parametrize(
    ("alarms", "hours", "words"),
    [
        (0, 4.0, "is confirmed by"),
        (0, 0.05, "is not confirmed by the healthy logs: 0 false alarms in 180 s of new motion, 0 (0 to 74) per hour"),
        (1, 2.0, "1 false alarm in 2 h"),
        (20, 1.0, "is contradicted by"),
        (0, 0.0, "is not confirmed: the healthy motion repeats"),
    ],
)
def test_verdict_follows_from_the_interval(alarms, hours, words):
    """Confirmed below the stated rate, contradicted above it, else neither."""
    assert words in RateCheck(alarms=alarms, hours=hours, rate=1.0).text()


def test_plain_data_reads_back():
    """What is written is read; no time has no upper limit."""
    check = RateCheck(alarms=2, hours=0.0, rate=1.0)
    assert RateCheck.from_dict(check.to_dict()) == check
    assert check.summary()["interval95"] == [0.0, None]
