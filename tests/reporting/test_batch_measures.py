"""Strokes of a batch measured together have the figures that each has on its own."""

import importlib.util
import pickle
import subprocess
import sys

import numpy as np
import pytest

from dmpcli import extras
from dmpcli.dmp.smoothing import Trajectory as Recording
from dmpcli.records import dataset, file_io, record, schemas
from dmpcli.reporting import stroke_measures
from dmpcli.reporting.batch import histogram, measure
from dmpcli.reporting.batch_measures import measured_parts, strokes_of_rows
from dmpcli.reporting.measurement_context import MeasurementContext
from dmpcli.reporting.report_surface import ReportSurface, placed
from dmpcli.reporting.stroke_block import FIGURES
from dmpcli.reporting.strokes import pairs_of, strokes_of
from dmpcli.spatial import rotations
from dmpcli.surfaces.cylinder import Cylinder
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.plane import Plane
from tests.extras_here import needs
from tests.reporting.batches import put_batch
from tests.reporting.example_files import (
    START,
    circle,
    demonstrated,
    fillet_mesh,
    fillet_wave,
    on_fillet,
    wave,
)

UP = [0.0, 0.0, 1.0]


def taught(path=None):
    path = wave() if path is None else path
    t = 0.02 * np.arange(len(path))
    return demonstrated(Recording(t, path, None), "demo")


def strokes(count=30, n=501, seed=3, **more):
    """Waves of differing height, periods, place and direction, on level ground, with some noise."""
    random = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        angle, length = random.uniform(0, 2 * np.pi), random.uniform(60.0, 200.0)
        start = START + random.uniform(-200, 200, 3) * [1, 1, 0]
        goal = start + length * np.array([np.cos(angle), np.sin(angle), 0.0])
        path = wave(start, goal, random.uniform(0.0, 60.0), random.integers(1, 4), n)
        path = path + 10.0 ** random.uniform(-9, -1) * random.standard_normal(path.shape)
        made.append({"t": 0.02 * np.arange(n), "path": path, "normal": UP} | more)
        made[-1]["ends"] = (start, goal)
    return made


def rows_one_by_one(folder, reference, ground=None, normal=None):
    """Figures of each stroke, measured on its own."""
    pairs = record.decode(file_io.read_table(folder), schemas.PAIRS)
    known, _ = pairs_of(pairs)
    found = []
    for name in sorted(path.name for path in folder.glob("part-*.parquet")):
        part = record.decode(file_io.read(folder / name), schemas.TRAJECTORY)
        found += strokes_of(part, "b", normal, known)
    if ground is not None:
        found = placed(found, ground, reference)
    table = []
    for stroke in found:
        row = stroke_measures.row_of(stroke, reference)
        flat = row | {"wave_height": row["wave"]["mean"], "wave_spread": row["wave"]["spread"]}
        flat |= row["deviation"] or {}
        flat |= {f"surface_{key}": value for key, value in (row["surface"] or {}).items()}
        table.append([flat.get(name) for name in FIGURES])
    return np.array(table, dtype=float)


def together(folder, reference, ground=None, normal=None, compiled=False):
    batch, odd = dataset.read(folder)
    assert odd == []
    sight = MeasurementContext(reference, ground, normal, compiled=compiled)
    return measure(batch, "b", sight, None, lambda _: None).table


def alike(folder, reference, *more):
    one, many = rows_one_by_one(folder, reference, *more), together(folder, reference, *more)
    np.testing.assert_allclose(many, one, rtol=1e-9, atol=1e-9)
    return many


def alike_by_kernels(folder, reference, ground=None, normal=None):
    """Check what kernels measure; charts of meshes are inverted to a part of 1e-8 mm."""
    one = rows_one_by_one(folder, reference, ground, normal)
    many = together(folder, reference, ground, normal, compiled=True)
    np.testing.assert_allclose(many, one, rtol=1e-8, atol=2e-8)
    return many


def column(table, name):
    return table[:, FIGURES.index(name)]


@pytest.mark.slow
def test_waves_of_any_height_noise_and_direction(tmp_path):
    folder = put_batch(tmp_path / "b", [strokes(20), strokes(25, seed=4)])
    table = alike(folder, taught())
    assert np.isfinite(column(table, "nearest_max")).all()
    # Some were too low to be waves, others have several heights.
    assert 0 < np.isnan(column(table, "wave_height")).sum() < 10
    assert (column(table, "wave_spread") > 0.0).any()


