"""Messages of the simple_message protocol and their bytes."""

from __future__ import annotations

import contextlib
import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.exports.simple_message import (
    DEFAULT,
    Bare,
    Comm,
    Frame,
    FullPoint,
    JointFeedback,
    JointPosition,
    Kind,
    MessageError,
    Ping,
    Point,
    Reply,
    Special,
    Splitter,
    Status,
    TorqueFeedback,
    Valid,
    WireFormat,
)
from robots.common.errors import InputError

FORMATS = [WireFormat(byte_order=order, real_bytes=size) for order in ("little", "big") for size in (4, 8)]  # type: ignore[arg-type]
EACH_FORMAT = pytest.mark.parametrize("form", FORMATS, ids=lambda form: f"{form.byte_order}{form.real_bytes}")
SIX = (0.5, -1.25, 2.0, 0.0, -0.75, 3.0)
TEN = (*SIX, 0.0, 0.0, 0.0, 0.0)

# Sizes and layouts as the protocol's tables state them (industrial_core 0.7), with the standard library alone.
GOLDEN = {
    "ping": (Frame(Ping(), Comm.REQUEST), bytes.fromhex("0c000000 01000000 02000000 00000000")),
    "pong": (Frame(Bare(kind=1), Comm.REPLY, Reply.SUCCESS), struct.pack("<4i", 12, 1, 3, 1)),
    "position": (
        Frame(JointPosition(sequence=7, positions=SIX)),
        struct.pack("<4ii10f", 56, 10, 1, 0, 7, *TEN),
    ),
    "point": (
        Frame(Point(sequence=3, positions=SIX, velocity=0.5, duration=0.25), Comm.REQUEST),
        struct.pack("<4ii10f2f", 64, 11, 2, 0, 3, *TEN, 0.5, 0.25),
    ),
    "stop": (
        Frame(Point(sequence=Special.STOP, positions=(), velocity=0.0, duration=0.0), Comm.REQUEST),
        bytes.fromhex("40000000 0b000000 02000000 00000000 fcffffff") + bytes(48),
    ),
    "full point": (
        Frame(FullPoint(sequence=9, time=1.5, positions=SIX, velocities=SIX, accelerations=SIX), Comm.REQUEST),
        struct.pack("<4i3if30f", 148, 14, 2, 0, 0, 9, 15, 1.5, *TEN, *TEN, *TEN),
    ),
    "feedback": (
        Frame(
            JointFeedback(
                robot_id=1, valid=Valid.TIME | Valid.POSITION, time=2.5, positions=SIX, velocities=(), accelerations=()
            )
        ),
        struct.pack("<4i2if30f", 144, 15, 1, 0, 1, 3, 2.5, *TEN, *(0.0,) * 20),
    ),
    "status": (
        Frame(
            Status(
                drives_powered=1,
                e_stopped=0,
                error_code=42,
                in_error=1,
                in_motion=-1,
                mode=2,
                motion_possible=0,
            )
        ),
        struct.pack("<4i7i", 40, 13, 1, 0, 1, 0, 42, 1, -1, 2, 0),
    ),
    "torque feedback": (
        Frame(
            TorqueFeedback(
                valid=Valid.POSITION | Valid.TORQUE,
                time=0.0,
                positions=SIX,
                velocities=(),
                accelerations=(),
                efforts=SIX,
            )
        ),
        struct.pack("<4i2if40f", 184, 9015, 1, 0, 0, 18, 0.0, *TEN, *(0.0,) * 20, *TEN),
    ),
}
WIRE_SIZES = {"ping": 16, "position": 60, "point": 68, "stop": 68, "full point": 152, "feedback": 148, "status": 44}


@pytest.mark.parametrize("name", GOLDEN)
def test_golden_bytes(name: str) -> None:
    """Each message has the bytes that the protocol's tables prescribe."""
    frame, expected = GOLDEN[name]
    assert DEFAULT.encode(frame) == expected
    assert len(expected) == WIRE_SIZES.get(name, len(expected))


def test_big_endian_with_long_reals() -> None:
    """Byte order and size of the reals are those of the controller."""
    frame = Frame(JointPosition(sequence=7, positions=SIX))
    expected = struct.pack(">4ii10d", 96, 10, 1, 0, 7, *TEN)
    assert WireFormat(byte_order="big", real_bytes=8).encode(frame) == expected


INTEGERS = st.integers(-(2**31), 2**31 - 1)
REALS = st.floats(width=32, allow_nan=False, allow_infinity=False)
ARRAYS = st.tuples(*[REALS] * 10)
FLAGS = st.integers(0, 63).map(Valid)
MESSAGES = st.one_of(
    st.builds(Ping),
    st.builds(JointPosition, sequence=INTEGERS, positions=ARRAYS),
    st.builds(Point, sequence=INTEGERS, positions=ARRAYS, velocity=REALS, duration=REALS),
    st.builds(
        FullPoint,
        robot_id=INTEGERS,
        sequence=INTEGERS,
        valid=FLAGS,
        time=REALS,
        positions=ARRAYS,
        velocities=ARRAYS,
        accelerations=ARRAYS,
    ),
    st.builds(
        TorqueFeedback,
        robot_id=INTEGERS,
        valid=FLAGS,
        time=REALS,
        positions=ARRAYS,
        velocities=ARRAYS,
        accelerations=ARRAYS,
        efforts=ARRAYS,
    ),
    st.builds(
        JointFeedback,
        robot_id=INTEGERS,
        valid=FLAGS,
        time=REALS,
        positions=ARRAYS,
        velocities=ARRAYS,
        accelerations=ARRAYS,
    ),
    st.builds(
        Status,
        **dict.fromkeys(
            ["drives_powered", "e_stopped", "error_code", "in_error", "in_motion", "mode", "motion_possible"], INTEGERS
        ),
    ),
)
BYTES = st.integers(0, 255)
WAYS = st.sampled_from(
    [
        (Comm.TOPIC, Reply.INVALID),
        (Comm.REQUEST, Reply.INVALID),
        (Comm.REPLY, Reply.SUCCESS),
        (Comm.REPLY, Reply.FAILURE),
    ]
)


