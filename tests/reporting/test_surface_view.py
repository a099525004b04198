"""Strokes on a curved surface: what is measured of them, and their picture in space."""

from dataclasses import replace

import numpy as np
import pytest

from dmpcli.records.learning_record import Lesson
from dmpcli.reporting import document
from dmpcli.reporting import paper_figures as figures
from dmpcli.reporting.report_surface import ReportSurface, placed
from dmpcli.reporting.stroke_measures import row_of
from dmpcli.reporting.strokes import strokes_of
from dmpcli.reporting.surface_picture import MOST_FACES, picture
from dmpcli.reporting.surface_view import surface_view
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from tests.reporting.example_files import (
    CURVED_GOAL,
    CURVED_START,
    curved_trajectory,
    demonstrated,
    demonstration,
    fillet_mesh,
    fillet_wave,
    run,
    trajectory,
    wave,
)


@pytest.fixture(scope="module")
def ground():
    V, F = fillet_mesh()
    return ReportSurface("fillet.stl", Mesh(V, F), V, F)


def taught(path=None, lesson=None):
    record = demonstration(path)
    return demonstrated(
        Trajectory(record.t, record.position()),
        "demo",
        None,
        record.provenance,
        lesson,
    )


def modified(height=50.0):
    path, normal = fillet_wave(height)
    e_x = np.tile([1.0, 0.0, 0.0], (len(path), 1))
    rotation = np.stack([e_x, np.cross(-normal, e_x), -normal], axis=-1)
    (stroke,) = strokes_of(curved_trajectory(path, normal, rotation), "modified")
    return stroke


def original():
    path = wave(CURVED_START, CURVED_GOAL, 45.0)
    record = curved_trajectory(path, model="original", forcing_scale="distance")
    return strokes_of(record, "original")[0]


@pytest.mark.slow
def test_a_stroke_on_the_mesh_is_measured_along_it(ground):
    # Chords of 2 mm on a radius of 86.774 mm lie 0.006 mm inside it.
    row = row_of(placed([modified(49.98)], ground, taught())[0], taught())
    lies = row["surface"]
    assert lies["distance_max"] < 0.0065
    assert lies["wave_height"] == pytest.approx(49.98, abs=0.02)
    assert row["wave"]["mean"] == lies["wave_height"]
    assert lies["tilt_max"] < 0.05
    assert (lies["start_error"], lies["goal_error"]) == pytest.approx((0, 0), abs=0.01)
    # A cylinder unrolls without stretch, and so the wave is the taught one, made shorter.
    assert abs(lies["stretch_least"]) < 2e-3
    assert abs(lies["stretch_largest"]) < 2e-3
    assert lies["length_change"] == pytest.approx(0.0, abs=2e-3)
    assert row["deviation"]["nearest_max"] < 0.05
    assert lies["remark"] is None


@pytest.mark.slow
def test_the_originals_failure_stands_beside_it(ground):
    stroke = original()
    # Closed form: a stroke in the plane of its two ends, against the circle below it.
    y, z = stroke.position[:, 1], stroke.position[:, 2]
    off = np.hypot(y - 5.106, z - (-17.54 - 86.774)) - 86.774
    lies = row_of(placed([stroke], ground, None)[0], None)["surface"]
    assert lies["distance_max"] > 5.0
    assert lies["height_largest"] == pytest.approx(off.max(), abs=0.01)
    assert lies["height_least"] == pytest.approx(off.min(), abs=0.01)


@pytest.mark.slow
def test_the_demonstrations_own_height_is_taken_off(ground):
    lift = 0.2 * np.sin(np.linspace(0, np.pi, 501)) ** 2
    path, normal = fillet_wave(49.979)
    record = curved_trajectory(path + lift[:, None] * normal, normal)
    (stroke,) = strokes_of(record, "lifted")
    # On the plane of the skill: the one that the path alone tells leans over the lift.
    reference = taught(wave() + lift[:, None] * [0.0, 0.0, 1.0], Lesson(normal=(0.0, 0.0, 1.0)))
    alone = placed([stroke], ground, None)[0].footing
    beside = placed([stroke], ground, reference)[0].footing
    assert alone.distance.max() == pytest.approx(0.2, abs=0.01)
    assert beside.lifted == pytest.approx(0.2, abs=0.02)
    assert beside.distance.max() < 0.03


@pytest.mark.slow
def test_a_run_of_a_curved_stroke_is_measured_along_the_surface(ground):
    path, normal = fillet_wave(50.0)
    (drawn,) = strokes_of(run(curved_trajectory(path, normal)), "run")
    assert placed([drawn], ground, None)[0].wave.mean == pytest.approx(50.0, abs=0.02)


@pytest.mark.slow
def test_strokes_beside_the_mesh_say_why_they_have_no_wave_height(ground):
    V, F = ground.V, ground.F
    near = np.abs(V[F].mean(axis=1)[:, 1] + 40.0) < 15.0
    strip = ReportSurface("strip.stl", Mesh(V, F[near]), V, F[near])
    whole = modified()
    stroke = replace(
        whole, position=whole.position[::8], raw=whole.raw[::8], t=whole.t[::8], rotation=None
    )
    footing = placed([stroke], strip, None)[0].footing
    assert footing.wave is None
    assert "leaves the mesh" in footing.remark