def test_strokes_near_to_the_demonstration_and_far_from_it(tmp_path):
    for height in (49.9, 50.5, 10.0, 120.0):
        near = [{"t": 0.02 * np.arange(501), "path": wave(height=height), "normal": UP}]
        folder = put_batch(tmp_path / f"b{height}", [near])
        alike(folder, taught())


def test_the_demonstration_itself_deviates_by_nothing(tmp_path):
    reference = taught()
    same = [{"t": 0.02 * np.arange(len(reference.t)), "path": reference.position, "normal": UP}]
    table = alike(put_batch(tmp_path / "b", [same]), reference)
    assert column(table, "nearest_max")[0] < 1e-9


def test_durations_rates_and_uneven_times(tmp_path):
    random = np.random.default_rng(1)
    mixed = strokes(6, n=251) + strokes(6, n=400, seed=9) + strokes(4, n=5, seed=2)
    for i, stroke in enumerate(mixed):
        stroke["t"] = stroke["t"] * (1.0 + 0.1 * (i % 3))
    mixed[3]["t"] = np.cumsum(random.uniform(0.01, 0.03, len(mixed[3]["t"])))
    table = alike(put_batch(tmp_path / "b", [mixed]), taught())
    assert len(set(column(table, "duration"))) > 5


def test_strokes_that_rest_before_they_move_or_never_do(tmp_path):
    rest = strokes(6)
    for stroke in rest:
        stroke["path"] = np.concatenate([np.repeat(stroke["path"][:1], 40, axis=0),
                                         stroke["path"][:-40]])  # fmt: skip
    rest[2]["path"] = np.repeat(rest[2]["path"][:1], 501, axis=0)
    table = alike(put_batch(tmp_path / "b", [rest]), taught())
    assert np.isnan(column(table, "ldlj")).sum() == 1


def test_closed_strokes_and_no_demonstration(tmp_path):
    ring = [{"t": 0.02 * np.arange(501), "path": circle(START + k), "normal": UP} for k in (0, 5)]
    table = alike(put_batch(tmp_path / "a", [ring], facts={"closed": True}), taught(circle()))
    assert np.isnan(column(table, "wave_height")).all()
    alike(put_batch(tmp_path / "b", [ring]), taught())
    table = alike(put_batch(tmp_path / "c", [strokes(5)]), None)
    assert np.isnan(column(table, "nearest_rms")).all()


def test_planes_that_nobody_names_are_fitted(tmp_path):
    plain = [{key: s[key] for key in ("t", "path")} for s in strokes(5)]
    alike(put_batch(tmp_path / "b", [plain]), taught())


@pytest.mark.slow
def test_on_a_plane_that_is_given(tmp_path):
    normal = np.array([0.0, 0.1, 1.0]) / np.linalg.norm([0.0, 0.1, 1.0])
    plane = Plane(START - [0.0, 0.0, 2.0], normal)
    folder = put_batch(tmp_path / "b", [strokes(70)])
    table = alike(folder, taught(), ReportSurface("plane", plane), normal)
    assert np.isfinite(column(table, "surface_distance_max")).all()


@needs(extras.FAST)
@pytest.mark.thorough
@pytest.mark.parametrize("end", [{"closed": True}, {"end_heights": [3.0, 0.5]}, {}, {"band": 1}])
def test_kernels_measure_strokes_of_all_kinds_as_each_is_measured(tmp_path, end):
    normal = np.array([0.0, 0.1, 1.0]) / np.linalg.norm([0.0, 0.1, 1.0])
    plane = ReportSurface("plane", Plane(START - [0.0, 0.0, 2.0], normal))
    mixed = strokes(9, n=251) + strokes(8, n=400, seed=9) + strokes(4, n=5, seed=2)
    mixed[3]["path"] = np.repeat(mixed[3]["path"][:1], 251, axis=0)
    for i, stroke in enumerate(mixed):
        turn = 0.2 * np.sin(stroke["t"] + i)
        stroke["euler"] = np.stack([np.pi + turn, 0.5 * turn, turn], axis=-1)
        stroke["path"] = stroke["path"] + 3.0 * np.sin(stroke["t"] / 7.0)[:, None] * normal
    if "closed" in end:
        mixed += [{**mixed[0], "path": circle(START)[:251], "ends": (START, START)}]
    facts = {"over_surface": {"band": 1.0, "removed": 0.0, "offset": 0.0}} if "band" in end else end
    folder = put_batch(tmp_path / "b", [mixed], facts=facts)
    reference = taught(circle()) if "closed" in end else taught()
    alike_by_kernels(folder, reference)
    alike_by_kernels(folder, reference, plane, normal)
    alike_by_kernels(folder, None, plane, normal)


