import json

import numpy as np
import pytest

from oed.trajectories import KINDS, FourierSeries, PiecewisePolynomial, Segment, Sequence, Sinusoid, rest_basis
from robots.common.errors import InputError

PERIOD = 0.004


def _series() -> FourierSeries:
    free = np.random.default_rng(2).normal(size=(2, 9))
    return FourierSeries.from_coefficients(free @ rest_basis(5, 0.1).T, 0.1)


def _experiment() -> Sequence:
    series = _series()
    pose = series.sample([0.0]).q[0]
    return Sequence(
        segments=(
            Segment(kind="approach", trajectory=PiecewisePolynomial.hold(pose, 0.1)),
            Segment(kind="fourier", trajectory=series),
            Segment(kind="sinusoid", trajectory=Sinusoid(start=pose, joint=2, delta=1.0, stroke_duration=0.8), joint=2),
        ),
        period=PERIOD,
    )


def test_segments_follow_one_another():
    """At any time the sequence moves as the segment does that runs then, also for times out of order."""
    experiment = _experiment()
    assert experiment.duration == pytest.approx(0.1 + 10.0 + 1.6)
    t = np.array([11.0, 0.05, 3.0, 10.1])
    q = experiment.sample(t).q
    np.testing.assert_allclose(q[0], experiment.segments[2].trajectory.sample([0.9]).q[0], atol=1e-12)
    np.testing.assert_allclose(q[1], experiment.segments[0].trajectory.sample([0.05]).q[0], atol=1e-12)
    np.testing.assert_allclose(q[2], experiment.segments[1].trajectory.sample([2.9]).q[0], atol=1e-12)
    np.testing.assert_allclose(q[3], experiment.segments[2].trajectory.sample([0.0]).q[0], atol=1e-9)


def test_the_table_is_that_of_the_design_file():
    """The table has kind, start, end and joint of each segment, without gaps, and is JSON."""
    table = json.loads(json.dumps(_experiment().table()))
    assert [row["kind"] for row in table] == ["approach", "fourier", "sinusoid"]
    assert [row["joint"] for row in table] == [None, None, 2]
    assert all(list(row) == ["kind", "start", "end", "joint"] for row in table)
    assert [row["start"] for row in table[1:]] == [row["end"] for row in table[:-1]]
    assert table[-1]["end"] == pytest.approx(11.7)


def test_the_motion_is_sampled_at_the_sequence_s_period():
    """Without a period the motion has the sequence's own, and segment boundaries are samples of it."""
    experiment = _experiment()
    motion = experiment.motion()
    assert motion.period == pytest.approx(PERIOD)
    np.testing.assert_array_equal(motion.t[experiment.boundary_indices], experiment.boundaries)
    assert len(motion) == experiment.boundary_indices[-1] + 1


@pytest.mark.parametrize(
    ("second", "quantity"),
    [
        ([1e-8], "position"),
        ([0.0, 1e-6], "velocity"),
        ([0.0, 0.0, 1e-4], "acceleration"),
    ],
)
def test_a_jump_between_segments_is_refused(second, quantity):
    """A jump of position, velocity or acceleration is an error that names the quantity, the segments and the joint."""
    rest = PiecewisePolynomial.hold([0.0, 0.0], 0.4)
    coefficients = np.zeros((1, 2, 3))
    coefficients[0, 1, : len(second)] = second
    jump = PiecewisePolynomial(breakpoints=np.array([0.0, 0.4]), coefficients=coefficients)
    with pytest.raises(InputError, match=f"joint 2: the {quantity} jumps .* segments 1 .* and 2 ") as caught:
        Sequence(segments=(Segment(kind="move", trajectory=rest), Segment(kind="move", trajectory=jump)), period=PERIOD)
    assert caught.value.joint == 2


def test_segments_must_fit_the_period_and_each_other():
    """Durations off the period, other numbers of joints, no segments and unknown kinds are errors."""
    two, one = PiecewisePolynomial.hold([0.0, 0.0], 0.4), PiecewisePolynomial.hold([0.0], 0.4)
    odd = PiecewisePolynomial.hold([0.0, 0.0], 0.401)
    for trajectories, message in (([two, one], "joints"), ([odd], "multiple"), ([], "without segments")):
        segments = tuple(Segment(kind="move", trajectory=item) for item in trajectories)
        with pytest.raises(InputError, match=message):
            Sequence(segments=segments, period=PERIOD)
    with pytest.raises(InputError, match="dance"):
        Segment(kind="dance", trajectory=two)


def test_every_kind_of_the_design_file_is_known():
    """The kinds are those of the file's contract."""
    assert set(KINDS) == {"approach", "fourier", "excitation", "sinusoid", "friction", "warm_up", "move", "pose"}
