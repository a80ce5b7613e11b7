"""Standard errors of logs that repeat one motion."""

from __future__ import annotations

import pytest

from estimation import identify
from estimation.identifications import fit
from estimation.regressions.preparation import Prepared


@pytest.mark.slow
def test_the_covariance_knows_the_period(arm, arm_log, monkeypatch) -> None:
    """The period of a log's motion reaches its covariance, so that what repeats counts once."""
    seen, plain = [], fit.with_repetitions

    def listen(covariance, parts, played, *rest):
        seen.append([(len(log.q), log.period) for log in played])
        return plain(covariance, parts, played, *rest)

    monkeypatch.setattr(fit, "with_repetitions", listen)
    monkeypatch.setattr(Prepared, "period", 4.0)
    identify(arm, arm_log())
    assert seen
    assert all(period == 4.0 and rows > 100 for logs in seen for rows, period in logs)