@pytest.mark.thorough
def test_on_a_mesh(tmp_path):
    mesh = Mesh(*fillet_mesh())
    made = []
    for height in np.linspace(30.0, 55.0, 6):
        path, normals = fillet_wave(height, n=201)
        axis = np.cross(normals, [1.0, 0.0, 0.0])
        R = np.stack([np.broadcast_to([1.0, 0, 0], path.shape), -axis, -normals], axis=-1)
        euler = rotations.to_euler_continuous(R)
        made.append({"t": 0.05 * np.arange(201), "path": path, "normals": normals, "euler": euler})
    # Both snap to one place on the border, between which there is no chart.
    off = on_fillet(np.array([[-900.0, 10.0], [-950.0, 10.0]]))[0]
    made[2] = made[2] | {"ends": off}
    folder = put_batch(tmp_path / "b", [made[:4], made[4:]])
    ground = ReportSurface("fillet", mesh, mesh.V, mesh.F)
    table = alike(folder, taught(), ground, None)
    if importlib.util.find_spec("numba"):
        alike_by_kernels(folder, taught(), ground)
    assert np.isnan(column(table, "nearest_rms")).sum() == 1
    assert column(table, "surface_tilt_max")[0] < 1.0
    # Without the surface a stroke that is not plane has no wave height.
    assert np.isnan(column(alike(folder, taught()), "wave_height")).all()


def around_a_cylinder(folder, model, count):
    """Put a batch of strokes on a cylinder into a folder; return it, and the surface."""
    radius = 400.0
    tube = Cylinder(START - [0.0, 0.0, radius], np.array([1.0, 0.0, 0.0]), radius)
    made = strokes(count, n=101)
    for i, stroke in enumerate(made):
        hits = tube.closest(stroke["path"])
        stroke["path"] = hits.position + 0.2 * i * hits.normal
        stroke["normals"] = hits.normal
        stroke["ends"] = (stroke["path"][0] + [0.0, 0.0, 0.1], stroke["path"][-1])
        turn = np.stack([np.sin(stroke["t"]), np.zeros(101), np.zeros(101)], axis=-1)
        stroke["euler"] = np.array([np.pi, 0.0, 0.0]) + 0.3 * turn
        del stroke["normal"]
    return put_batch(folder, [made], facts={"model": model}), ReportSurface("tube", tube)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["modified", "original"])
@pytest.mark.parametrize("count", [1, 5])
def test_on_a_cylinder(tmp_path, model, count):
    folder, tube = around_a_cylinder(tmp_path / "b", model, count)
    table = alike(folder, taught(), tube, None)
    assert np.isfinite(column(table, "surface_tilt_mean")).all()
    assert np.isfinite(column(table, "surface_length_change")).all()


@needs(extras.FAST)
@pytest.mark.thorough
@pytest.mark.parametrize("model", ["modified", "original"])
@pytest.mark.parametrize("count", [1, 5])
def test_kernels_measure_strokes_on_a_cylinder_as_each_is_measured(tmp_path, model, count):
    folder, tube = around_a_cylinder(tmp_path / "b", model, count)
    alike_by_kernels(folder, taught(), tube)


