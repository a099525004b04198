"""Strips inverted by kernels: the nodes of strips are walked as seldom as can be.

They depend on a stroke by how far it swings alone. So that is found from the samples that swing
farthest, and then all samples on nodes that need not be walked again, for the lift neither.
"""

from dataclasses import replace

import numpy as np

from dmpcli.arrays import Booleans, Floats, Integers
from dmpcli.surfaces.mesh_charts import MeshCharts
from dmpcli.surfaces.strip_chart import WalkedStrips
from dmpcli.surfaces.strip_grid import CentreLines
from dmpcli.surfaces.strip_pieces import strips

PASSES = 4
"""How often the nodes of strips are walked at most."""

FAR = 1e4
"""Coordinates beyond this are astray, mm."""

# Widths of strips whose nodes need not be walked again differ by no more than this, mm; the last
# pass may leave the second. And so much, in nodes, may coordinates move that are guessed, or known.
_SAME_WIDTH, _BESIDE = (2e-7, 1e-4), (0.1, 0.02)
# Samples that tell the width.
_FARTHEST = 8
# Strokes that tell the course of those alike, and by how much theirs may differ, mm.
_TELLING, _ONE_COURSE = 2, 1e-6


class Course:
    """What strokes in their charts have in common: u by the length of the chart, and v.

    What one skill draws has one course, whatever its start and goal and the surface: it is the
    chart that bends.

    Attributes
    ----------
    place : array, shape (T, 2), or None
        Where there is one; v in mm.
    told : bool
        Whether it was looked for.
    """

    def __init__(self) -> None:
        self.place: Floats | None = None
        self.told = False

    def tell(self, at: Floats, lengths: Floats, good: bool) -> None:
        """Look for it in coordinates in charts of some lengths, if they are good.

        Parameters
        ----------
        at : array, shape (R, T, 2)
            u, v, mm.
        lengths : array, shape (R,)
            From start to goal, mm.
        good : bool
            Whether all of them were found.
        """
        self.told = True
        course = np.stack([at[..., 0] / lengths[:, None], at[..., 1]], axis=-1)
        apart = np.abs(course - course[0]).max(axis=(0, 1))
        # What is no number is not below it.
        if good and apart[0] * lengths.max() < _ONE_COURSE and apart[1] < _ONE_COURSE:
            self.place = course[0]


def settled(
    charts: MeshCharts,
    foot: Floats,
    facet: Floats,
    ends: tuple[Floats, Floats],
    course: "Course | None" = None,
) -> tuple[Floats, Booleans, list[WalkedStrips]]:
    """Find coordinates over feet.

    Parameters
    ----------
    charts : MeshCharts
    foot, facet : array, shape (R, T, 3)
        Feet, mm, and the normals of their facets.
    ends : arrays, shape (R,)
        From which to which u the centre lines are wanted, mm.
    course : Course, optional
        What the strokes may have in common: the first that are asked tell it, if none did before.
        What it says is not taken of strokes for which it does not hold.

    Returns
    -------
    at : array, shape (R, T, 2)
        mm.
    good : array of bool, shape (R,)
        Which strokes came to rest.
    walked : list of WalkedStrips
        Their strips, by rows among the good ones.
    """
    count = len(foot)
    at, good = np.empty((*foot.shape[:2], 2)), np.zeros(count, dtype=bool)
    walked: list[WalkedStrips] = []

    def seek(rows: Integers) -> None:
        some = charts.rows(rows), foot[rows], facet[rows], (ends[0][rows], ends[1][rows])
        at[rows], good[rows], found = _sought(*some)
        walked.extend(replace(strips, rows=rows[strips.rows]) for strips in found)

    left = np.arange(count)
    if course is not None and not course.told and count >= _TELLING:
        telling, left = left[:_TELLING], left[_TELLING:]
        seek(telling)
        course.tell(at[telling], charts.lengths[telling], bool(good[telling].all()))
    if course is not None and course.place is not None and len(left):
        found = _on_course(charts.rows(left), foot[left], facet[left], course.place)
        at[left], good[left] = found[:2]
        walked.extend(replace(strips, rows=left[strips.rows]) for strips in found[2])
        left = left[~found[1]]
    if len(left):
        seek(left)
    # As they are counted among the good ones alone.
    number_of = np.cumsum(good) - 1
    return at, good, [replace(strips, rows=number_of[strips.rows]) for strips in walked]