@pytest.mark.thorough
def test_strokes_are_measured_together_as_each_alone(ground):
    many = [modified(30.0), original(), modified(49.98)]
    short = modified(49.98)
    many.append(
        replace(
            short, position=short.position[::2], raw=short.raw[::2], t=short.t[::2], rotation=None
        )
    )
    for stroke, together in zip(many, placed(many, ground, taught()), strict=True):
        (alone,) = placed([stroke], ground, taught())
        np.testing.assert_allclose(together.footing.uv, alone.footing.uv, atol=1e-9)
        np.testing.assert_allclose(together.wave.heights, alone.wave.heights, atol=1e-9)


def said_of(stroke, ground):
    part = document.DocumentPart("stroke", "0" * 64, "trajectory", [stroke])
    return " ".join(document.as_text(document.document([part], {"file": ground.label}), 80).split())


@pytest.mark.slow
@pytest.mark.parametrize("flat", [True, False])
def test_ends_planned_off_the_surface_are_remarked_on(ground, flat):
    if flat:
        ground = ReportSurface(
            "plane.json", Plane(np.array([0.0, 0.0, -40.0]), np.array([0.0, 0.0, 1.0]))
        )
    stroke = modified()
    shift = np.array([0.0, 0.0, 25.0])
    high = replace(stroke, position=stroke.position + shift, start=stroke.start + shift)
    (done,) = placed([high], ground, None)
    off = [float(ground.surface.closest(p[None]).distance[0]) for p in (high.start, high.goal)]
    assert min(off) > 1.0 or not flat
    said = said_of(done, ground)
    text = f"planned to start {off[0]:.1f} mm and to end {off[1]:.1f} mm off this surface"
    assert text in said
    (near,) = placed([modified()], ground, None)
    said = said_of(near, ground)
    assert ("planned to start" in said) == flat


@pytest.fixture(scope="module")
def strokes(ground):
    reference = taught()
    return placed([reference, modified(), original()], ground, reference)


@pytest.mark.thorough
def test_figure_9_is_drawn_the_same_twice(strokes, ground):
    files = figures.gallery(strokes, ground)
    assert {"fig9_surface.svg", "fig9_surface.png"} <= set(files)
    again = figures.gallery(strokes, ground)
    assert files["fig9_surface.svg"] == again["fig9_surface.svg"]
    assert files["fig9_surface.png"] == again["fig9_surface.png"]
    svg = files["fig9_surface.svg"].decode().lower()
    assert all(color in svg for color in ("#000000", "#e69f00", "#009e73"))


@pytest.mark.slow
def test_a_millimetre_is_as_long_along_x_as_along_z(strokes, ground):
    figure = surface_view(strokes[1:], ground, strokes[0])
    view = figure.axes[0]
    size = [np.ptp(limits) for limits in (view.get_xlim(), view.get_ylim(), view.get_zlim())]
    aspect = view._box_aspect
    assert aspect / aspect[0] == pytest.approx(np.array(size) / size[0])


@pytest.mark.slow
def test_the_panel_shows_the_distance_over_time(strokes, ground):
    panel = surface_view(strokes[1:], ground, strokes[0]).axes[1]
    on, off = panel.lines
    assert np.abs(on.get_ydata()).max() < 0.01
    assert on.get_xdata()[-1] == pytest.approx(10.0)
    assert np.ptp(off.get_ydata()) > 10.0


@pytest.mark.slow
def test_a_demonstration_far_away_is_left_out(strokes, ground):
    far = taught(wave() + np.array([0.0, 5000.0, 0.0]))
    names = [
        [text.get_text() for text in surface_view(strokes[1:], ground, r).legends[0].texts]
        for r in (strokes[0], far)
    ]
    assert any("demonstration" in name for name in names[0])
    assert not any("demonstration" in name for name in names[1])


@pytest.mark.slow
def test_what_is_drawn_of_a_mesh_ends_at_the_box_and_is_coarse_enough():
    V, F = fillet_mesh(step=0.05)
    fine = ReportSurface("fine.stl", Mesh(V, F), V, F)
    low, high = np.array([-640.0, -60.0, -70.0]), np.array([-560.0, 30.0, 0.0])
    polygons = picture(fine, low, high)
    points = np.vstack(polygons)
    assert len(F) > 10 * MOST_FACES
    assert 200 < len(polygons) < 2 * MOST_FACES
    assert np.all((points > low - 1e-9) & (points < high + 1e-9))
    assert np.ptp(points[:, 0]) == pytest.approx(80.0)
    # Merged corners stay within a cell's size of the surface.
    off = np.hypot(points[:, 1] - 5.106, points[:, 2] + 104.314) - 86.774
    assert np.abs(off[points[:, 1] < 0.0]).max() < 2.0


def test_a_plane_is_a_surface_too():
    level = ReportSurface(
        "plane.json", Plane(np.array([0.0, 0.0, -17.54]), np.array([0.0, 0.0, 1.0]))
    )
    (stroke,) = strokes_of(trajectory(wave(height=40.0)), "flat")
    done = placed([stroke], level, None)[0]
    assert done.footing.wave.mean == pytest.approx(done.wave.mean, abs=1e-3)
    low, high = np.zeros(3) - 20.0, np.zeros(3) + 20.0
    area = np.concatenate([p[:, 2] for p in picture(level, low, high)])
    assert area == pytest.approx(-17.54)
    assert len(surface_view([done], level, None).axes) == 2