@EACH_FORMAT
@given(message=MESSAGES, way=WAYS)
@settings(max_examples=40, deadline=None)
def test_round_trip(form: WireFormat, message, way) -> None:
    """What was encoded is decoded to the same message, in every format."""
    frame = Frame(message, *way)
    assert form.decode(form.encode(frame)) == frame


@EACH_FORMAT
@given(data=st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_hostile_bytes(form: WireFormat, data: bytes) -> None:
    """Whatever bytes arrive, decoding ends with a message or with the one error."""
    with contextlib.suppress(MessageError):
        assert isinstance(form.decode(data), Frame)


@given(
    frame=st.sampled_from([frame for frame, _ in GOLDEN.values()]), at=st.integers(0, 200), value=st.integers(0, 255)
)
@settings(max_examples=150, deadline=None)
def test_damaged_bytes(frame: Frame, at: int, value: int) -> None:
    """A message with one wrong byte is another message, or raises the one error; an infinite number never passes."""
    data = bytearray(DEFAULT.encode(frame))
    data[at % len(data)] = value
    try:
        decoded = DEFAULT.decode(bytes(data))
    except MessageError:
        return
    assert all(math.isfinite(x) for x in getattr(decoded.message, "positions", ()))


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "0 bytes"),
        (b"\x8e", "1 bytes"),
        (bytes(2000), "2000 bytes"),
        (struct.pack("<4i", 16, 1, 2, 0), "length field says 16"),
        (struct.pack("<4i", 12, 99, 2, 0), "message type 99"),
        (struct.pack("<4i", 12, 1, 3, 0), "reply code 0"),
        (struct.pack("<4i", 12, 1, 2, 1), "reply code 1"),
        (struct.pack("<4i", 12, 11, 2, 0), "without a body"),
        (struct.pack("<4ii", 16, 11, 2, 0, 5), "20 bytes"),
        (struct.pack("<4ii10f", 56, 10, 1, 0, 7, *(math.nan,) * 10), "not finite"),
    ],
)
def test_what_is_wrong_is_said(data: bytes, problem: str) -> None:
    """The error says what is wrong with the bytes."""
    with pytest.raises(MessageError, match=problem):
        DEFAULT.decode(data)


@EACH_FORMAT
def test_other_format_is_named(form: WireFormat) -> None:
    """Bytes in another format lead to an error that names that format."""
    data = form.encode(Frame(JointPosition(sequence=1, positions=SIX)))
    for other in FORMATS:
        if other != form:
            with pytest.raises(MessageError, match=f"{form.byte_order} byte order and reals of {form.real_bytes} byte"):
                other.decode(data)


@pytest.mark.parametrize(
    "frame",
    [
        Frame(JointPosition(sequence=1, positions=(0.0,) * 11)),
        Frame(JointPosition(sequence=1, positions=(math.inf,))),
        Frame(JointPosition(sequence=1, positions=(1e300,))),
        Frame(JointPosition(sequence=2**31, positions=())),
        Frame(Ping(), Comm.REPLY),
        Frame(Ping(), Comm.TOPIC, Reply.FAILURE),
    ],
)
def test_what_cannot_be_sent(frame: Frame) -> None:
    """A message that the protocol cannot carry is refused before it is sent."""
    with pytest.raises(MessageError):
        DEFAULT.encode(frame)


@pytest.mark.parametrize("settings", [{"byte_order": "middle"}, {"real_bytes": 5}])
def test_wrong_formats(settings) -> None:
    """A format that no controller uses is refused."""
    with pytest.raises(InputError):
        WireFormat(**settings)


@EACH_FORMAT
@given(cuts=st.lists(st.integers(1, 400), max_size=20))
@settings(max_examples=40, deadline=None)
def test_stream_of_bytes(form: WireFormat, cuts: list[int]) -> None:
    """A stream gives the same frames however it is cut."""
    frames = [form.encode(frame) for frame, _ in GOLDEN.values()]
    stream, splitter, found = b"".join(frames), Splitter(form), []
    for cut in [*cuts, len(stream)]:
        part, stream = stream[:cut], stream[cut:]
        found += splitter.feed(part)
    assert found == frames


@pytest.mark.parametrize("length", [-1, 0, 11, 1020, 2**31 - 1])
def test_stream_of_another_protocol(length: int) -> None:
    """An impossible length ends the stream at once: nothing waits for gigabytes."""
    with pytest.raises(MessageError, match="another protocol"):
        Splitter(DEFAULT).feed(struct.pack("<i", length))


def test_types_have_their_numbers() -> None:
    """Types are numbered as in the protocol."""
    assert [Kind.PING, Kind.JOINT_POSITION, Kind.JOINT_TRAJ_PT, Kind.STATUS] == [1, 10, 11, 13]
    assert [Kind.JOINT_TRAJ_PT_FULL, Kind.JOINT_FEEDBACK] == [14, 15]
    assert [Special.START_DOWNLOAD, Special.START_STREAMING, Special.END, Special.STOP] == [-1, -2, -3, -4]
