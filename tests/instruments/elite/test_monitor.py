import numpy as np
import pytest

from dmpcli.errors import InstrumentError
from dmpcli.instruments.clock import MonotonicClock
from dmpcli.instruments.elite.frames import decode
from dmpcli.instruments.elite.monitor import Delay, Monitor
from tests.instruments.elite.scripted import HOME, Scripted, frame


class Clock(MonotonicClock):
    """The machine's clock, which a test can put forward."""

    ahead = 0.0

    def now(self):
        return super().now() + self.ahead


@pytest.fixture
def robot():
    with Scripted() as scripted:
        yield scripted


def opened(robot, clock=None, **options):
    monitor = Monitor("127.0.0.1", robot.monitor_port, 1.0, clock or MonotonicClock(), **options)
    monitor.open()
    return monitor


def test_the_newest_frame_is_kept(robot):
    monitor, clock = opened(robot), MonotonicClock()
    assert monitor.newest().joints.tolist() == list(HOME)
    robot.joints[0] = 31.0
    asked = clock.now()
    monitor.newest(after=asked)
    report = monitor.newest(after=clock.now() + 0.02)
    assert report.joints[0] == 31.0
    assert report.t > asked
    monitor.close()
    monitor.close()


def test_an_old_state_is_none(robot):
    clock = Clock()
    monitor = opened(robot, clock)
    robot.sends_frames = False
    monitor.newest()
    clock.ahead = 0.5
    with pytest.raises(InstrumentError, match=r"no new state for 0\.[5-9]\d s \(silent\)"):
        monitor.newest()
    clock.ahead = 0.0
    robot.sends_frames = True
    assert monitor.newest(after=clock.now()).mode == 2
    monitor.close()


def test_a_controller_that_repeats_itself_tells_no_new_state(robot):
    robot.monitor["stamp"] = 5
    clock = Clock()
    monitor = opened(robot, clock, oldest=0.5)
    monitor.newest()
    clock.ahead = 1.0
    with pytest.raises(InstrumentError, match="no new state"):
        monitor.newest()
    monitor.close()


def reports(*arrivals_and_stamps):
    """What a frame says that arrives at a time, s, with the controller's stamp, ms."""
    return [decode(frame(stamp=stamp), t) for t, stamp in arrivals_and_stamps]


def undone(*arrivals_and_stamps):
    delay = Delay()
    return [delay.undone(report) for report in reports(*arrivals_and_stamps)], delay.value


def test_a_delay_that_grows_makes_frames_old_however_regularly_they_come():
    # Each frame arrives 10 ms after the last one and tells of 8 ms later.
    times, delay = undone(*((100.0 + 0.010 * k, 5000 + 8 * k) for k in range(101)))
    assert delay == pytest.approx(0.2, abs=0.001)
    np.testing.assert_allclose(times, 100.0 + 0.008 * np.arange(101), atol=0.001)


def test_a_connection_that_has_caught_up_is_believed_again():
    times, delay = undone((1.0, 0), (1.3, 100), (1.3, 200), (1.3, 300))
    np.testing.assert_allclose(times, [1.0, 1.1, 1.2, 1.3], atol=0.001)
    assert delay == pytest.approx(0.0, abs=0.001)


def test_clocks_that_drift_apart_are_no_delay():
    hour = ((1.0001 * t, 1000 * t) for t in range(3600))
    assert undone(*hour)[1] == 0.0


@pytest.mark.parametrize("set_to", [0, 10**9])
def test_a_controllers_clock_that_is_set_is_no_delay(set_to):
    _, delay = undone((1.0, 10**6), (1.008, 10**6 + 8), (1.016, set_to), (1.024, set_to + 8))
    assert delay == pytest.approx(0.0, abs=1e-5)


def test_a_stream_that_lags_tells_no_state_and_says_why(robot):
    clock = Clock()
    monitor = opened(robot, clock, oldest=0.5)
    monitor.newest()
    # From here on every frame arrives so much later than its stamp says.
    clock.ahead = 1.1
    with pytest.raises(InstrumentError, match=r"no new state for .*frames come 1\.\d+ s late"):
        monitor.newest(after=clock.now())
    monitor.close()


def test_a_closed_connection_is_told_at_once(robot):
    clock = Clock()
    monitor = opened(robot, clock)
    robot.hang_up()
    with pytest.raises(InstrumentError, match="the controller closed the connection"):
        monitor.newest(after=clock.now())
    monitor.close()


@pytest.mark.slow
def test_what_sends_no_frames_is_no_monitor(robot):
    robot.monitor["word"] = 7
    with pytest.raises(InstrumentError, match=r"sends no state \(silent; a frame ends in 0x000000"):
        opened(robot)
    opened(robot, word=None).close()
    robot.sends_frames = False
    with pytest.raises(InstrumentError, match=r"sends no state \(silent\)"):
        opened(robot)


@pytest.mark.parametrize(
    "flag", [{"estop": 1}, {"collision": 1}, {"state": 2}, {"state": 4}, {"state": 5}]
)
def test_what_a_single_frame_shows_stays_whatever_comes_after(robot, flag):
    monitor = opened(robot)
    assert monitor.latched is None
    stamp = monitor.newest().timestamp
    # Even where its time stamp is none that is new.
    for changes in ({}, flag | {"stamp": stamp}, {}):
        (report,) = reports((monitor.newest().t, stamp))
        monitor._take(decode(frame(**{"stamp": stamp} | changes), report.t))
    assert not monitor.newest(after=MonotonicClock().now()).alarming
    assert monitor.latched.alarming
    monitor.forget()
    assert monitor.latched is None
    monitor.close()


def slewed(share, agreed):
    """A clock that runs slow by a share, after so many frames in which it does not."""
    stamps = np.cumsum([8.0] * agreed + [8.0 * (1.0 - share)] * 400)
    return [(100.0 + 0.008 * (k + 1), 5000 + round(s)) for k, s in enumerate(stamps)]


@pytest.mark.parametrize("agreed", [0, 200])
def test_a_clock_that_slews_is_told_from_a_connection_that_lags(agreed):
    delay = Delay()
    for report in reports(*slewed(0.05, agreed)):
        delay.undone(report)
    assert delay.value == pytest.approx(0.05 * 400 * 0.008, rel=0.05)
    assert delay.slew == pytest.approx(0.05, abs=0.005)
    lags = Delay()
    arrivals = np.cumsum([0.008] * agreed + [0.0084] * 400)
    for report in reports(*((100.0 + t, 5000 + 8 * k) for k, t in enumerate(arrivals))):
        lags.undone(report)
    assert lags.value > 0.1
    assert lags.slew is None


def test_a_clock_that_slews_is_said_to_and_not_called_silent(robot):
    monitor = opened(robot, oldest=0.1)
    robot.sends_frames = False
    clock, now = monitor._clock, MonotonicClock().now()
    begin = monitor.newest().timestamp
    for t, stamp in slewed(0.05, 70):
        monitor._take(decode(frame(stamp=begin + stamp), now + t - 100.0))
    clock.now = lambda: now + t - 100.0 + 0.004
    with pytest.raises(InstrumentError, match=r"its clock runs (4\.9\d*|5\.?\d*) % slow") as caught:
        monitor.newest()
    assert "silent" not in str(caught.value)
    assert "cable" not in str(caught.value)
    monitor.close()
