"""Strokes on a part: the part as it looks, how far off it they are, and how the tool leans."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter

from dmpcli.arrays import Booleans, Floats
from dmpcli.reporting import drawing, gaps
from dmpcli.reporting.drawing import PlottedCurve
from dmpcli.reporting.raster import Camera, Picture, rendered
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.surface_picture import sheet
from dmpcli.spatial.vectors import unit

_WIDTH, _PANEL, _TALLEST = 5.9, 1.2, 4.4
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.95, 0.2, 0.42, 0.3, 0.48
_INSET = 1.25

PIXELS = 170.0
"""Of the picture, an inch."""

WHOLE = 3.0
"""A part up to so many times as large as what is drawn on it is shown whole."""

MARGIN = 0.18
"""Of a larger part around the strokes, as a share of their extent."""

HIDDEN = 0.004
"""A surface nearer to the eye by this share of the picture hides a stroke."""

UNLIKE = 20.0
"""Where strokes lie so many times as far off the surface as others the scale is logarithmic."""

LEAST_HEIGHT, LEAST_TILT = 0.02, 1.0
"""Least spans of the panels, mm and degrees."""

_PALE = 0.45


@dataclass(frozen=True)
class PlacedCurve:
    """A stroke on the surface and the curve that shows it."""

    stroke: ReportedStroke
    curve: PlottedCurve


def part_figure(
    placed: Sequence[PlacedCurve],
    ground: ReportSurface,
    taught: Sequence[PlottedCurve] = (),
    ids: Sequence[tuple[str, Floats]] = (),
    legend: Sequence[PlottedCurve] | None = None,
) -> Figure:
    """Draw strokes on their surface (a), their distance to it (b), and the tool's tilt (c).

    Parameters
    ----------
    placed : sequence of PlacedCurve
        With their footing; at least one.
    ground : ReportSurface
    taught : sequence of PlottedCurve
        Demonstrations that lie near enough to be in the picture.
    ids : sequence of (str, array)
        What to write beside points (3,), mm.
    legend : sequence of PlottedCurve, optional
        Curves that the legend names; all of them otherwise.
    """
    curves = [*taught, *(one.curve for one in placed)]
    key = curves if legend is None else legend
    tilted = any(one.stroke.footing and one.stroke.footing.tilt is not None for one in placed)
    panels = [_height, *([_tilt] if tilted else [])]
    more = drawing.key_of_ends()
    columns = 1 if max(len(curve.name) for curve in key) > 40 else 2
    foot = _BOTTOM + drawing.ROW * drawing.legend_rows(key, columns, len(more))
    camera, whole, corners = _camera(placed, curves, ground)
    tall = camera.size[1] * _WIDTH / camera.size[0]
    under = len(panels) * (_PANEL + _GAP)
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, foot + under + tall + _TOP)
    scene = drawing.panel(figure, _LEFT, foot + under, _WIDTH, tall)
    hidden = _scene(scene, camera, corners, placed, taught, ids)
    if whole is not None:
        _inset(figure, foot + under, tall, whole, camera, corners)
    note = "; pale: behind or inside the part" if hidden else ""
    drawing.title(scene, f"(a)  on the surface, to scale{note}")
    for i, draw in enumerate(panels):
        bottom = foot + (len(panels) - 1 - i) * (_PANEL + _GAP)
        axes = drawing.panel(figure, _LEFT, bottom, _WIDTH, _PANEL)
        draw(axes, placed)
        axes.set_xlim(0.0, max(float(_way(one.stroke)[-1]) for one in placed))
        axes.tick_params(labelbottom=i == len(panels) - 1)
        if i == len(panels) - 1:
            drawing.labels(axes, x="along the stroke / mm")
    drawing.legend(figure, key, columns, more)
    return figure


def _way(stroke: ReportedStroke) -> Floats:
    """Length of the path up to each sample, shape (n,), mm."""
    steps = np.linalg.norm(np.diff(stroke.position, axis=0), axis=1)
    return np.append(0.0, steps.cumsum())


def _height(axes: Axes, placed: Sequence[PlacedCurve]) -> None:
    """Draw the distance to the surface along each stroke, on a scale that shows it."""
    lines = []
    for one in placed:
        assert one.stroke.footing is not None
        lines.append(one.stroke.footing.height)
    _lines(axes, placed, lines)
    largest = np.array([np.abs(line).max() for line in lines])
    least = max(float(largest.min()), 0.5 * LEAST_HEIGHT)
    said = ""
    if largest.max() > UNLIKE * least:
        axes.set_yscale("symlog", linthresh=least, linscale=0.6)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        said = f", logarithmic beyond {least:.2g} mm"
    else:
        every = np.concatenate(lines)
        low, high = min(0.0, float(every.min())), max(0.0, float(every.max()))
        span = max(1.15 * (high - low), LEAST_HEIGHT)
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * span, middle + 0.5 * span)
    axes.axhline(0.0, color="#666666", lw=0.8, zorder=1)
    drawing.labels(axes, y="off the surface\n/ mm")
    drawing.title(axes, f"(b)  distance to the nearest point of the surface, below 0 inside{said}")


def _tilt(axes: Axes, placed: Sequence[PlacedCurve]) -> None:
    """Draw the angle between the tool and the surface's normal along each stroke."""
    leaning = [one for one in placed if one.stroke.footing and one.stroke.footing.tilt is not None]
    lines = []
    for one in leaning:
        assert one.stroke.footing is not None
        assert one.stroke.footing.tilt is not None
        lines.append(np.degrees(one.stroke.footing.tilt))
    _lines(axes, leaning, lines)
    axes.set_ylim(0.0, max(1.1 * max(float(line.max()) for line in lines), LEAST_TILT))
    drawing.labels(axes, y="tool off the\nnormal / °")
    drawing.title(axes, "(c)  angle between the tool and the surface's normal")


