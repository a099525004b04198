"""A prepared mesh that was kept is bit by bit the one that would be found anew."""

import threading

import numpy as np
import pytest
import trimesh

from dmpcli import extras
from dmpcli.records import file_io, mesh_store
from dmpcli.records.mesh_store import MeshStore
from dmpcli.spatial.pose import Pose
from tests.extras_here import needs
from tests.records.meshes import grid

POSE = Pose.of(np.array([10.0, -20.0, 5.0, 0.1, 0.2, -0.7]))


def source(path, n=21, noise=0.0):
    rng = np.random.default_rng(0)
    V, F = grid(n=n, half=50.0, height=lambda x, y: 4.0 * np.sin(x / 20.0) + np.abs(y) * 0.8)
    V = V + noise * rng.normal(size=V.shape)
    trimesh.Trimesh(V, F, process=False).export(path)
    return file_io.read(path)


def same_bits(a, b):
    assert (a.dtype, a.shape) == (b.dtype, b.shape)
    assert np.ascontiguousarray(a).tobytes() == np.ascontiguousarray(b).tobytes()


def same(one, other):
    (file, mesh), (again, kept) = one, other
    assert file.remarks == again.remarks
    same_bits(mesh.V, kept.V)
    same_bits(mesh.F, kept.F)
    for name in ("neighbours", "components"):
        same_bits(getattr(mesh.topology, name), getattr(kept.topology, name))
    for name in ("corner_normals", "noise", "heights"):
        same_bits(getattr(mesh.shape, name), getattr(kept.shape, name))
    at = mesh.V[:50] + [0.3, 0.2, 0.9]
    for name in ("position", "normal", "distance", "face"):
        same_bits(getattr(mesh.closest(at), name), getattr(kept.closest(at), name))
    same_bits(mesh.shape.reach, kept.shape.reach)
    same_bits(mesh.outward, kept.outward)
    same_bits(mesh.topology.border, kept.topology.border)


@pytest.mark.slow
@pytest.mark.parametrize("pose", [None, POSE])
@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("unit", [None, "cm"])
def test_what_was_kept_is_what_would_be_found(tmp_path, pose, noise, unit):
    part = source(tmp_path / "part.stl", noise=noise)
    store = MeshStore(str(tmp_path / "kept"))
    plain = MeshStore().load(part, unit, pose)
    same(plain, store.load(part, unit, pose))
    assert len(list((tmp_path / "kept").iterdir())) == 1
    same(plain, MeshStore(str(tmp_path / "kept")).load(part, unit, pose))


@pytest.mark.thorough
@needs(extras.FAST)
def test_for_kernels_the_order_of_the_search_tree_is_kept_too_and_added_where_it_is_not(tmp_path):
    part = source(tmp_path / "part.stl")
    plain = MeshStore().load(part)
    MeshStore(str(tmp_path / "kept")).load(part)
    store = MeshStore(str(tmp_path / "kept"), kernels=True)
    assert not MeshStore(str(tmp_path / "kept")).load(part)[1].knows_order
    for _ in range(2):
        again = store.load(part)
        same(plain, again)
        assert again[1].knows_order
        for one, other in zip(plain[1].tree_order, again[1].tree_order, strict=True):
            same_bits(one, other)
    read = MeshStore(str(tmp_path / "kept")).load(part)
    assert read[1].knows_order
    facets, anew = read[1].with_kernels.facets, plain[1].with_kernels.facets
    for one, other in zip(facets[:2], anew[:2], strict=True):
        same_bits(one, other)


def test_another_pose_unit_or_content_is_another_entry(tmp_path):
    part, other = source(tmp_path / "a.stl"), source(tmp_path / "b.stl", n=22)
    store = MeshStore(str(tmp_path / "kept"))
    for one, unit, pose in ((part, None, None), (part, "m", None), (part, None, POSE)):
        store.load(one, unit, pose)
    store.load(other)
    assert len(list((tmp_path / "kept").iterdir())) == 4


@pytest.mark.parametrize("damage", [b"", b"PK", None])
def test_a_damaged_entry_is_as_good_as_none_and_mended(tmp_path, damage):
    part = source(tmp_path / "part.stl")
    plain = MeshStore().load(part)
    store = MeshStore(str(tmp_path / "kept"))
    store.load(part)
    [entry] = (tmp_path / "kept").iterdir()
    whole = entry.read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    entry.write_bytes(flipped if damage is None else damage)
    same(plain, store.load(part))
    assert entry.read_bytes() == whole


