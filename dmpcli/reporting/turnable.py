"""A part that can be turned: one page with the mesh, the strokes on it and what was measured.

k3d draws it with WebGL in a browser; its code, three megabytes, lies packed in the page, which
needs no network. The page says no date and numbers its objects itself, so that the same strokes
give the same bytes.
"""

import base64
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib import resources
from string import Template
from typing import Any

import numpy as np

from dmpcli import extras
from dmpcli.arrays import Floats
from dmpcli.records.record import Record
from dmpcli.reporting import contact
from dmpcli.reporting.curve_names import short, speed_of
from dmpcli.reporting.part_figure import looking
from dmpcli.reporting.report_surface import ReportSurface
from dmpcli.reporting.stroke import ReportedStroke
from dmpcli.reporting.style import STYLES
from dmpcli.reporting.surface_picture import sheet

MOST_STROKES = 200
"""Strokes that are shown; of more, an even choice."""

MOST_IDS = 60
"""Strokes whose names stand beside their starts; of more, every so many."""

STEPS = 120
"""Times at which the slider has the tool exactly; between them it goes straight."""

AXES = 12
"""Places of a stroke where the tool's axis is drawn."""

_GREY, _AXIS, _START, _GOAL, _TIP = 0xC9CCD1, 0x6A6A6A, 0x009E73, 0xD40000, 0x000000
_LEVEL = 6
_PLACES = 6
"""Of what colours stand for, in mm, mm/s and N: less is rounding."""


def check() -> None:
    """Refuse before any work where what draws the page is not installed.

    Raises
    ------
    InputError
    """
    extras.load(extras.VIEW, "--view", "k3d")


@dataclass(frozen=True)
class Quantity:
    """What strokes are coloured by.

    Attributes
    ----------
    name, unit : str
    values : list of array, shape (n,)
        Of each stroke; NaN where it is not known.
    """

    name: str
    unit: str
    values: list[Floats]

    @property
    def limits(self) -> tuple[float, float]:
        """Least and largest value; a little apart even where all are alike."""
        every = np.concatenate(self.values)
        low, high = (
            round(float(one), _PLACES) + 0.0 for one in (np.nanmin(every), np.nanmax(every))
        )
        return low, high if high > low else low + 1.0