def _lines(axes: Axes, placed: Sequence[PlacedCurve], lines: Sequence[Floats]) -> None:
    for one, line, share in zip(placed, lines, drawing.shares(len(placed)), strict=True):
        way = _way(one.stroke)
        drawing.draw(axes, way, line, one.curve.style, one.stroke.t)
        if len(placed) > 1:
            drawing.number(axes, way, line, one.curve, share)


def _camera(
    placed: Sequence[PlacedCurve], curves: Sequence[PlottedCurve], ground: ReportSurface
) -> tuple[Camera, Camera | None, Floats]:
    """Return a view of the strokes, one of the whole part where that is much larger, triangles."""
    points = np.vstack([curve.position for curve in curves])
    bound = [one.stroke for one in placed if one.stroke.bound] or [one.stroke for one in placed]
    normal = np.vstack([s.footing.normal for s in bound if s.footing is not None]).mean(axis=0)
    right, up, toward = looking(normal)
    low, high = points.min(axis=0), points.max(axis=0)
    if ground.V is None or ground.F is None:
        around = 0.35 * float(np.linalg.norm(high - low))
        corners = sheet(ground, low - around, high + around)
    else:
        corners = ground.V[ground.F]
    sideways = np.stack([right, up], axis=1)
    inner = _window(points @ sideways, MARGIN)
    outer = _window(corners.reshape(-1, 3) @ sideways, 0.04)
    outer = (np.minimum(outer[0], inner[0]), np.maximum(outer[1], inner[1]))

    def camera(window: tuple[Floats, Floats], across: float, most: float) -> Camera:
        size = window[1] - window[0]
        least = size[0] * 0.28
        if size[1] < least:
            window = (window[0] - [0.0, 0.5 * (least - size[1])], window[1])
            size = np.array([size[0], least])
        if size[1] / size[0] > most / across:
            wide = size[1] * across / most
            window = (window[0] - [0.5 * (wide - size[0]), 0.0], window[1])
            size = np.array([wide, size[1]])
        return Camera(right, up, toward, window[0], size, PIXELS * across / float(size[0]))

    exact = ground.V is None
    if exact or np.linalg.norm(outer[1] - outer[0]) <= WHOLE * np.linalg.norm(inner[1] - inner[0]):
        return camera(outer, _WIDTH, _TALLEST), None, corners
    return camera(inner, _WIDTH, _TALLEST), camera(outer, _INSET, _INSET), corners


def _window(at: Floats, margin: float) -> tuple[Floats, Floats]:
    """Corners of a window around points (n, 2) with a margin that is a share of its larger side."""
    low, high = at.min(axis=0), at.max(axis=0)
    rim = margin * max(float((high - low).max()), 1e-6)
    return low - rim, high + rim


