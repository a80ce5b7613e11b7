"""One clock for several logs of a controller."""

from __future__ import annotations

import pytest

from oed.controllers.recording.clock import ClockAnchor

END = ClockAnchor(t=100.0, unix=5000.0, offset=0.0)


def test_a_clock_that_went_on_is_kept() -> None:
    """Where the controller's clock went on, its stamps stay as they are, whatever this computer's clock says."""
    assert END.offset_of(130.0, 5030.0, "controller") == 0.0
    assert END.offset_of(130.0, 9999.0, "controller") == 0.0
    assert ClockAnchor(t=100.0, unix=5000.0, offset=70.0).offset_of(40.0, 5010.0, "controller") == 70.0


def test_a_clock_that_restarted_goes_on_after_the_pause() -> None:
    """A controller that restarted begins at zero: the pause between both logs is that of this computer's clock."""
    offset = END.offset_of(2.0, 5060.0, "controller")
    assert 2.0 + offset == pytest.approx(160.0)
    again = ClockAnchor(t=170.0, unix=5070.0, offset=offset)
    assert 20.0 + again.offset_of(20.0, 5080.0, "controller") == pytest.approx(178.0)
    # Even where this computer's clock was set back, times increase.
    assert 2.0 + END.offset_of(2.0, 4000.0, "controller") > 100.0


def test_another_clock_goes_on_after_the_pause() -> None:
    """Times of arrival follow those of the controller, whatever this computer's clock stands at."""
    assert 7000.0 + END.offset_of(7000.0, 5060.0, "arrival") == pytest.approx(160.0)
