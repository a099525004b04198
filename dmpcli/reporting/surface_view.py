"""Strokes on a curved surface in space, and how far off it they are: the paper's Figure 9."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform

from dmpcli.arrays import Floats
from dmpcli.reporting import drawing
from dmpcli.reporting.drawing import PlottedCurve, curve_of
from dmpcli.reporting.part_figure import runs
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import STYLES
from dmpcli.reporting.surface_picture import picture, shades

_WIDTH, _PANEL = 5.9, 1.35
_LEFT, _RIGHT, _GAP, _TOP, _BOTTOM = 0.75, 0.2, 0.3, 0.3, 0.55
_WIDEST, _TALLEST, _ABOVE, _BELOW = 5.4, 4.2, 0.1, 0.5
_ASIDE = np.radians(50.0)

FAR = 4.0
"""A demonstration that would make the picture so many times larger is left out of it."""

STEMS = 26
"""Lines from a stroke that leaves the surface down to it; they show where it is over."""

LEAVES = 0.5
"""From this distance on a stroke has such lines, mm."""

BURIED = 0.4
"""Opacity of the parts of strokes inside the part."""

MARGIN = 0.06
"""Of the surface around the strokes, as a share of the picture's diagonal."""


def surface_view(
    strokes: Sequence[ReportedStroke],
    ground: ReportSurface,
    reference: ReportedStroke | None,
    plain: bool = False,
) -> Figure:
    """Draw strokes on their surface (a), and their distance to it over time (b).

    Parameters
    ----------
    strokes : sequence of ReportedStroke
        With their footing; at least one.
    ground : ReportSurface
    reference : ReportedStroke, optional
        The demonstration, drawn where it was taught unless that is far away.
    plain : bool
        Name roles only, for many strokes.
    """
    drawn = [(stroke, _curve(stroke, strokes, plain)) for stroke in strokes]
    curves = [curve for _, curve in drawn]
    taught = _taught(reference, strokes)
    shown = [*taught, *curves]
    key = list({curve.name: curve for curve in shown}.values())
    columns = 2
    foot = _BOTTOM + drawing.ROW * drawing.legend_rows(key, columns)
    scene = _scene(shown, strokes)
    tall = _ABOVE + scene.height + _BELOW
    figure = drawing.page(_LEFT + _WIDTH + _RIGHT, foot + _PANEL + _GAP + tall + _TOP)
    middle = foot + _PANEL + _GAP + _BELOW + 0.5 * scene.height
    _view(figure, middle, scene, shown, strokes, ground)

    panel = drawing.panel(figure, _LEFT, foot, _WIDTH, _PANEL)
    for stroke, curve in drawn:
        assert stroke.footing is not None
        drawing.draw(panel, stroke.t, stroke.footing.height, curve.style)
    heights = np.concatenate([s.footing.height for s in strokes if s.footing is not None])
    panel.set_ylim(drawing.spanned(min(0.0, float(heights.min())), max(0.0, float(heights.max()))))
    panel.set_xlim(0.0, max(float(stroke.t[-1]) for stroke in strokes))
    panel.set_xlabel("t / s")
    panel.set_ylabel("off the surface / mm\n(below 0: inside)")
    drawing.letter(panel, "b")
    drawing.legend(figure, key, columns)
    return figure


def _curve(stroke: ReportedStroke, strokes: Sequence[ReportedStroke], plain: bool) -> PlottedCurve:
    """Return the curve without marks, under its role, wave height on the surface and distance."""
    footing = stroke.footing
    assert footing is not None
    bare = curve_of(stroke)
    name = STYLES[stroke.role].name
    if plain:
        return bare.unmarked(name)
    if sum(other.role == stroke.role for other in strokes) > 1:
        name = f"{name} ({stroke.label})"
    mean = stroke.wave.mean if stroke.bound and footing.wave is not None else None
    height = "" if mean is None else f", {mean:.2f} mm"
    name = f"{name}{height}, off by {np.abs(footing.height).max():.3f} mm"
    return replace(bare, name=name, marks_t=bare.marks_t[:0], marks=bare.marks[:0])


def _taught(
    reference: ReportedStroke | None, strokes: Sequence[ReportedStroke]
) -> list[PlottedCurve]:
    """Return the demonstration where it was taught, unless that is far away."""
    if reference is None:
        return []
    alone = np.vstack([stroke.position for stroke in strokes])
    both = np.vstack([alone, reference.position])
    if np.linalg.norm(np.ptp(both, axis=0)) > FAR * np.linalg.norm(np.ptp(alone, axis=0)):
        return []
    bare = curve_of(reference)
    return [replace(bare, marks_t=bare.marks_t[:0], marks=bare.marks[:0])]


@dataclass(frozen=True)
class _Scene:
    """Box that is shown, mm; from where; its size on the page, inch, and inches per mm."""

    low: Floats
    high: Floats
    elevation: float
    azimuth: float
    height: float
    scale: float

    @property
    def toward(self) -> Floats:
        """Unit vector to the eye."""
        level = np.cos(self.elevation)
        return np.array(
            [
                level * np.cos(self.azimuth),
                level * np.sin(self.azimuth),
                np.sin(self.elevation),
            ]
        )


