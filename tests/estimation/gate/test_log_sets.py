"""Logs that are fitted together: some rest, and some have the same rows."""

from dataclasses import replace

import numpy as np
import pytest

from estimation import identify
from estimation.gate import check_logs
from robots.common.errors import InputError
from robots.signals import Log


def rest(good: Log, jitter: float, step: float = 0.0, rows: int = 1500) -> Log:
    """An arm that holds its first pose: encoder noise [rad], rounded to steps [rad], and noise of the torque."""
    rng = np.random.default_rng(0)
    q = good.q[0] + jitter * rng.normal(size=(rows, good.n))
    q = step * np.round(q / step) if step else q
    return Log(t=good.t[:rows], q=q, tau=good.tau[0] + 0.05 * rng.normal(size=q.shape), name="rest")


@pytest.mark.slow
@pytest.mark.parametrize(("jitter", "step"), [(0.0, 0.0), (2e-5, 5e-5), (1e-5, 0.0)])
def test_a_log_that_rests_is_left_out(er3a, good, jitter, step):
    """Beside a log that moves, one that rests is a warning; alone it is refused, with the reason."""
    moving, resting = good(), rest(good(), jitter, step)
    used, unused = check_logs(er3a, [moving, resting])
    assert used.findings == ()
    assert not unused.refused
    assert "this log is left out" in unused.findings[0].text
    assert unused.usable(resting) == ()
    with pytest.raises(InputError, match="no joint moves"):
        check_logs(er3a, [resting])


@pytest.mark.slow
def test_a_fit_is_the_same_without_the_rest(er3a, good):
    """The parameters are those of the log that moves, and the model names no other."""
    moving = good()
    options = {"friction": "coulomb-viscous", "position": False}
    alone = identify(er3a, moving, **options)
    both = identify(er3a, [rest(moving, 1e-5), moving], **options)
    np.testing.assert_array_equal(both.model.values, alone.model.values)
    assert len(both.model.provenance["logs"]) == 1
    assert len(both.gates) == 2


def test_a_fault_still_refuses_all(er3a, good):
    """A rest beside a log with a fault does not hide the fault."""
    wrong = replace(good(), q=np.rad2deg(good().q))
    with pytest.raises(InputError, match="degrees"):
        check_logs(er3a, [rest(good(), 0.0), wrong])


@pytest.mark.slow
def test_rows_that_are_given_twice_are_named(er3a, good):
    """A copy under another name, and an excerpt with times of its own, are warnings; another motion is not."""
    log = replace(good(), name="first")
    excerpt = replace(log.rows(slice(0, 4000)), name="part")
    excerpt = replace(excerpt, t=excerpt.t + 100.0)
    reports = check_logs(er3a, [log, replace(log, name="copy"), excerpt, good(2)])
    named = [[finding.name for finding in report.findings] for report in reports]
    assert named == [[], ["same_rows"], ["same_rows"], []]
    assert "100 % of its rows are those of first" in reports[1].findings[0].text
