"""One owner per arm on this computer, and none for an arm that moves."""

import contextlib
import os
import subprocess
import sys

import numpy as np
import pytest

from dmpcli.control import ownership
from dmpcli.control.ownership import ArmLock
from dmpcli.errors import InstrumentError, RefusedError
from dmpcli.instruments import address
from dmpcli.instruments.protocols import RobotState
from tests.control.streaming_fakes import FakeClock, FakeServo

PORT = 40000 + os.getpid() % 20000  # of this process alone, for tests run side by side


def lock(url):
    return ArmLock(address.split(url.replace("PORT", str(PORT)), "robot"))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("elite://127.0.0.1:PORT", "elite://localhost:PORT?lookahead=0.2"),
        ("elite://[::1]:PORT", "elite://127.0.0.1:PORT"),
        ("elite://[::ffff:10.255.255.254]:PORT", "elite://10.255.255.254:PORT?mode=file"),
        ("elite://10.255.255.253", "elite://10.255.255.253:8055"),
    ],
)
def test_two_names_of_one_arm_are_one(one, other):
    taken = rf"process {os.getpid()}\) moves this arm"
    with lock(one), pytest.raises(RefusedError, match=taken):
        lock(other).take()
    with lock(other):
        pass


def test_other_arms_are_free():
    with lock(f"elite://127.0.0.1:{PORT}"), lock(f"elite://127.0.0.1:{PORT + 1}"):
        pass


def test_a_mock_arm_has_nobody_else():
    with lock("mock:") as one, lock("mock:") as two:
        assert (one.shared, two.shared) == (False, False)


def test_a_host_that_nobody_knows_is_told():
    with pytest.raises(InstrumentError, match="nobody knows this host"):
        lock("elite://no.such.host.invalid").take()


@pytest.mark.slow
def test_the_lock_ends_with_its_process_however_that_ends():
    code = (
        "from dmpcli.control.ownership import ArmLock\n"
        "from dmpcli.instruments.address import split\n"
        f"held = ArmLock(split('elite://127.0.0.1:{PORT}', 'robot'))\nheld.take()\n"
        "print('has it', flush=True)\n"
        "import time; time.sleep(60)\n"
    )
    other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    with contextlib.closing(other.stdout):
        assert other.stdout.readline() == "has it\n"
        with pytest.raises(RefusedError, match=rf"process {other.pid}\)"):
            lock(f"elite://127.0.0.1:{PORT}").take()
        other.kill()
        other.wait()
    with lock(f"elite://127.0.0.1:{PORT}"):
        pass


def servo(speed=0.0, busy=None, begin=0.0):
    clock = FakeClock()
    made = FakeServo(clock)

    def state():
        away = speed * max(clock.now() - 100.0 - begin, 0.0) * np.array([1.0, 0.0, 0.0])
        return RobotState(clock.now(), made.position + away, made.rotation, "ready", busy=busy)

    made.state = state
    return made, clock


def test_an_arm_that_stands_is_taken():
    made, clock = servo()
    ownership.require_rest(made, clock)
    assert clock.now() - 100.0 == pytest.approx(ownership.WINDOW, abs=0.02)


@pytest.mark.parametrize("busy", [None, True])
def test_an_arm_that_moves_is_refused(busy):
    with pytest.raises(RefusedError, match=r"it moves \(moved .* mm.*not by us"):
        ownership.require_rest(*servo(1.0, busy))


def test_a_controller_in_motion_may_only_have_paused():
    with pytest.raises(RefusedError, match="it moves"):
        ownership.require_rest(*servo(1.0, busy=True, begin=0.5))
    made, clock = servo(busy=True)
    ownership.require_rest(made, clock)
    assert clock.now() - 100.0 == pytest.approx(ownership.BUSY_WINDOW, abs=0.02)


def test_where_names_lie_in_the_file_system_a_lock_is_a_file_of_one_owner(monkeypatch):
    monkeypatch.setattr(ownership.sys, "platform", "darwin")
    path = f"/tmp/dmpcli-arm-127.0.0.1:{PORT}"
    with contextlib.suppress(FileNotFoundError):
        os.unlink(path)
    url = f"elite://127.0.0.1:{PORT}"
    try:
        with lock(url):
            assert os.stat(path).st_mode & 0o600 == 0o600
            with pytest.raises(RefusedError, match="another dmpcli on this computer moves"):
                lock(url).take()
        with lock(url):
            pass
        os.unlink(path)
        os.symlink("/tmp/elsewhere-of-no-lock", path)
        with pytest.raises(InstrumentError, match="cannot be locked"):
            lock(url).take()
    finally:
        os.unlink(path)
