import itertools
import random
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.instruments.elite.frames import FRAME, SIZE, BadFrameError, FrameBuffer, decode
from tests.instruments.elite.scripted import HOME, LAYOUT, frame


def test_the_layout_is_that_of_the_document():
    assert LAYOUT.size == FRAME.itemsize == SIZE == 1024
    # First byte of each field, as the document's table gives them.
    document = {
        "size": 0, "timestamp": 4, "cycle": 12, "joints": 13, "tcp_base": 77, "tcp_user": 125,
        "torque": 173, "state": 237, "servo_ready": 241, "motors_synchronised": 245,
        "motor_speed": 249, "mode": 281, "analog_in": 285, "analog_out": 309, "digital_in": 349,
        "digital_out": 357, "collision": 365, "flange_base": 366, "flange_user": 414,
        "estop": 462, "tcp_speed": 463, "joint_speed": 471, "tcp_acceleration": 535,
        "joint_acceleration": 543, "temperature": 607, "drag": 799, "reserved": 800, "word": 1020,
    }  # fmt: skip
    assert {name: FRAME.fields[name][1] for name in document} == document


@pytest.mark.slow
@given(
    st.lists(st.floats(-720, 720), min_size=6, max_size=6),
    st.integers(0, 2**64 - 1),
    st.integers(0, 5),
    st.integers(0, 2),
    st.tuples(*[st.integers(0, 1)] * 4),
)
def test_a_frame_says_what_was_packed(joints, stamp, state, mode, flags):
    names = ("servo", "synced", "collision", "estop")
    said = frame(
        joints, stamp=stamp, state=state, mode=mode, **dict(zip(names, flags, strict=True))
    )
    report = decode(said, 1.5)
    assert (report.t, report.timestamp, report.state, report.mode) == (1.5, stamp, state, mode)
    assert report.joints.tolist() == joints
    told = (report.servo_ready, report.motors_synchronised, report.collision, report.estop)
    assert told == tuple(map(bool, flags))


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (frame()[:-1], "has 1023 bytes"),
        (frame(size=1000), "says that it has 1000"),
        (frame(word=0x12345678), "0x12345678, not in the matching word 0xec8056ec"),
        (frame((np.nan, *HOME[1:])), "no joint angle"),
        (frame((np.inf, *HOME[1:])), "no joint angle"),
        (frame((721.0, *HOME[1:])), "no joint angle"),
        (frame(state=6), "unknown state or mode: 6, 2"),
        (frame(state=-1), "unknown state or mode"),
        (frame(mode=3), "unknown state or mode: 0, 3"),
        (frame(servo=2), "servo_ready 2"),
        (frame(estop=255), "estop 255"),
    ],
)
def test_every_fault_has_its_name(said, words):
    with pytest.raises(BadFrameError, match=words):
        decode(said, 0.0)


def test_another_matching_word_passes_where_that_is_asked_for():
    assert decode(frame(word=5), 0.0, word=None).mode == 2


@given(st.lists(st.integers(1, 1500), min_size=1, max_size=9))
def test_frames_are_found_however_the_stream_is_chopped(sizes):
    stream = b"".join(frame(stamp=k) for k in range(1, 5))
    buffer, found = FrameBuffer(), []
    for size in itertools.cycle(sizes):
        if not stream:
            break
        found += buffer.feed(stream[:size], 0.0)
        stream = stream[size:]
    assert [report.timestamp for report in found] == [1, 2, 3, 4]
    assert buffer.skipped == 0
    assert buffer.fault == ""


@given(st.binary(max_size=3000))
def test_after_garbage_the_next_frames_are_found(garbage):
    buffer = FrameBuffer()
    found = buffer.feed(garbage + b"".join(frame(stamp=k) for k in (1, 2, 3)), 0.0)
    assert [report.timestamp for report in found][-2:] == [2, 3]
    assert buffer.skipped >= len(garbage)
    assert not garbage or buffer.fault


@given(st.binary(max_size=5000))
def test_any_bytes_are_frames_or_skipped(data):
    buffer = FrameBuffer()
    reports = buffer.feed(data, 0.0)
    assert len(reports) * SIZE + buffer.skipped <= len(data)


def damaged(rng, stamp):
    """A frame truncated, mutated, merged with another, or with a value that is none."""
    joints = list(HOME)
    kind = rng.randrange(6)
    if kind == 0:
        return frame(stamp=stamp)[: rng.randrange(1, SIZE)]
    if kind == 1:
        said, at = bytearray(frame(stamp=stamp)), rng.choice([*range(4), 200, *range(1020, 1024)])
        said[at] ^= 1 << rng.randrange(8)
        return bytes(said)
    if kind == 2:
        joints[rng.randrange(6)] = rng.choice([np.nan, np.inf, -np.inf, 1e300, 721.0])
        return frame(joints, stamp=stamp)
    if kind == 3:
        return rng.randbytes(rng.randrange(1, 2 * SIZE))
    if kind == 4:
        at = rng.randrange(SIZE)
        return frame(stamp=stamp)[:at] + frame(stamp=stamp)[at - SIZE // 3 :]
    return frame(stamp=stamp, state=rng.randrange(6, 2**31), servo=rng.randrange(2, 9))


@pytest.mark.slow
def test_of_ten_thousand_damaged_frames_none_is_believed_and_the_stream_is_found_again():
    rng = random.Random(4)
    buffer, faults = FrameBuffer(), set()
    for number in range(10_000):
        for report in buffer.feed(damaged(rng, 0), 0.0):
            # What was merged or flipped where nothing is read is a frame; no other is.
            assert (report.joints.tolist(), report.state) == (list(HOME), 0)
        for stamp in (1, 2, 3):
            good = [r.timestamp for r in buffer.feed(frame(stamp=stamp), 0.0)]
        assert good[-1] == 3
        assert not buffer.lost
        faults.add(buffer.fault.split(" 0x")[0].split(":")[0])
        assert number == 0 or buffer.fault
    told = {
        "does not begin where the last one ended",
        "ends in",
        "holds what is no joint angle",
        "holds an unknown state or mode",
    }
    assert told <= faults


def test_a_head_inside_a_damaged_frame_is_tried():
    said = bytearray(frame(stamp=1))
    said[0:4] = struct.pack(">I", 7)
    said[100:104] = struct.pack(">I", SIZE)
    buffer = FrameBuffer()
    found = buffer.feed(bytes(said) + frame(stamp=2) + frame(stamp=3), 0.0)
    assert [report.timestamp for report in found] == [2, 3]
