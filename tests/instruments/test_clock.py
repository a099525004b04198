import time

import pytest

from dmpcli.instruments.clock import MonotonicClock, SimulatedClock


def test_simulated_time_passes_only_while_somebody_sleeps():
    clock = SimulatedClock(5.0)
    assert clock.now() == 5.0
    clock.sleep_until(6.5)
    assert clock.now() == 6.5


def test_simulated_time_never_runs_backward():
    clock = SimulatedClock(5.0)
    clock.sleep_until(1.0)
    assert clock.now() == 5.0


def test_the_monotonic_clock_sleeps_to_an_absolute_time(monkeypatch):
    now, slept = 100.0, []
    monkeypatch.setattr(time, "monotonic", lambda: now)
    monkeypatch.setattr(time, "sleep", slept.append)
    clock = MonotonicClock()
    assert clock.now() == 100.0
    clock.sleep_until(100.25)
    clock.sleep_until(99.0)
    assert slept == [pytest.approx(0.25)]
