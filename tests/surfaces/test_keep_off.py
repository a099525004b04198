"""What is marked of strokes that come where they may not be."""

from dataclasses import dataclass

import numpy as np

from dmpcli.surfaces.keep_off import KeepOff
from dmpcli.surfaces.surface import Status


@dataclass
class Beyond:
    """Everything with a coordinate over a limit."""

    axis: int
    limit: float

    def holds(self, points, inside=None):
        found = points[..., self.axis] > self.limit
        return found if inside is None else found & inside


def strokes():
    """Along x to 3, along y to 3, nowhere in particular, and one that is refused anyway."""
    s = np.arange(4.0)
    position = np.zeros((4, 4, 3))
    position[0, :, 0] = position[3, :, 0] = s
    position[1, :, 1] = s
    return position


STATUS = np.array([Status.DRAWN, Status.DRAWN, Status.DRAWN, Status.COINCIDENT])


def test_samples_near_a_border_or_in_any_region_are_outside_and_the_stroke_says_why():
    keep_off = KeepOff(Beyond(1, 1.5), (Beyond(0, 2.5), Beyond(2, 9.0), Beyond(0, 1.5)))
    outside, status = keep_off.marked(strokes(), np.zeros((4, 1), dtype=bool), STATUS)
    there = np.zeros((4, 4), dtype=bool)
    there[[0, 1], 2:] = True
    assert np.array_equal(outside, there)
    assert status.tolist() == [
        Status.KEPT_OUT, Status.NEAR_BORDER, Status.DRAWN, Status.COINCIDENT
    ]  # fmt: skip


def test_what_was_outside_stays_so_and_is_not_near_the_border_besides():
    before = np.zeros((4, 4), dtype=bool)
    before[1, 3] = before[2, 0] = True
    given, status = before.copy(), STATUS.copy()
    outside, told = KeepOff(Beyond(1, 2.5)).marked(strokes(), before, status)
    assert np.array_equal(outside, given)
    assert np.array_equal(told, STATUS)
    # What was given is not written into.
    KeepOff(None, (Beyond(0, 0.5),)).marked(strokes(), before, status)
    assert np.array_equal(before, given)
    assert np.array_equal(status, STATUS)


def test_what_any_of_several_regions_holds_is_kept_out():
    class Band:
        def __init__(self, low, high):
            self.low, self.high = low, high

        def holds(self, points):
            return (points[..., 0] > self.low) & (points[..., 0] < self.high)

    x = np.arange(10.0)
    position = np.stack([np.stack([x, 0 * x, 0 * x], -1), np.stack([x + 20, 0 * x, 0 * x], -1)])
    off = KeepOff(None, (Band(1.5, 3.5), Band(6.5, 7.5), Band(50.0, 60.0)))
    free = np.zeros((2, 1), dtype=bool)
    outside, status = off.marked(position, free, np.zeros(2, dtype=np.int64))
    assert np.flatnonzero(outside[0]).tolist() == [2, 3, 7]
    assert not outside[1].any()
    assert status.tolist() == [Status.KEPT_OUT, Status.DRAWN]
