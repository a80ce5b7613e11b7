import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.signals import Log, Motion

FIELDS = ("t", "q", "dq", "ddq")


def motion(rows=5, joints=3, **changes):
    rng = np.random.default_rng(1)
    values = {"t": 0.004 * np.arange(rows), **{name: rng.normal(size=(rows, joints)) for name in FIELDS[1:]}}
    return Motion(**{**values, **changes})


def log(rows=5, joints=3, **changes):
    rng = np.random.default_rng(2)
    per_joint = {name: rng.normal(size=(rows, joints)) for name in ("q", "tau", "current", "dq", "ddq", "qlink")}
    values = {
        "t": 0.004 * np.arange(rows),
        **per_joint,
        "temperature": 20.0 + rng.normal(size=(rows, joints)),
        "ambient": np.full(rows, 21.0),
        "segment": np.arange(rows),
        "cycle": np.ones(rows, int),
        "name": "run",
        "metadata": {"robot": "er3a"},
    }
    return Log(**{**values, **changes})


def refused(make, **changes):
    with pytest.raises(InputError) as caught:
        make(**changes)
    return caught.value


def spoil(array, row, joint, value):
    array = np.array(array, dtype=float)
    array[(row, joint) if array.ndim == 2 else row] = value
    return array


@pytest.mark.parametrize("make", [motion, log])
def test_arrays_are_private_read_only_copies(make):
    """Arrays are contiguous float64 copies that nobody can change."""
    given = np.asfortranarray(np.arange(15).reshape(5, 3))
    made = make(q=given)
    assert made.q.dtype == np.float64
    assert made.q.flags.c_contiguous
    given[0, 0] = 99
    assert made.q[0, 0] == 0.0
    for name in ("t", "q", "dq"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(made, name)[0] = 1.0
    with pytest.raises(FrozenInstanceError):
        made.t = given


@pytest.mark.parametrize("make", [motion, log])
def test_copies_by_pickle_stay_read_only(make):
    """A signal that crossed a process border is equal and still cannot be changed."""
    made = make()
    copy = pickle.loads(pickle.dumps(made))
    np.testing.assert_array_equal(copy.q, made.q)
    assert not copy.q.flags.writeable


@pytest.mark.parametrize("make", [motion, log])
def test_sizes_and_times(make):
    """A signal knows its samples, joints, duration and period."""
    made = make()
    assert (len(made), made.n) == (5, 3)
    assert made.duration == pytest.approx(0.016, rel=1e-15)
    assert made.period == pytest.approx(0.004, rel=1e-15)


@pytest.mark.parametrize(
    ("t", "period"),
    [
        (0.25 * np.arange(4), 0.25),
        (0.25 * np.arange(4) * (1 + 1e-12), 0.25),
        (np.array([0.0, 1.0, 2.0 + 0.9e-6, 3.0]), 1.0),
        (np.array([0.0, 1.0, 2.0 + 1.2e-6, 3.0]), None),
        (np.array([0.0, 1.0, 3.0]), None),
        (1.7e9 + 0.004 * np.arange(1000), 0.004),
        (1.7e9 + np.array([0.0, 0.004, 0.009]), None),
        (np.array([3.0]), None),
    ],
)
def test_period_tolerates_a_jitter_of_a_millionth(t, period):
    """Steps that differ by more than a millionth give no period; rounding of times far from zero is no jitter."""
    found = motion(rows=len(t), t=t).period
    # The mean step of times around 1.7e9 carries their rounding of 2.4e-7 s over 999 steps.
    assert found == (None if period is None else pytest.approx(period, rel=1e-6))


@pytest.mark.parametrize("make", [motion, log])
@pytest.mark.parametrize("name", ["q", "dq", "ddq"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_value_that_is_not_finite_is_refused_with_place(make, name, value):
    """The message names the field, the joint, the sample, and how many follow."""
    bad = spoil(spoil(getattr(make(), name), 3, 1, value), 4, 1, value)
    error = refused(make, **{name: bad})
    assert (error.column, error.joint, error.row) == (name, 2, 4)
    assert f"{value}" in error.problem
    assert "first of 2" in error.problem


@pytest.mark.parametrize("name", ["tau", "current", "qlink"])
def test_optional_signal_of_a_log_is_finite_if_it_is_there(name):
    """NaN in torque or current is refused, and so is a link encoder that is silent at times."""
    error = refused(log, **{name: spoil(getattr(log(), name), 0, 2, np.nan)})
    assert (error.column, error.joint, error.row) == (name, 3, 1)


def test_a_joint_may_have_no_link_encoder():
    """NaN throughout stands for a joint without one."""
    qlink = log().qlink.copy()
    qlink[:, 1] = np.nan
    assert np.isnan(log(qlink=qlink).qlink[:, 1]).all()


@pytest.mark.parametrize("name", ["temperature", "ambient"])
def test_silent_temperature_sensor_is_accepted(name):
    """NaN stands for a silent sensor; an infinite temperature is refused."""
    made = log(**{name: spoil(getattr(log(), name), 2, 0, np.nan)})
    assert np.isnan(getattr(made, name)).sum() == 1
    error = refused(log, **{name: spoil(getattr(log(), name), 2, 0, np.inf)})
    assert (error.column, error.row) == (name, 3)


def test_times_are_compared_not_subtracted() -> None:
    """Of times at either end of what a number holds the difference overflows; they increase all the same."""
    times = np.array([-1.7e308, 1.7e308])
    np.testing.assert_array_equal(Log(times, np.zeros((2, 1)), tau=np.zeros((2, 1))).t, times)


@pytest.mark.parametrize("make", [motion, log])
@pytest.mark.parametrize(("last", "word"), [(0.012, "repeats"), (0.001, "backward")])
def test_time_increases(make, last, word):
    """A repeated or backward time is refused with its sample and both values."""
    t = np.array([0.0, 0.004, 0.008, 0.012, last])
    error = refused(make, t=t)
    assert (error.column, error.row) == ("t", 5)
    assert word in error.problem
    assert f"{last!r} after 0.012" in error.problem


@pytest.mark.parametrize("make", [motion, log])
@pytest.mark.parametrize(
    ("changes", "column"),
    [
        ({"t": np.zeros((5, 1))}, "t"),
        ({"t": []}, "t"),
        ({"t": [0.0, 1.0, np.nan, 3.0, 4.0]}, "t"),
        ({"t": np.arange(4.0)}, "q"),
        ({"q": np.zeros(5)}, "q"),
        ({"q": np.zeros((5, 0))}, "q"),
        ({"q": [[1.0], [1.0, 2.0]]}, "q"),
        ({"q": [["a"] * 3] * 5}, "q"),
        ({"q": np.zeros((5, 3), complex)}, "q"),
        ({"q": None}, "q"),
        ({"dq": np.zeros((5, 2))}, "dq"),
        ({"ddq": np.zeros((4, 3))}, "ddq"),
    ],
)
def test_array_of_another_shape_or_kind_is_refused(make, changes, column):
    """A wrong shape, length or kind of values is an input error that names the field."""
    assert refused(make, **changes).column == column


@pytest.mark.parametrize(
    ("changes", "column"),
    [
        ({"ambient": np.zeros(4)}, "ambient"),
        ({"segment": np.full(5, 0.5)}, "segment"),
        ({"cycle": [0, 0, 0, np.nan, 1]}, "cycle"),
        ({"temperature": np.zeros((5, 2))}, "temperature"),
    ],
)
def test_common_columns_of_a_log_are_checked(changes, column):
    """Ambient temperature has a value a sample; segment and cycle are whole numbers."""
    assert refused(log, **changes).column == column


def test_log_knows_whether_it_has_torque():
    """A log may hold torque, current, both, or a motion only."""
    assert not log(tau=None, current=None).has_torque
    assert not log(tau=None).has_torque
    assert log(current=None).has_torque
    smallest = Log([0.0, 1.0], [[1.0], [2.0]], [[3.0], [4.0]])
    assert (smallest.dq, smallest.name, dict(smallest.metadata)) == (None, "", {})


def test_rows_of_a_log_keep_everything_else():
    """Rows cut every signal alike and keep name and metadata; a backward or empty cut is refused."""
    whole = log(temperature=None)
    part = whole.rows(slice(1, 4, 2))
    assert part.t.tolist() == whole.t[[1, 3]].tolist()
    for name in ("q", "tau", "current", "dq", "ddq", "qlink", "ambient", "segment", "cycle"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[1:4:2])
    assert part.temperature is None
    assert (part.name, part.metadata) == (whole.name, whole.metadata)
    for cut in (slice(None, None, -1), slice(9, None)):
        with pytest.raises(InputError):
            whole.rows(cut)


def test_metadata_of_a_log_is_its_own():
    """Changing the mapping that was given does not change the log."""
    given = {"robot": "er3a"}
    made = log(metadata=given)
    given["robot"] = "ur10"
    assert made.metadata == {"robot": "er3a"}


def test_slice_of_a_motion():
    """A slice keeps the times of its samples; an empty one is refused."""
    whole = motion()
    part = whole.slice(1, 3)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[1:3])
    assert len(whole.slice(None, -1)) == 4
    with pytest.raises(InputError, match="no samples"):
        whole.slice(3, 3)


def test_concatenation_keeps_times_or_shifts_them():
    """Motions join on one clock, or each a step after the one before; the parts add up to the whole."""
    whole = motion()
    joined = Motion.concatenate([whole.slice(0, 2), whole.slice(2, 5)])
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    twice = Motion.concatenate([whole, whole, whole], shift=True)
    assert len(twice) == 15
    assert twice.period == pytest.approx(0.004, rel=1e-12)
    np.testing.assert_array_equal(twice.q, np.concatenate([whole.q] * 3))


def test_concatenation_refuses_what_does_not_join():
    """No motion, other joints, overlapping times, and a step that nothing shows are refused."""
    whole = motion()
    with pytest.raises(InputError, match="no motion"):
        Motion.concatenate([])
    with pytest.raises(InputError, match="motion 2 has 2 joints, the first 3"):
        Motion.concatenate([whole, motion(joints=2)])
    with pytest.raises(InputError, match="time"):
        Motion.concatenate([whole, whole])
    with pytest.raises(InputError, match="step is unknown"):
        Motion.concatenate([whole.slice(0, 1), whole], shift=True)


@pytest.mark.parametrize("part", [slice(1, 4), np.array([0, 2, 3])])
def test_what_is_known_of_a_recording_goes_with_its_rows(part):
    """A payload and a gravity are of the whole log: any rows of it, and its pickle, keep them, frozen."""
    gravity, payload = np.array([0.0, -2.54, -9.48]), np.arange(10.0)
    whole = log(gravity=gravity, payload=payload)
    for other in (whole.rows(part), pickle.loads(pickle.dumps(whole))):
        np.testing.assert_array_equal(other.gravity, gravity)
        np.testing.assert_array_equal(other.payload, payload)
        with pytest.raises(ValueError, match="read-only"):
            other.gravity[0] = 1.0
    np.testing.assert_array_equal(whole.rows(part).q, whole.q[part])
    assert log().gravity is None


@pytest.mark.parametrize("name", ["gravity", "payload"])
@pytest.mark.parametrize("value", [[0.0, -9.81], [0.0, np.nan, -9.81], "down", [[0.0, 0.0, -9.81]], -9.81])
def test_a_gravity_or_payload_that_is_none_is_refused(name, value):
    """Three finite numbers, or ten; the column says which."""
    assert refused(log, **{name: value}).column == name
