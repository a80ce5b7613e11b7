"""The number of rounds that an alternating fit is expected to take."""

from __future__ import annotations

import pytest

from estimation.thermal.campaign_fit import expected_rounds


def test_rounds_left_follow_from_the_rate() -> None:
    """Changes that fall tenfold each round, from 1 to 1e-4, take five rounds: the end is foreseen from the second."""
    changes = [1.0, 0.1, 0.01, 0.001, 0.99e-4]
    assert expected_rounds(changes[:1], 1e-4, 12) == 12
    assert [expected_rounds(changes[:k], 1e-4, 12) for k in (2, 3, 4, 5)] == [5, 5, 5, 5]


@pytest.mark.parametrize("changes", [[1.0, 2.0], [0.1, 0.1], [0.5, 0.499]])
def test_slow_changes_take_all_rounds(changes: list[float]) -> None:
    """Changes that hardly fall, or rise, leave all rounds."""
    assert expected_rounds(changes, 1e-4, 12) == 12
