"""Parts of drawn strokes: what belongs to a sample stays with it."""

import numpy as np
import pytest

from dmpcli.dmp.drawn_strokes import DrawnBlock, DrawnStroke
from dmpcli.dmp.time_scaling import Timing
from dmpcli.surfaces.surface import Status

N = 8
T = Timing(0.1 * np.arange(N), 0.3 * np.arange(N), 5.0)


def numbered(count=3):
    """Blocks whose numbers tell row and sample."""
    rows = np.arange(count)[:, None, None]
    samples = np.arange(N)[None, :, None]
    position = 100.0 * rows + samples + np.array([0.0, 0.1, 0.2])
    outside = np.zeros((count, N), dtype=bool)
    outside[1, 5:7] = outside[2, 0] = True
    status = np.array([Status.DRAWN, Status.KEPT_OUT, Status.DRAWN])[:count]
    return DrawnBlock(
        np.array([7, 3, 5])[:count], T, position, -position, 2 * position, status, outside,
        np.array([False, True, False])[:count], ((0, 3), (4, 8)),
    )  # fmt: skip


def test_strokes_of_a_block_are_its_rows():
    block = numbered()
    assert len(block) == 3
    one = block.some(np.array([2, 1]))
    assert one.rows.tolist() == [5, 3]
    for i, row in enumerate([2, 1]):
        stroke, same = one.stroke(i), block.stroke(row)
        assert np.array_equal(stroke.position, block.position[row])
        assert np.array_equal(stroke.euler, -stroke.position)
        assert np.array_equal(stroke.normal, 2 * stroke.position)
        assert np.array_equal(stroke.outside, block.outside[row])
        assert stroke.status == same.status
        assert stroke.unfolded == (row == 1)
        assert stroke.cuts == ((0, 3), (4, 8))


def test_what_is_drawn_ends_before_the_first_sample_beyond_the_border():
    block = numbered()
    for row, count in ((0, 8), (1, 5), (2, 1)):
        stroke = block.stroke(row)
        part = stroke.until_border()
        assert part.timing.t.tolist() == T.t[:count].tolist()
        assert part.timing.stroke.tolist() == T.stroke[:count].tolist()
        assert np.array_equal(part.position, stroke.position[:count])
        assert np.array_equal(part.euler, stroke.euler[:count])
        assert np.array_equal(part.normal, stroke.normal[:count])
        assert np.array_equal(part.outside, stroke.outside[:count])
        assert (part.status, part.unfolded) == (Status.DRAWN, False)


def test_each_piece_of_a_split_stroke_begins_at_its_own_zero():
    first, second = numbered().stroke(0).pieces()
    assert first.timing.t.tolist() == T.t[:3].tolist()
    assert second.timing.t.tolist() == T.t[:4].tolist()
    assert second.timing.stroke.tolist() == T.stroke[4:].tolist()
    assert np.array_equal(second.position, numbered().position[0, 4:])


def test_what_all_samples_share_is_not_cut():
    normal, outside = np.array([[0.0, 0.6, 0.8]]), np.zeros(1, dtype=bool)
    position = np.arange(3.0 * N).reshape(N, 3)
    stroke = DrawnStroke(T, position, None, normal, Status.DRAWN, outside, False, ((2, 6),))
    [piece] = stroke.pieces()
    assert piece.normal is normal
    assert piece.outside is outside
    assert piece.euler is None
    assert np.array_equal(piece.position, position[2:6])
    assert len(stroke.until_border().position) == N


def test_a_goal_at_a_height_lies_along_the_last_normal():
    goal = np.array([1.0, 2.0, 3.0])
    normal = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])
    stroke = DrawnStroke(T, np.zeros((N, 3)), None, normal, Status.DRAWN, np.zeros(1, bool), False)
    assert stroke.above(goal, 5.0) == pytest.approx([1.0, 5.0, 7.0])
    assert stroke.above(goal, -5.0) == pytest.approx([1.0, -1.0, -1.0])
    assert stroke.above(goal, 0.0).tolist() == goal.tolist()
    flat = DrawnStroke(T, np.zeros((N, 3)), None, None, Status.DRAWN, np.zeros(1, bool), False)
    assert flat.above(goal, 5.0).tolist() == goal.tolist()