def _scene(curves: Sequence[PlottedCurve], strokes: Sequence[ReportedStroke]) -> _Scene:
    """Return the view: over the surface, never from below, turned so that its bend is seen."""
    feet = [s.footing.foot for s in strokes if s.footing is not None]
    points = np.vstack([*(curve.position for curve in curves), *feet])
    margin = MARGIN * float(np.linalg.norm(np.ptp(points, axis=0)))
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    bound = [s for s in strokes if s.bound] or strokes
    n = np.vstack([s.footing.normal for s in bound if s.footing is not None]).mean(axis=0)
    level = float(np.hypot(n[0], n[1]))
    azimuth = float(np.arctan2(n[1], n[0])) if level > 0.1 else -0.5 * np.pi
    elevation = float(np.clip(np.arctan2(n[2], level), np.radians(20.0), np.radians(35.0)))
    azimuth += _ASIDE
    size = high - low
    s, c = np.sin(azimuth), np.cos(azimuth)
    width = np.abs([-s, c]) @ size[:2]
    height = np.abs([c, s]) @ size[:2] * np.sin(elevation) + size[2] * np.cos(elevation)
    scale = float(min(_WIDEST / width, _TALLEST / height))
    return _Scene(low, high, elevation, azimuth, float(height) * scale, scale)


def _view(
    figure: Figure,
    middle: float,
    scene: _Scene,
    curves: Sequence[PlottedCurve],
    strokes: Sequence[ReportedStroke],
    ground: ReportSurface,
) -> None:
    low, high = scene.low, scene.high
    side = _LEFT + _WIDTH + _RIGHT
    axes = drawing.panel(
        figure, 0.0, middle - 0.5 * side, side, side,
        projection="3d", computed_zorder=False, proj_type="ortho",
    )  # fmt: skip
    assert isinstance(axes, Axes3D)
    axes.view_init(elev=np.degrees(scene.elevation), azim=np.degrees(scene.azimuth))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.set_box_aspect(high - low, zoom=scene.scale / _inches_per_mm(axes, scene))
    polygons = picture(ground, low, high)
    grey = shades(polygons, scene.toward)
    axes.add_collection3d(
        Poly3DCollection(polygons, facecolors=grey, edgecolors=grey - 0.06, lw=0.25, zorder=1)
    )
    for stroke in strokes:
        stems = Line3DCollection(
            _stems(stroke), colors=STYLES[stroke.role].color, lw=0.5, alpha=0.6, zorder=2
        )
        axes.add_collection3d(stems, autolim=False)
    # A demonstration, if shown, comes before the strokes.
    inside = [np.zeros(len(c.t), dtype=bool) for c in curves[: len(curves) - len(strokes)]]
    inside += [s.footing.height < -LEAVES for s in strokes if s.footing is not None]
    for curve, hidden in zip(curves, inside, strict=True):
        style = curve.style
        for rows in runs(hidden):
            axes.plot(
                *curve.position[rows].T, color=style.color, ls=style.line, lw=style.width,
                alpha=BURIED if hidden[rows.start] else 1.0, zorder=style.order + 10,
                solid_capstyle="round",
            )  # fmt: skip
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    named = ((axes.xaxis, "X", 9.0), (axes.yaxis, "Y", 9.0), (axes.zaxis, "Z", 3.0))
    for axis, name, away in named:
        axis.set_label_text(f"{name} / mm")
        axis.labelpad = away
        axis.set_major_locator(MaxNLocator(5, min_n_ticks=2))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    axes.tick_params(pad=0.0)
    buried = any(hidden.any() for hidden in inside)
    width, height = figure.get_size_inches()
    title = "(a)   pale: inside the part" if buried else "(a)"
    figure.text(_LEFT / width, 1.0 - 0.5 * _TOP / height, title, fontsize=8.0, va="center")


def _inches_per_mm(axes: Axes3D, scene: _Scene) -> float:
    """Scale of the picture across the line of sight."""
    across = np.array([-np.sin(scene.azimuth), np.cos(scene.azimuth), 0.0])
    ends = np.stack([scene.low, scene.low + across])
    x, y, _ = proj_transform(*ends.T, axes.get_proj())
    seen = axes.transData.transform(np.column_stack([x, y]))
    return float(np.linalg.norm(seen[1] - seen[0]) / axes.get_figure(root=True).dpi)


def _stems(stroke: ReportedStroke) -> Floats:
    """Return lines from a stroke that leaves the surface to its feet, shape (k, 2, 3)."""
    footing = stroke.footing
    assert footing is not None
    way = np.linalg.norm(np.diff(stroke.position, axis=0), axis=1).cumsum()
    at = np.searchsorted(way, np.linspace(0.0, way[-1], STEMS))
    at = at[np.abs(footing.height[at]) > LEAVES]
    return np.stack([stroke.position[at], footing.foot[at]], axis=1)
