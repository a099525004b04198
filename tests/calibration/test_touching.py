import numpy as np
import pytest

from dmpcli.calibration import touching
from dmpcli.calibration.resting import Watcher
from dmpcli.control.signals import Interruption
from dmpcli.errors import RefusedError
from dmpcli.records import pairs, touched
from dmpcli.records.file_io import read
from dmpcli.records.points import PairFile, PointFile
from tests.calibration.calibration_fakes import Arm, SimulatedClock


class Keys:
    """What a person types, and when on the simulated clock."""

    def __init__(self, clock, *typed):
        self.clock, self.typed = clock, list(typed)

    def line(self):
        if self.typed and self.clock.now() >= self.typed[0][0]:
            return self.typed.pop(0)[1]
        return None


def stations(t):
    """Stands for 2 s at each point, and takes 1 s from one to the next, 10 mm on along z."""
    number, rest = divmod(t, 3.0)
    return [100.0, -50.0, 10.0 * (number + max(rest - 2.0, 0.0))]


def by_hand(tmp_path, typed, kind=PointFile, most=None, at=stations, **options):
    clock, said = SimulatedClock(), []
    points = kind(str(tmp_path / "points.csv"), **options)
    watcher = Watcher(Arm(clock, at), clock)
    interruption = Interruption()
    touching.by_hand(watcher, Keys(clock, *typed), points, most, interruption, said.append)
    return points, said


def test_each_enter_takes_the_point_where_the_tip_rests(tmp_path):
    points, said = by_hand(tmp_path, [(0.5, ""), (3.5, ""), (6.5, ""), (7.5, "q")])
    assert points.count == 3
    found = touched.read(read(tmp_path / "points.csv"))
    np.testing.assert_allclose(found.base, [[100, -50, z] for z in (0, 10, 20)])
    assert not found.paired.any()
    assert said[0] == "touch point 1; Enter takes it, q and Enter ends"
    assert said[1] == "point 1: 100.000 -50.000 0.000; now point 2"


def test_a_moving_arm_gives_no_point(tmp_path):
    points, said = by_hand(tmp_path, [(0.5, ""), (1.0, "q")], at=lambda t: [20.0 * t, 0, 0])
    assert points.count == 0
    assert said[-1].startswith("not taken: the arm moves")
    assert not (tmp_path / "points.csv").exists()


def test_points_are_there_as_soon_as_they_are_taken(tmp_path):
    file, seen = tmp_path / "points.csv", []

    class Looking(Keys):
        def line(self):
            seen.append(len(file.read_text().splitlines()) - 1 if file.exists() else 0)
            return super().line()

    clock = SimulatedClock()
    keys = Looking(clock, (0.5, ""), (3.5, ""), (7.0, "q"))
    points = PointFile(str(file))
    watcher = Watcher(Arm(clock, stations), clock)
    touching.by_hand(watcher, keys, points, None, Interruption(), lambda _: None)
    assert set(seen) == {0, 1, 2}
    assert seen == sorted(seen)


def test_it_ends_after_as_many_as_were_asked_for(tmp_path):
    points, said = by_hand(tmp_path, [(0.5, ""), (3.5, ""), (6.5, "")], most=2)
    assert points.count == 2
    assert said[-1] == "point 2: 100.000 -50.000 10.000"


def test_points_of_a_part_are_asked_for_in_order_and_paired(tmp_path):
    part = np.array([[0.0, 0, 0], [50, 0, 2.5]])
    points, said = by_hand(tmp_path, [(0.5, ""), (3.5, ""), (6.5, "")], part=part)
    assert points.full
    assert points.count == 2
    found = touched.read(read(tmp_path / "points.csv"))
    np.testing.assert_array_equal(found.part, part)
    assert "now point 2 of 2, (50, 0, 2.5) on the part" in said[1]


@pytest.mark.parametrize("angles", [False, True])
def test_pairs_are_starts_and_goals_in_turn(tmp_path, angles):
    typed = [(0.5, ""), (3.5, ""), (6.5, ""), (9.5, ""), (10.5, "q")]
    points, said = by_hand(tmp_path, typed, PairFile, angles=angles)
    assert not points.open
    found = pairs.read(read(tmp_path / "points.csv"))
    assert found.ids == ["1", "2"]
    assert found.good.all()
    np.testing.assert_allclose(found.pairs.start[:, 2], [0, 20])
    np.testing.assert_allclose(found.pairs.goal[:, 2], [10, 30])
    assert (found.pairs.start_rotation is not None) == angles
    assert said[2].endswith("now start of pair 2")


def test_a_start_without_goal_is_kept_and_named_by_the_reader(tmp_path):
    points, _ = by_hand(tmp_path, [(0.5, ""), (3.5, ""), (6.5, ""), (7.5, "q")], PairFile)
    assert points.open
    found = pairs.read(read(tmp_path / "points.csv"))
    assert found.good.tolist() == [True, False]
    assert "'xg'" in found.status[1]
    assert found.pairs.start[1, 2] == 20.0


def in_time(tmp_path, at, every=3.0, most=3):
    clock = SimulatedClock()
    points = PointFile(str(tmp_path / "points.csv"))
    watcher = Watcher(Arm(clock, at), clock)
    touching.in_time(watcher, clock, every, most, points, Interruption(), lambda _: None)
    return points, clock


def test_in_even_times_a_moving_tip_is_waited_for(tmp_path):
    # It moves from 2 to 3 s, from 5 to 6 s, from 8 to 9 s.
    points, _ = in_time(tmp_path, stations, every=2.6)
    assert points.count == 3
    z = touched.read(read(tmp_path / "points.csv")).base[:, 2]
    np.testing.assert_allclose(z, [10, 20, 30], atol=0.02)


@pytest.mark.slow
def test_a_tip_that_never_rests_is_refused_and_the_points_are_kept(tmp_path):
    with pytest.raises(RefusedError, match=r"point 2: the tool still moves .* 1 point kept"):
        in_time(tmp_path, lambda t: [10.0 * max(t - 4.0, 0.0), 0, 0])
    assert len(touched.read(read(tmp_path / "points.csv")).base) == 1