def _on_course(
    charts: MeshCharts, foot: Floats, facet: Floats, course: Floats
) -> tuple[Floats, Booleans, list[WalkedStrips]]:
    """Find coordinates over feet of strokes that have a known course; see `settled`.

    Their strips are walked once, for the course. Good are those for which the same nodes would be
    walked again, as in the last pass of `_sought`.
    """
    at = np.stack(
        [course[:, 0] * charts.lengths[:, None], np.tile(course[:, 1], (len(foot), 1))], axis=-1
    )
    good, walked, reach = np.zeros(len(at), dtype=bool), [], _extent(at)
    for some, strip in strips(charts, at, reach, beside=_BESIDE[1]):
        at[some], still = strip.moved(foot[some], facet[some], rough=False)
        same = strip.same(_extent(at[some]), reach[some], _SAME_WIDTH[0])
        kept = np.flatnonzero(still & strip.covers(at[some]) & same)
        good[some[kept]] = True
        if len(kept):
            walked.append(strip.walked(some[kept], kept))
    return at, good, walked


def _sought(
    charts: MeshCharts, foot: Floats, facet: Floats, ends: tuple[Floats, Floats]
) -> tuple[Floats, Booleans, list[WalkedStrips]]:
    """Find coordinates over feet of strokes that may be anywhere; their strips by their rows."""
    from dmpcli.surfaces.kernels import inverse

    lines, step = _centre_lines(charts, *ends), charts.centre.step[:, 0]
    nodes = lines.position, lines.across, lines.normal, lines.behind, lines.ahead
    at = inverse.guesses(*nodes, lines.zero, step.copy(), foot)
    good, left = np.zeros(len(at), dtype=bool), np.arange(len(at))
    reach, walked = _extent(at), []
    for number in range(PASSES):
        if len(left) == 0:
            break
        guessed, beside = at[left], _BESIDE[min(number, 1)]
        strayed = np.zeros(len(left), dtype=bool)
        for some, strip in strips(charts.rows(left), guessed, reach, lines.rows(left), beside):
            rows = left[some]
            at[rows], still = strip.moved(foot[rows], facet[rows], rough=number == 0)
            strayed[some] = ~still | ~strip.covers(at[rows])
            same = strip.same(_extent(at[rows]), reach[some], _SAME_WIDTH[number == PASSES - 1])
            kept = np.flatnonzero(~strayed[some] & same)
            good[rows[kept]] = True
            if len(kept):
                walked.append(strip.walked(rows[kept], kept))
        rows = left[strayed]
        if len(rows):
            # Nodes that were not walked led them astray: once more, with those all around.
            at[rows] = guessed[strayed]
            for some, strip in strips(charts.rows(rows), at[rows], reach[strayed]):
                at[rows[some]], _ = strip.moved(foot[rows[some]], facet[rows[some]], rough=True)
        left = left[~good[left]]
        # What is no number is not below it either.
        left = left[(np.abs(_extent(at[left])) < FAR).all(axis=(1, 2))]
        if number == 0 and len(left):
            _narrow(charts, at, left, foot, facet, lines)
        reach = _extent(at[left])
    return at, good, walked


def _centre_lines(charts: MeshCharts, least: Floats, most: Floats) -> CentreLines:
    """Walk the centre lines from u to u, (R,) each, mm, and a node beyond."""
    step = charts.centre.step[:, 0]
    behind = np.ceil(np.maximum(-least, 0.0) / step).astype(np.int64) + 1
    ahead = np.ceil(np.maximum(most, 0.0) / step).astype(np.int64) + 1
    return CentreLines.walked(charts.mesh, charts.centre, behind, np.maximum(ahead, 4))


def _narrow(
    charts: MeshCharts,
    at: Floats,
    rows: Integers,
    foot: Floats,
    facet: Floats,
    lines: CentreLines,
) -> None:
    """Move the coordinates that swing farthest once more: they tell the width of the strips."""
    at_once = min(_FARTHEST, at.shape[1])
    far = np.argpartition(-np.abs(at[rows, :, 1]), at_once - 1, axis=1)[:, :at_once]
    row = rows[:, None]
    some_at, some_foot, some_facet = at[row, far], foot[row, far], facet[row, far]
    some_charts, reach = charts.rows(rows), _extent(at[rows])
    for some, strip in strips(some_charts, some_at, reach, lines.rows(rows), _BESIDE[1]):
        moved, still = strip.moved(some_foot[some], some_facet[some], rough=False)
        some_at[some[still]] = moved[still]
    at[row, far] = some_at


def _extent(at: Floats) -> Floats:
    """Least and largest u and v of coordinates (R, T, 2), shape (R, 2, 2), mm; by kernels."""
    from dmpcli.surfaces.kernels import inverse

    return inverse.extents(at)
