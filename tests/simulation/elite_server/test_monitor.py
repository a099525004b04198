import struct

import numpy as np
import pytest

from dmpcli.simulation.elite_server.faults import Event
from dmpcli.simulation.elite_server.monitor import frame
from tests.simulation.elite_server.virtual_fakes import START, Bench


def doubles(sent: bytes, first: int, last: int) -> np.ndarray:
    """What bytes `first` to `last` hold, big-endian."""
    return np.frombuffer(sent[first : last + 1], ">f8").astype(float)


def whole(sent: bytes, first: int) -> int:
    return int(struct.unpack_from(">i", sent, first)[0])


def test_a_frame_is_1024_bytes_and_says_so():
    sent = frame(Bench().controller, 1234567890123)
    assert len(sent) == 1024
    assert struct.unpack(">IQ", sent[:12]) == (1024, 1234567890123)
    assert struct.unpack(">I", sent[1020:]) == (0xEC8056EC,)


def test_joints_and_poses_are_at_their_bytes():
    bench = Bench()
    sent = frame(bench.controller, 0)
    np.testing.assert_allclose(doubles(sent, 13, 76), [*bench.degrees, 0.0, 0.0])
    for first in (77, 125):
        pose = doubles(sent, first, first + 47)
        np.testing.assert_allclose(pose[:3], START, atol=1e-9)
        assert abs(pose[3]) == pytest.approx(np.pi)
    for first in (366, 414):
        flange = doubles(sent, first, first + 47)
        np.testing.assert_allclose(flange[:3], START + [0.0, 0.0, 160.0], atol=1e-9)


def test_state_servo_motors_and_mode_are_at_their_bytes():
    bench = Bench()
    sent = frame(bench.controller, 0)
    assert [whole(sent, at) for at in (237, 241, 245, 281)] == [0, 0, 0, 2]
    bench.begin()
    sent = frame(bench.controller, 0)
    assert [whole(sent, at) for at in (237, 241, 245, 281)] == [3, 1, 1, 2]


def test_collision_and_emergency_stop_are_at_their_bytes():
    sent = frame(Bench().controller, 0)
    assert (sent[365], sent[462]) == (0, 0)
    sent = frame(Bench(events=(Event("collision", None),)).controller, 0)
    assert (sent[365], sent[462]) == (1, 0)
    sent = frame(Bench(events=(Event("estop", None),)).controller, 0)
    assert (sent[365], sent[462]) == (0, 1)


def test_speeds_are_at_their_bytes():
    bench = Bench().begin(lookahead=20)
    bench.put(bench.degrees + [0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    bench.wait(0.01)
    sent = frame(bench.controller, 0)
    np.testing.assert_allclose(doubles(sent, 471, 534), [10.0, 0, 0, 0, 0, 0, 0, 0], atol=1e-9)
    # 10 °/s about the base's z, at the pen's distance from it.
    radius = np.hypot(*bench.arm.posture.position[:2])
    assert doubles(sent, 463, 470)[0] == pytest.approx(np.radians(10.0) * radius)
