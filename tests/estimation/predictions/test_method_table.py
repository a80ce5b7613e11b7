import numpy as np
import pytest

from estimation.predictions.method_table import compare_methods
from robots.common.errors import InputError
from robots.common.records import plain


@pytest.mark.slow
def test_estimators_are_compared_on_unseen_data(arm, arm_log):
    """Each estimator gets a row with its error on a log that none has seen, the best first."""
    table = compare_methods(arm, [arm_log(), arm_log(1, 1)], methods=["ols", "wls", "huber"])
    assert {row.method for row in table.rows} == {"ols", "wls", "huber"}
    means = [row.unseen.mean() for row in table.rows]
    assert means == sorted(means)
    # Noise is 2 % of the torque; on an exciting log no estimator is much worse.
    assert all((row.unseen < 0.04).all() and row.determined > 0.8 and row.seconds > 0 for row in table.rows)
    assert len(table.summary().splitlines()) == 4
    assert list(table.to_frame().index) == [row.method for row in table.rows]


@pytest.mark.slow
def test_one_log_is_cut_in_two(arm, arm_log):
    """Of a single log, the last stretch is what no estimator sees."""
    table = compare_methods(arm, arm_log(), methods=["wls"])
    assert np.isfinite(table.rows[0].unseen).all()


def test_an_estimator_that_fails_says_why(arm, arm_log, monkeypatch):
    """A failure is a row with its reason, not the end of the comparison."""
    from estimation.predictions import method_table

    def fail(robot, logs, *, method, **options):
        raise InputError(f"{method} needs something else")

    monkeypatch.setattr(method_table, "identify", fail)
    table = compare_methods(arm, arm_log(), methods=["ols"])
    assert "ols needs something else" in table.summary()
    assert plain(table.rows)[0]["unseen"] is None


def test_unknown_methods_are_refused(arm, arm_log):
    """A misspelt estimator is named with what there is."""
    with pytest.raises(InputError, match="method 'wsl'; allowed: wls"):
        compare_methods(arm, arm_log(), methods=["wsl"])