@pytest.mark.slow
def test_parts_measured_apart_are_measured_alike(tmp_path):
    folder = put_batch(tmp_path / "b", [strokes(9), strokes(7, seed=5)], ["line 20: no geodesic"])
    batch, _ = dataset.read(folder)
    plane = ReportSurface("plane", Plane(START, np.array(UP)))
    sight = MeasurementContext(taught(), plane, np.array(UP))
    asked = []

    def elsewhere(how, of, tasks):
        assert of is batch
        for part, chosen in tasks:
            # What travels is a part's own rows, and nothing that cannot.
            asked.append(len(part))
            how, part = pickle.loads(pickle.dumps((how, part)))
            yield pickle.loads(pickle.dumps(how.part(part, chosen)))

    one = measure(batch, "b", sight, None, lambda _: None)
    other = measure(batch, "b", sight, None, lambda _: None, elsewhere)
    assert asked == [9, 7]
    np.testing.assert_array_equal(other.table, one.table)
    assert [s.label for s in other.shown] == [s.label for s in one.shown]


def test_the_original_model_with_its_far_points(tmp_path):
    folder = put_batch(tmp_path / "b", [strokes(8)], facts={"model": "original"})
    alike(folder, taught())


@pytest.mark.slow
def test_parts_larger_than_a_row_group_are_read_in_pieces(tmp_path):
    whole = put_batch(tmp_path / "a", [strokes(12)])
    cut = put_batch(tmp_path / "b", [strokes(12)], row_group=700)
    reference = taught()
    np.testing.assert_array_equal(
        column(together(cut, reference), "length"), column(together(whole, reference), "length")
    )
    np.testing.assert_allclose(
        together(cut, reference), together(whole, reference), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("at_once", [1, 600, 1503, 4000])
def test_what_is_measured_does_not_depend_on_how_much_is_read_at_once(
    tmp_path, monkeypatch, at_once
):
    uneven = strokes(7) + strokes(4, n=251, seed=9) + strokes(6, n=400, seed=2)
    folder = put_batch(tmp_path / "b", [strokes(9), uneven])
    whole = together(folder, taught())
    monkeypatch.setattr(dataset, "_WHOLE", 0)
    monkeypatch.setattr(dataset, "_ROWS", at_once)
    np.testing.assert_allclose(together(folder, taught()), whole, rtol=1e-12, atol=1e-12)
    batch, _ = dataset.read(folder)
    rows = np.array([1, 8, 12, 25])
    found = strokes_of_rows(batch, "b", MeasurementContext(taught()), rows)
    assert [stroke.label for stroke in found.values()] == [f"b[{row + 1}]" for row in rows]
    assert [len(stroke.t) for stroke in found.values()] == [501, 501, 501, 400]


def test_reading_a_batch_loads_no_pandas(tmp_path):
    folder = put_batch(tmp_path / "b", [strokes(3, n=40)], failed=("nothing there",))
    code = (
        "import pathlib, sys; from dmpcli.records import dataset\n"
        f"batch, _ = dataset.read(pathlib.Path({str(folder)!r}))\n"
        "print(len(list(dataset.pieces(batch, ()))), len(dataset.states_of(batch)[1]))\n"
        "print('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert done.stdout.decode().splitlines() == ["1 1", "False"]


def test_only_some_strokes_are_read_again(tmp_path):
    batch, _ = dataset.read(put_batch(tmp_path / "b", [strokes(6), strokes(6, seed=8)]))
    some = list(measured_parts(batch, "b", MeasurementContext(taught()), np.array([2, 9])))
    assert np.concatenate([s.rows for s in some]).tolist() == [2, 9]
    assert [s.strokes([0])[0].label for s in some] == ["b[3]", "b[10]"]


def test_the_worst_are_those_with_the_largest_figures(tmp_path):
    batch, _ = dataset.read(put_batch(tmp_path / "b", [strokes(30)]))
    many = measure(batch, "b", MeasurementContext(taught()), None, lambda _: None)
    values = column(many.table, "nearest_max")
    assert many.worst_rows("nearest_max") == np.argsort(-values)[:5].tolist()
    first = many.worst("nearest_max")[0]
    assert first["value"] == values.max()
    assert first["id"] == str(int(np.argmax(values)) + 1)
    height = np.abs(column(many.table, "wave_height") - 49.979)
    assert many.worst_rows("wave_height")[0] == np.nanargmax(height)


@pytest.mark.parametrize("values", [[1.0, 2.0, 2.0], [3.0], [49.9348451, 49.9348451 + 1e-13]])
def test_a_histogram_counts_every_value(values):
    found = histogram(np.array(values))
    assert sum(found["counts"]) == len(values)
    assert np.all(np.diff(found["edges"]) > 0.0)