def looking(normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Return right, up and the way to the eye of a view upon a face: from its side, base z up."""
    level = np.array([normal[0], normal[1], 0.0])
    if np.linalg.norm(level) > 0.35 * np.linalg.norm(normal):
        n = unit(normal)
        aside = np.cross(np.array([0.0, 0.0, 1.0]), unit(level))
        toward = unit(n + 0.5 * aside + np.array([0.0, 0.0, 0.45]))
    else:
        side = -1.0 if normal[2] < 0.0 else 1.0
        toward = unit(np.array([0.45, -0.75, 1.0 * side]))
    right = unit(np.cross(np.array([0.0, 0.0, 1.0]), toward))
    return right, np.cross(toward, right), toward


def _scene(
    axes: Axes,
    camera: Camera,
    corners: Floats,
    placed: Sequence[PlacedCurve],
    taught: Sequence[PlottedCurve],
    ids: Sequence[tuple[str, Floats]],
) -> bool:
    """Draw the part and the strokes; tell whether any of them is hidden somewhere."""
    picture = rendered(corners, camera)
    _image(axes, picture, camera)
    by = HIDDEN * float(np.linalg.norm(camera.size))
    curves = [*taught, *(one.curve for one in placed)]
    any_hidden = False
    for curve, share in zip(curves, drawing.shares(len(curves)), strict=True):
        at = camera.seen(curve.position)
        hidden = picture.hides(camera, curve.position, by)
        any_hidden |= bool(hidden.any())
        apart = gaps.gaps(curve.t)
        for rows in runs(hidden):
            gaps.line(
                axes, at[rows, 0], at[rows, 1], apart[rows.start : rows.stop - 1],
                color=curve.style.color, ls=curve.style.line, lw=curve.style.width,
                alpha=_PALE if hidden[rows.start] else 1.0, zorder=curve.style.order + 10,
                solid_capstyle="round",
            )  # fmt: skip
        drawing.number(axes, at[:, 0], at[:, 1], curve, share)
    shown: list[Floats] = []
    for one in placed:
        ends = np.stack([one.stroke.start, one.stroke.goal])
        if any(np.abs(ends - other).max() < 1.0 for other in shown):
            continue
        shown.append(ends)
        at = camera.seen(ends)
        drawing.ends(axes, at[0], at[1])
    first = camera.seen(placed[0].curve.position)
    if len(shown) == 1:
        drawing.heading(axes, first[:, 0], first[:, 1], placed[0].curve.style)
    for text, point in ids:
        at = camera.seen(point[None])[0]
        axes.annotate(
            text, (float(at[0]), float(at[1])), (5, 4), textcoords="offset points", fontsize=7.0,
            bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7},
            zorder=41,
        )  # fmt: skip
    _axes_of(axes, camera)
    return any_hidden


def _image(axes: Axes, picture: Picture, camera: Camera) -> None:
    grey = np.round(255.0 * picture.grey).astype(np.uint8)
    shown = np.dstack([grey, grey, grey, np.where(picture.there, 255, 0).astype(np.uint8)])
    h, w = picture.grey.shape
    extent = (0.0, w / camera.scale, 0.0, h / camera.scale)
    axes.imshow(shown, origin="lower", extent=extent, interpolation="none", zorder=0)
    axes.set(xlim=(0.0, camera.size[0]), ylim=(0.0, camera.size[1]), xticks=[], yticks=[])
    axes.set_aspect("equal", adjustable="box")
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set(visible=True, color="#BBBBBB")


def _axes_of(axes: Axes, camera: Camera) -> None:
    """Draw the directions of base X, Y and Z, and a bar of a round length."""
    width = float(camera.size[0])
    arm = 0.055 * width
    foot = 0.085 * width
    for name, along in zip("XYZ", np.eye(3), strict=True):
        x, y = float(along @ camera.right), float(along @ camera.up)
        if np.hypot(x, y) < 0.15:
            continue
        axes.annotate(
            "", (foot + arm * x, foot + arm * y), (foot, foot), zorder=50,
            arrowprops={"arrowstyle": "-|>", "color": "#333333", "lw": 0.9, "mutation_scale": 7.0},
        )  # fmt: skip
        axes.text(
            foot + 1.32 * arm * x, foot + 1.32 * arm * y, name, fontsize=7.0, ha="center",
            va="center", zorder=50,
        )  # fmt: skip
    bar = round_length(0.22 * width)
    right, low = 0.96 * width, 0.035 * width
    axes.plot([right - bar, right], [low, low], color="#333333", lw=2.0, zorder=50)
    axes.text(
        right - 0.5 * bar, low + 0.008 * width, f"{bar:g} mm", fontsize=7.0, ha="center",
        va="bottom", zorder=50,
    )  # fmt: skip


def round_length(about: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not above a length."""
    power = 10.0 ** np.floor(np.log10(about))
    return float(max(m for m in (1.0, 2.0, 5.0) if m * power <= about) * power)


def _inset(
    figure: Figure, bottom: float, tall: float, whole: Camera, camera: Camera, corners: Floats
) -> None:
    """Draw the whole part small, and which piece of it the large picture shows."""
    width, height = whole.size * _INSET / whole.size[0]
    left = _LEFT + _WIDTH - width - 0.05
    axes = drawing.panel(figure, left, bottom + tall - height - 0.05, width, height)
    axes.set_facecolor("white")
    _image(axes, rendered(corners, whole), whole)
    x, y = (camera.low - whole.low).tolist()
    wide, high = camera.size.tolist()
    axes.add_patch(Rectangle((x, y), wide, high, fill=False, ec="#D55E00", lw=1.2, zorder=60))


def runs(marks: Booleans) -> list[slice]:
    """Stretches of equal marks (n,), each up to and with the first sample of the next."""
    cuts = np.flatnonzero(marks[1:] != marks[:-1]) + 1
    borders = [0, *cuts.tolist(), len(marks) - 1]
    return [slice(a, b + 1) for a, b in pairwise(borders)]
