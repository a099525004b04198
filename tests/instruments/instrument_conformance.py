"""What every sensor and every robot must do; each driver's tests call these with its own makers.

`wait(seconds)` lets that much time pass on the clock that the instrument runs on.
"""

import numpy as np
import pytest

from dmpcli.errors import InstrumentError
from dmpcli.instruments.protocols import RobotState, Sample, SensorInfo, ServoInfo


def check_sensor(sensor, clock, wait, rate=100.0):
    info = sensor.open()
    assert isinstance(info, SensorInfo)
    assert info.rate >= rate
    assert info.limit.shape == (6,)
    assert (info.limit > 0).all()
    assert sensor.poll() == []  # nothing streams before start

    with pytest.raises(InstrumentError):
        sensor.start(2 * info.rate)
    begun = clock.now()
    sensor.start(rate)
    wait(0.5)
    samples = sensor.poll()
    assert len(samples) == pytest.approx(0.5 * rate, abs=2)
    for sample in samples:
        assert isinstance(sample, Sample)
        assert sample.wrench.shape == (6,)
        assert np.isfinite(sample.wrench).all()
        assert sample.healthy
        assert begun <= sample.t <= clock.now()
    assert [s.seq for s in samples] == list(range(samples[0].seq, samples[0].seq + len(samples)))
    assert (np.diff([s.t for s in samples]) > 0).all()
    assert sensor.poll() == []  # each sample is handed out once; poll never waits
    sensor.close()
    sensor.close()
    wait(0.1)
    assert sensor.poll() == []


def check_servo(servo, clock, wait, period=0.02):
    info = servo.open()
    assert isinstance(info, ServoInfo)
    shortest, longest = info.period_range
    assert shortest <= period <= longest
    assert info.lookahead >= 0.0
    state = servo.state()
    assert isinstance(state, RobotState)
    assert state.mode == "ready"
    assert state.t == pytest.approx(clock.now(), abs=0.1)
    home, attitude = state.position, state.rotation

    def along(distance):
        return home + distance * np.array([1.0, 0.0, 0.0])

    np.testing.assert_allclose(attitude @ attitude.T, np.eye(3), atol=1e-9)

    assert not servo.send(home, attitude)  # not started
    for wrong in (0.1 * shortest, 10 * longest):
        with pytest.raises(InstrumentError):
            servo.start(wrong)
    servo.start(period)
    assert not servo.send(np.full(3, np.nan), attitude)
    assert not servo.send(home, np.full((3, 3), np.inf))
    np.testing.assert_allclose(servo.state().position, home, atol=1e-6)

    for k in range(1, 51):
        assert servo.send(along(0.2 * k), attitude)
        wait(period)
    wait(1.0)
    np.testing.assert_allclose(servo.state().position, along(10.0), atol=0.01)

    # What a caller does with an answer must not move the arm.
    servo.state().position[:] = 0.0
    np.testing.assert_allclose(servo.state().position, along(10.0), atol=0.01)

    servo.send(along(12.0), attitude)
    wait(0.5 * period)
    servo.stop()
    servo.stop()
    stopped = servo.state().position
    wait(0.2)
    np.testing.assert_allclose(servo.state().position, stopped, atol=1e-9)
    assert not servo.send(home, attitude)
    servo.close()