def page(
    strokes: Sequence[ReportedStroke], ground: ReportSurface | None, runs: Sequence[Record] = ()
) -> bytes:
    """Return the page.

    Parameters
    ----------
    strokes : sequence of ReportedStroke
        In the order of the command line.
    ground : ReportSurface, optional
    runs : sequence of Record
        For the forces of their strokes, in the order of the command line.

    Raises
    ------
    InputError
        The extra is not installed.
    """
    (k3d,) = extras.load(extras.VIEW, "--view", "k3d")
    chosen = list(strokes)[:: max(1, -(-len(strokes) // MOST_STROKES))]
    size = float(np.linalg.norm(np.ptp(np.vstack([s.position for s in chosen]), axis=0))) or 1.0
    plot = k3d.plot(
        grid_visible=True, menu_visibility=False, colorbar_object_id=0, axes=["X", "Y", "Z"],
        camera_auto_fit=False, lighting=1.15, background_color=0xFFFFFF,
        grid_color=0xE0E0E0, name="dmpcli",
    )  # fmt: skip
    if ground is not None:
        _add_part(k3d, plot, chosen, ground, size)
    _add_lines(k3d, plot, chosen, size)
    found = quantities(chosen, runs)
    groups = [_add_strokes(k3d, plot, chosen, one, size, i == 0) for i, one in enumerate(found)]
    _add_ends(k3d, plot, chosen, size)
    last = _add_tool(k3d, plot, chosen, size)
    plot.camera = _camera(chosen, size)
    for number, thing in enumerate(plot.objects, start=1):
        thing.id = number
    names = [int(thing.id) for thing in plot.objects if thing.type == "Text"]
    title = ", ".join(short(stroke.label) for stroke in chosen[:4])
    title += ", …" if len(chosen) > 4 else ""
    on = f" on {ground.label}" if ground is not None else ""
    words = [
        {
            "name": one.name,
            "unit": one.unit,
            "low": one.limits[0],
            "high": one.limits[1],
            "object": int(thing.id),
        }
        for one, thing in zip(found, groups, strict=True)
    ]
    text = _PAGE.substitute(
        title=escape(f"{title}{on}"),
        fflate=_static("fflate.js"),
        require=_static("require.js"),
        source=_packed_source(),
        data=_text(plot.get_binary_snapshot(_LEVEL)),
        quantities=json.dumps(words).replace("<", "\\u003c"),
        names=json.dumps(names),
        last=f"{last:g}",
        gradient=", ".join(_gradient(k3d)),
    )
    return text.encode()


def quantities(strokes: Sequence[ReportedStroke], runs: Sequence[Record]) -> list[Quantity]:
    """Return what strokes can be coloured by: distance to the surface, speed, force."""
    found = []
    if any(stroke.footing for stroke in strokes):
        heights = [s.footing.height if s.footing else np.full(len(s.t), np.nan) for s in strokes]
        found.append(Quantity("off the surface", "mm", heights))
    found.append(Quantity("speed", "mm/s", [speed_of(s.t, s.position) for s in strokes]))
    forces = _forces(strokes, runs)
    if forces is not None:
        found.append(Quantity("force along the normal", "N", forces))
    return found


def _forces(strokes: Sequence[ReportedStroke], runs: Sequence[Record]) -> list[Floats] | None:
    """Force at each sample of the strokes of runs; None where none was felt."""
    felt: list[tuple[Floats, Floats]] = []
    for run in runs:
        force = contact.force_along_normal(run)
        if force is not None:
            felt.append((run.position(), force))
    if not felt:
        return None
    found = []
    for stroke in strokes:
        values = np.full(len(stroke.t), np.nan)
        if stroke.kind == "run":
            for position, force in felt:
                # A stroke's samples are rows of its run.
                rows = {row.tobytes(): i for i, row in enumerate(np.ascontiguousarray(position))}
                at = [rows.get(p.tobytes()) for p in np.ascontiguousarray(stroke.position)]
                if all(i is not None for i in at):
                    values = force[np.array(at, dtype=np.int64)]
                    break
        found.append(values)
    return found if any(np.isfinite(values).any() for values in found) else None


def _add_part(
    k3d: Any, plot: Any, strokes: Sequence[ReportedStroke], ground: ReportSurface, size: float
) -> None:
    if ground.V is None or ground.F is None:
        points = np.vstack([stroke.position for stroke in strokes])
        corners = sheet(ground, points.min(axis=0) - 0.3 * size, points.max(axis=0) + 0.3 * size)
        V, F = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    else:
        V, F = ground.V, ground.F
    plot += k3d.mesh(
        V.astype(np.float32), F.astype(np.uint32), color=_GREY, side="double", flat_shading=True,
        name=ground.label,
    )  # fmt: skip


def _add_lines(k3d: Any, plot: Any, strokes: Sequence[ReportedStroke], size: float) -> None:
    """Add all strokes as thin lines, which show where nothing is known to colour them by."""
    points = np.vstack([stroke.position for stroke in strokes])
    begins = np.cumsum([0, *(len(stroke.t) for stroke in strokes)])
    first = np.setdiff1d(np.arange(len(points)), begins[1:] - 1)
    plot += k3d.lines(
        points.astype(np.float32), np.column_stack([first, first + 1]).astype(np.uint32),
        indices_type="segment", color=_AXIS, width=0.004 * size, shader="thick", name="strokes",
    )  # fmt: skip


def _add_strokes(
    k3d: Any, plot: Any, strokes: Sequence[ReportedStroke], one: Quantity, size: float, first: bool
) -> Any:
    """Add all strokes, coloured by one quantity; where it is not known they are not drawn."""
    points, pairs, values, begin = [], [], [], 0
    for stroke, value in zip(strokes, one.values, strict=True):
        known = np.isfinite(value)
        n = len(stroke.t)
        segments = np.column_stack([np.arange(n - 1), np.arange(1, n)]) + begin
        pairs.append(segments[known[1:] & known[:-1]])
        points.append(stroke.position)
        values.append(np.where(known, value, 0.0))
        begin += n
    drawn = k3d.lines(
        np.vstack(points).astype(np.float32), np.vstack(pairs).astype(np.uint32),
        indices_type="segment", attribute=np.concatenate(values).astype(np.float32),
        color_map=k3d.colormaps.matplotlib_color_maps.Viridis, color_range=list(one.limits),
        width=0.008 * size, shader="thick", name=one.name, visible=first,
    )  # fmt: skip
    plot += drawn
    return drawn


def _add_ends(k3d: Any, plot: Any, strokes: Sequence[ReportedStroke], size: float) -> None:
    for name, colour, ends in (
        ("start", _START, [stroke.start for stroke in strokes]),
        ("goal", _GOAL, [stroke.goal for stroke in strokes]),
    ):
        plot += k3d.points(
            np.array(ends, dtype=np.float32), point_size=0.03 * size, color=colour, shader="3d",
            name=name,
        )  # fmt: skip
    for at, name in _labels(strokes):
        plot += k3d.text(
            escape(name), position=at, color=0x000000, size=0.7, reference_point="lb",
            label_box=True, is_html=True, name=name,
        )  # fmt: skip


def _labels(strokes: Sequence[ReportedStroke]) -> list[tuple[list[float], str]]:
    """Where names stand, and those of all strokes that begin there."""
    found: list[tuple[Floats, list[str]]] = []
    for stroke in strokes[:: max(1, -(-len(strokes) // MOST_IDS))]:
        names = next((n for at, n in found if np.linalg.norm(at - stroke.start) < 1.0), None)
        if names is None:
            found.append((stroke.start, [_name(stroke)]))
        else:
            names.append(_name(stroke))
    return [(at.tolist(), ", ".join(names)) for at, names in found]


def _name(stroke: ReportedStroke) -> str:
    what = STYLES[stroke.role].name
    return f"{short(stroke.label)}: {what}" if "[" not in stroke.label else short(stroke.label)


def _add_tool(k3d: Any, plot: Any, strokes: Sequence[ReportedStroke], size: float) -> float:
    """Add the tool's axis along each stroke, and the tool that the slider moves; return the end."""
    arm = 0.12 * size
    rows = [np.linspace(0, len(s.t) - 1, AXES).astype(int) for s in strokes]
    turned = [(s, at) for s, at in zip(strokes, rows, strict=True) if s.rotation is not None]
    if turned:
        feet = np.vstack([s.position[at] for s, at in turned])
        back = np.vstack([s.rotation[at, :, 2] for s, at in turned if s.rotation is not None])
        plot += _bars(k3d, feet, feet - arm * back, _AXIS, 0.002 * size, "tool axes")
    last = max(float(stroke.t[-1]) for stroke in strokes)
    tips: dict[str, Floats] = {}
    for t in np.linspace(0.0, last, STEPS):
        tips[f"{t:.6g}"] = np.array([_at(s, t) for s in strokes], dtype=np.float32)
    plot += k3d.points(tips, point_size=0.022 * size, color=_TIP, shader="3d", name="tool")
    return last


def _at(stroke: ReportedStroke, t: float) -> Floats:
    return np.array([np.interp(t, stroke.t, axis) for axis in stroke.position.T])


def _bars(k3d: Any, feet: Floats, ends: Floats, colour: int, width: float, name: str) -> Any:
    points = np.stack([feet, ends], axis=1).reshape(-1, 3)
    pairs = np.arange(len(points)).reshape(-1, 2)
    return k3d.lines(
        points.astype(np.float32), pairs.astype(np.uint32), indices_type="segment", color=colour,
        width=width, shader="thick", name=name,
    )  # fmt: skip


def _camera(strokes: Sequence[ReportedStroke], size: float) -> list[float]:
    """Return where the eye is, what it looks at, and what is up: the strokes from their side."""
    normals = [s.footing.normal.mean(axis=0) for s in strokes if s.footing and s.bound]
    normals += [s.axes[:, 2] for s in strokes if s.axes is not None and not normals]
    normal = np.mean(normals, axis=0) if normals else np.array([0.0, 0.0, 1.0])
    _, up, toward = looking(normal)
    points = np.vstack([stroke.position for stroke in strokes])
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    eye = middle + 1.3 * max(size, 1e-3) * toward
    return [float(x) for x in (*eye, *middle, *up)]


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode()


@cache
def _static(name: str) -> str:
    return (resources.files("k3d") / "static" / name).read_text(encoding="utf-8")


@cache
def _packed_source() -> str:
    return _text(zlib.compress(_static("standalone.js").encode(), _LEVEL))


def _gradient(k3d: Any) -> list[str]:
    """Return the colours of the scale as CSS has them."""
    stops = np.array(k3d.colormaps.matplotlib_color_maps.Viridis).reshape(-1, 4)
    some = stops[np.linspace(0, len(stops) - 1, 9).astype(int)]
    return [
        "rgb({:.0f} {:.0f} {:.0f}) {:.0f}%".format(*(255.0 * stop[1:]), 100.0 * stop[0])
        for stop in some
    ]


_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>$title</title>
<style>
* { box-sizing: border-box; }
html, body { margin: 0; height: 100%; overflow: hidden; background: #fff; color: #1b1b1b;
  font: 15px/1.4 system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif; }
body { display: flex; flex-direction: column; }
header { padding: .5rem .8rem; border-bottom: 1px solid #ccc; display: flex; flex-wrap: wrap;
  gap: .3rem 1.2rem; align-items: center; }
h1 { font-size: 1rem; margin: 0; flex: 1 1 100%; overflow-wrap: anywhere; }
#part { flex: 1 1 auto; position: relative; min-height: 0; }
#part > * { width: 100%; height: 100%; }
label { display: flex; align-items: center; gap: .5rem; }
select, input { font: inherit; }
#when { flex: 1 1 14rem; }
#when input { flex: 1 1 6rem; min-width: 6rem; }
output { min-width: 4.5em; font-variant-numeric: tabular-nums; }
.scale { display: flex; align-items: center; gap: .4rem; font-variant-numeric: tabular-nums; }
.scale i { display: inline-block; width: 7rem; height: .8rem;
  background: linear-gradient(to right, $gradient); }
.key b { display: inline-block; width: .75em; height: .75em; border-radius: 50%; }
.key { white-space: nowrap; }
</style>
</head>
<body>
<header>
<h1>$title</h1>
<label>coloured by <select id="by"></select></label>
<span class="scale"><span id="low"></span><i></i><span id="high"></span></span>
<label><input type="checkbox" id="named"> names</label>
<span class="key"><b style="background:#009e73"></b> start
<b style="background:#d40000"></b> goal <b style="background:#000"></b> tool</span>
<label id="when">time <input type="range" id="time" min="0" max="$last" step="any" value="0">
<output id="now">0.00 s</output></label>
</header>
<div id="part"></div>
<noscript>This page needs JavaScript and WebGL; report.html does without.</noscript>
<script>$fflate</script>
<script>$require</script>
<script>
const unpack = text => Uint8Array.from(atob(text), sign => sign.charCodeAt(0));
const quantities = $quantities;
const names = $names;
(0, eval)(fflate.strFromU8(fflate.unzlibSync(unpack('$source'))));
const draw = async lib => {
  const place = document.getElementById('part');
  const stored = lib.msgpackDecode(fflate.unzlibSync(unpack('$data')));
  const view = new lib.K3D(lib.ThreeJsProvider, place, { ...stored.plot, standaloneGUI: true });
  await view.setSnapshot(stored);
  const eye = stored.plot.camera;
  const farther = Math.max(1, Math.min(2, place.clientHeight / place.clientWidth));
  view.setCamera(eye.map((x, i) => i < 3 ? eye[i + 3] + farther * (x - eye[i + 3]) : x));
  const by = document.getElementById('by');
  quantities.forEach((one, i) => by.add(new Option(one.name, i)));
  const digits = value => Number(value.toPrecision(3));
  const choose = async () => {
    const chosen = quantities[by.value];
    const world = view.getWorld();
    for (const one of quantities) {
      const json = world.ObjectsListJson[one.object];
      if (json.visible !== (one === chosen)) {
        json.visible = one === chosen;
        await view.reload(json, { visible: json.visible }, false);
      }
    }
    document.getElementById('low').textContent = digits(chosen.low);
    document.getElementById('high').textContent = digits(chosen.high) + ' ' + chosen.unit;
    view.render();
  };
  by.addEventListener('change', choose);
  const named = document.getElementById('named');
  const name = async () => {
    const world = view.getWorld();
    for (const one of names) {
      const json = world.ObjectsListJson[one];
      if (json.visible !== named.checked) {
        json.visible = named.checked;
        await view.reload(json, { visible: json.visible }, false);
      }
    }
    view.render();
  };
  named.addEventListener('change', name);
  // On a phone many names would cover what they name.
  named.checked = place.clientWidth > 600 || names.length < 4;
  await name();
  const time = document.getElementById('time');
  time.addEventListener('input', async () => {
    document.getElementById('now').textContent = Number(time.value).toFixed(2) + ' s';
    await view.setTime(Number(time.value));
    view.render();
  });
  addEventListener('resize', () => view.resizeHelper && view.resizeHelper());
  await choose();
  document.body.dataset.drawn = 'yes';
};
// require.js takes no async function for one.
require(['k3d'], lib => { draw(lib); });
</script>
</body>
</html>
""")
