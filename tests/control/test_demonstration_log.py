"""What a recording remembers: its columns, whether it moved, and since when it stands still."""

import numpy as np
import pytest

from dmpcli.admittance.model import DragState
from dmpcli.control import demonstration_log
from dmpcli.control.demonstration_log import DemonstrationLog
from dmpcli.instruments.protocols import RobotState, Sample
from dmpcli.spatial.rotations import exp
from tests.control.streaming_fakes import PEN_DOWN

PERIOD = 0.02


def filled(x, referred=True):
    log = DemonstrationLog(referred)
    for i, place in enumerate(x):
        position = np.array([place, 10.0, -i])
        rotation = exp(np.array([0.0, 0.0, 0.3 * i])) @ PEN_DOWN
        led = DragState(position + 0.5, PEN_DOWN, np.zeros(6)) if referred else None
        sample = Sample(100.0 + i, 7 + i, np.arange(6.0) + i, healthy=True, lost=i // 3)
        state = RobotState(50.0 + i * PERIOD, position, rotation, "ready")
        log.add(i * PERIOD + 4e-12, state, led, -np.arange(6.0), sample)
    return log


def test_the_columns_are_what_was_added_cycle_by_cycle():
    log = filled([1.0, 2.0, 4.0, 8.0, 5.0])
    columns = log.columns()
    assert len(log) == 5
    assert log.duration == pytest.approx(0.08, abs=1e-15)
    assert columns["t"].tolist() == [0.0, 0.02, 0.04, 0.06, 0.08]
    assert columns["x"].tolist() == [1.0, 2.0, 4.0, 8.0, 5.0]
    assert columns["z"].tolist() == [0.0, -1.0, -2.0, -3.0, -4.0]
    assert columns["x_ref"].tolist() == [1.5, 2.5, 4.5, 8.5, 5.5]
    assert columns["fy"].tolist() == [-1.0] * 5
    assert columns["tz_raw"].tolist() == [5.0, 6.0, 7.0, 8.0, 9.0]
    assert columns["sensor_seq"].tolist() == [7, 8, 9, 10, 11]
    assert columns["lost"].tolist() == [0, 0, 0, 1, 1]
    assert columns["lost"].dtype == np.int64
    assert not any(name.endswith("_ref") for name in filled([0.0, 1.0], False).columns())


def test_angles_go_on_where_the_pen_points_straight_down():
    columns = filled(np.zeros(40)).columns()
    for name in ("rx", "ry", "rz"):
        assert np.abs(np.diff(columns[name])).max() < 0.31
    assert np.abs(np.ptp(columns["rz"])) == pytest.approx(0.3 * 39)


def along(x):
    """A log whose z stays too."""
    log = DemonstrationLog(False)
    for i, place in enumerate(x):
        state = RobotState(i * PERIOD, np.array([place, 0.0, 0.0]), PEN_DOWN, "ready")
        sample = Sample(0.0, i, np.zeros(6), healthy=True, lost=0)
        log.add(i * PERIOD, state, None, np.zeros(6), sample)
    return log


def test_it_has_moved_if_it_ever_was_away_from_where_it_began():
    log = along([2.0, 3.0, 6.0, 2.0])
    assert log.moved(3.9)
    assert not log.moved(4.0)
    assert not along([2.0]).moved(0.0)
    assert along([2.0, -1.0]).moved(2.9)


def test_it_is_still_once_all_of_so_long_was_within_so_far():
    log = DemonstrationLog(False)
    found = []
    for i in range(60):
        place = min(i, 20) * 0.5  # moves for 0.4 s
        state = RobotState(i * PERIOD, np.array([place, 0.0, 0.0]), PEN_DOWN, "ready")
        log.add(i * PERIOD, state, None, np.zeros(6), Sample(0.0, i, np.zeros(6), True, 0))
        found.append(log.still(0.4, 1.0))
    # Within 1 mm of the end from sample 18 on: 20 periods later it was so for 0.4 s.
    first = found.index(True)
    assert first == pytest.approx(18 + 20, abs=1)
    assert all(found[first:])
    assert not along(np.zeros(10)).still(0.4, 1.0)
    assert along(np.zeros(22)).still(0.4, 0.0)


def test_the_limits_of_rest_are_met_exactly():
    # Periods of an eighth of a second, so that sums are exact.
    for duration, distance, still in ((0.5, 1.0, True), (0.5, 0.96875, False), (0.625, 2.0, False)):
        log = DemonstrationLog(False)
        for i, place in enumerate([0.0, 0.0, 0.0, 0.0, 1.0]):
            state = RobotState(0.0, np.array([place, 0.0, 0.0]), PEN_DOWN, "ready")
            log.add(0.125 * i, state, None, np.zeros(6), Sample(0.0, i, np.zeros(6), True, 0))
        assert log.still(duration, distance) is still
        assert (log.moved(1.0), log.moved(0.96875)) == (False, True)
    assert DemonstrationLog().duration == 0.0


def test_of_a_recording_that_only_a_journal_is_left_of_that_is_said():
    assert demonstration_log.recovered() == {"ended": "recovered after a crash"}