@pytest.mark.parametrize(
    ("name", "number"),
    [("F", 10_000), ("F", -1), ("neighbours", 10_000), ("neighbours", -2), ("V", np.nan)],
)
def test_an_entry_with_numbers_of_nothing_is_as_good_as_none(tmp_path, name, number):
    part = source(tmp_path / "part.stl")
    store = MeshStore(str(tmp_path / "kept"))
    plain = store.load(part)
    [entry] = (tmp_path / "kept").iterdir()
    with np.load(entry) as packed:
        held = dict(packed)
    held[name][3, 1] = number
    with entry.open("wb") as stream:
        np.savez(stream, **held)
    same(plain, store.load(part))


@pytest.mark.parametrize(
    "first",
    [[0, 5, 3, 20, 800], [0, 200, 400, 800], [1, 200, 400, 600, 800], [0, 200, 400, 600, 801]],
)
def test_an_order_of_the_search_tree_that_is_none_is_not_taken(tmp_path, first):
    part = source(tmp_path / "part.stl")
    store = MeshStore(str(tmp_path / "kept"))
    plain = store.load(part)
    [entry] = (tmp_path / "kept").iterdir()
    with np.load(entry) as packed:
        held = dict(packed)
    order = np.arange(800, dtype=np.int32)
    for one, way in ((order, first), (np.zeros_like(order), [0, 200, 400, 600, 800])):
        with entry.open("wb") as stream:
            np.savez(stream, **held, order=one, first=np.array(way, dtype=np.int32))
        again = store.load(part)
        same(plain, again)
        assert not again[1].knows_order
    with entry.open("wb") as stream:
        np.savez(
            stream, **held, order=order, first=np.array([0, 200, 400, 600, 800], dtype=np.int32)
        )
    assert store.load(part)[1].knows_order


def test_the_folder_is_bounded_and_what_was_used_last_stays(tmp_path):
    parts = [source(tmp_path / f"{n}.stl", n=n) for n in range(18, 24)]
    one = MeshStore(str(tmp_path / "one"))
    one.load(parts[-1])
    size = sum(path.stat().st_size for path in (tmp_path / "one").iterdir())
    folder = tmp_path / "kept"
    for part in parts:
        MeshStore(str(folder), largest=3 * size).load(part)
    kept = list(folder.iterdir())
    assert sum(path.stat().st_size for path in kept) <= 3 * size
    store = MeshStore(str(folder))
    last = store._entry(parts[-1], None, None)
    assert last in kept


def test_writers_that_know_nothing_of_one_another_leave_one_whole_entry(tmp_path):
    part = source(tmp_path / "part.stl")
    plain = MeshStore().load(part)
    found = []

    def write():
        found.append(MeshStore(str(tmp_path / "kept")).load(part))

    threads = [threading.Thread(target=write) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(list((tmp_path / "kept").iterdir())) == 1
    for one in found:
        same(plain, one)


def test_a_folder_that_cannot_be_written_is_done_without(tmp_path):
    (tmp_path / "kept").write_text("a file")
    part = source(tmp_path / "part.stl")
    same(MeshStore().load(part), MeshStore(str(tmp_path / "kept")).load(part))


def test_a_part_of_50000_faces_takes_6_mb_at_most(tmp_path):
    part = source(tmp_path / "part.stl", n=160)
    _, mesh = MeshStore(str(tmp_path / "kept")).load(part)
    [entry] = (tmp_path / "kept").iterdir()
    assert len(mesh.F) > 50_000
    assert entry.stat().st_size <= 6e6
    assert mesh_store.FORMAT == 2


def test_a_surface_in_closed_form_is_not_kept(tmp_path):
    (tmp_path / "plane.json").write_text('{"point": [0, 0, 1], "normal": [0, 0, 1]}')
    plane = MeshStore(str(tmp_path / "kept")).load(
        file_io.read(tmp_path / "plane.json"), None, POSE
    )
    np.testing.assert_allclose(plane.point, POSE.apply(np.array([0.0, 0.0, 1.0])))
    assert not (tmp_path / "kept").exists()
