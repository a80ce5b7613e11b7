"""What a notebook shows of robots, motions and logs."""

from __future__ import annotations

import numpy as np

from robots import load_robot
from robots.signals import Log


def test_robots_and_logs_show_themselves() -> None:
    """A robot shows its summary, a log its signals with their ranges; names cannot break the page."""
    assert "ur10" in load_robot("ur10")._repr_html_()
    t = np.arange(5) * 0.1
    log = Log(t=t, q=np.column_stack([t, -t]), tau=np.column_stack([2 * t, t]), name="<b>")
    html = log._repr_html_()
    assert "&lt;b&gt;" in html
    assert "0 to 0.4" in html
    assert "-0.4 to -0" in html
    assert "0 to 0.8" in html
