"""Windows hold a stated time of motion: rests make them longer, and the chunks of a stream do not matter."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.monitoring.windows.stream_windows import LONGEST_WINDOW, StreamWindows

STEP = 0.01


def rows_of(moves, rests, count):
    """Rows of one joint that moves back and forth for some seconds, and rests for some between."""
    t = STEP * np.arange(round(count * (moves + rests) / STEP))
    number, phase = np.divmod(t, moves + rests)
    share = np.minimum(phase / moves, 1.0)
    return np.column_stack([t, np.where(number % 2 == 0, share, 1.0 - share), np.zeros(len(t))])


def cut(rows, chunk):
    """Starts and ends of the windows, and whether the recording ends with them."""
    stream, found = StreamWindows(10.0, 0.2, 3, np.array([0.05])), []
    for k in range(0, len(rows), chunk):
        found += [edges for _, *edges in stream.add(rows[k : k + chunk])]
    return np.array(found + [edges for _, *edges in stream.end()])


def test_motion_without_rests_is_cut_every_ten_seconds():
    """A window of a motion that never stops lasts as long as is set."""
    t = STEP * np.arange(3200)
    windows = cut(np.column_stack([t, 0.1 * t, np.zeros(len(t))]), 10_000)
    assert windows[:3, :2] == pytest.approx(np.column_stack([[0, 10, 20], [10, 20, 30]]))


def test_rests_make_a_window_longer():
    """Moves of 1 s with rests of 2 s: 10 s of motion take 30 s, but for the look-back at each stop."""
    windows = cut(rows_of(1.0, 2.0, 40), 10_000)
    lengths = (windows[:, 1] - windows[:, 0])[:-1]
    assert len(lengths) >= 3
    assert ((lengths > 22.0) & (lengths <= 31.0)).all()


def test_a_robot_that_hardly_moves_still_ends_windows():
    """Long rests do not keep rows for ever."""
    windows = cut(rows_of(1.0, 60.0, 5), 10_000)
    assert windows[:-1, 1] - windows[:-1, 0] == pytest.approx(10.0 * LONGEST_WINDOW)


@pytest.mark.parametrize("chunk", [7, 100, 1111])
def test_chunks_do_not_matter(chunk):
    """The windows follow from the rows alone."""
    rows = rows_of(1.3, 0.7, 40)
    np.testing.assert_array_equal(cut(rows, chunk), cut(rows, 100_000))
