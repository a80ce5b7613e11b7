"""Two drives that run through each other: the same torque whichever way the description counts an axis."""

from __future__ import annotations

import numpy as np
import pytest

from robots.terms.effects import EFFECTS, situation

COUPLING = EFFECTS["joint_coupling"]
VALUES = np.array([0.05, 0.7, 0.4, 1.2])


@pytest.mark.slow
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_seal_between_two_drives_brakes_how_they_turn_against_each_other(seen, way):
    """Power lost is F |dq_j + w dq_k|, whichever joint feels it, and torque is its slope along each velocity."""
    now = seen(5, seed=4)
    tau = COUPLING.columns(now, 5, (way,)) @ [0.0, 0.0, 0.0, 1.2]
    both = now.dq[:, 3] + way * now.dq[:, 4]
    sure = np.abs(both) > 0.05
    lost = np.sum(tau * now.dq, axis=1)
    assert lost[sure] == pytest.approx(1.2 * np.abs(both[sure]), rel=1e-6)
    assert not tau[:, :3].any()


@pytest.mark.slow
def test_an_axis_counted_the_other_way_gives_the_same_machine(seen):
    """Joint 5 counted backwards: its torque changes sign, and so do what its motion costs and the way."""
    now = seen(5, seed=4)
    turned = np.array([1.0, 1.0, 1.0, 1.0, -1.0])
    back = situation(now.model, now.model.nominal, now.t, now.q * turned, now.dq * turned, now.ddq * turned)
    tau = COUPLING.columns(now, 5, (1.0,)) @ VALUES
    again = COUPLING.columns(back, 5, (-1.0,)) @ (VALUES * [-1.0, -1.0, -1.0, 1.0])
    assert again == pytest.approx(tau * turned, abs=1e-9 * np.abs(tau).max())


def test_both_ways_are_looked_for(seen):
    """The scan tries them, and so does every search of one of them: no parameter is paid for."""
    now = seen(5, seed=4)
    assert set(COUPLING.grid(now, 5)) == {(1.0,), (-1.0,)}
    assert set(COUPLING.likely(now, 5, (1.0,), VALUES)) == {(1.0,), (-1.0,)}
    assert COUPLING.bounds(now, 5)[0][0] == COUPLING.bounds(now, 5)[0][1]
