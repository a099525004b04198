"""The shape of some faces, found on a patch, is bit by bit that of the whole mesh."""

import numpy as np
import pytest

from dmpcli.surfaces import local_shape
from dmpcli.surfaces.local_shape import LocalShape
from dmpcli.surfaces.mesh import Mesh
from tests.records.meshes import grid
from tests.surfaces import zoo

NAMES = ("corner_normals", "noise", "reach", "dihedrals")


def wavy(rough=0.0, crease=0.0, n=81):
    """A sheet of 12,800 faces; rough on one half, with a crease along a line."""
    V, F = grid(n=n, half=50.0, height=lambda x, y: 3.0 * np.sin(x / 9.0) + crease * np.abs(y - 7))
    shift = np.random.default_rng(3).normal(size=V.shape) * rough * (V[:, :1] > 10.0)
    return Mesh(V + shift, F)


def slivers():
    """Rows of long facets beside a fine sheet."""
    V, F = grid(n=71, half=50.0, height=lambda x, y: 5.0 * np.cos(x / 6.0))
    V = V.copy()
    V[:, 1] *= np.where(V[:, 0] > 0.0, 9.0, 1.0)
    return Mesh(V, F)


MESHES = {
    "smooth": wavy,
    "rough": lambda: wavy(rough=0.25),
    "creased": lambda: wavy(crease=0.9),
    "rough and creased": lambda: wavy(rough=0.2, crease=0.9),
    "slivers": slivers,
}


def check(mesh, face, monkeypatch, share=0.9):
    monkeypatch.setattr(local_shape, "_SHARE", share)
    local, whole = LocalShape(mesh.shape), mesh.shape
    shape, at = local.about(face)
    for name in NAMES:
        found, wanted = getattr(shape, name)[at], getattr(whole, name)[face]
        assert np.ascontiguousarray(found).tobytes() == np.ascontiguousarray(wanted).tobytes(), name
    slender = shape.developable.slivers[at]
    assert (slender == whole.developable.slivers[face]).all()
    # Asked only beside slivers: elsewhere it is not looked for.
    if slender.any():
        assert (shape.developable.stretched[at] == whole.developable.stretched[face]).all()
    return shape is not whole


@pytest.mark.parametrize("name", MESHES)
def test_what_a_patch_says_is_what_the_mesh_says(name, monkeypatch):
    monkeypatch.setattr(local_shape, "_LEAST", 300)
    mesh, cut = MESHES[name](), 0
    rng = np.random.default_rng(0)
    for _ in range(6):
        middle = mesh.corners[rng.integers(len(mesh.F))].mean(axis=0)
        away = np.linalg.norm(mesh.corners.mean(axis=1) - middle, axis=1)
        cut += check(mesh, np.argsort(away)[: rng.integers(1, 400)], monkeypatch)
    assert cut >= 4  # patches, not the whole mesh


@pytest.mark.sweep(kept=4)
@pytest.mark.slow
@pytest.mark.parametrize("name", zoo.PARTS)
def test_so_it_is_on_parts_with_creases_fillets_and_bores(name, monkeypatch):
    monkeypatch.setattr(local_shape, "_LEAST", 60)
    mesh = zoo.mesh(name)
    for face in np.random.default_rng(1).integers(0, len(mesh.F), (8, 3)):
        check(mesh, face[:1], monkeypatch)
        check(mesh, face, monkeypatch)


def test_one_patch_holds_all_that_was_expected_and_more_faces_only_add_to_it():
    mesh = wavy(n=161)
    local = LocalShape(mesh.shape)
    start, goal = np.array([[-20.0, -20, 0]]), np.array([[20.0, -10, 0]])
    local.expect(start, goal, 6.0)
    middle = mesh.corners.mean(axis=1)
    u = np.clip((middle[:, :2] - start[:, :2]) @ [40, 10] / 1700.0, 0.0, 1.0)
    foot = start[:, :2] + u[:, None] * [40.0, 10.0]
    near = np.flatnonzero(np.linalg.norm(middle[:, :2] - foot, axis=1) < 3.0)
    shape, _ = local.about(near[:1])
    assert local.about(near)[0] is shape is not mesh.shape
    assert len(shape.F) < 0.3 * len(mesh.F)
    far = np.argmax(middle[:, 0] + middle[:, 1])
    assert local.about(np.array([far, near[0]]))[0] is not shape
    assert local.about(np.arange(len(mesh.F)))[0] is mesh.shape


def test_many_lines_and_none_at_all_are_borne():
    mesh = wavy(n=161)
    local = LocalShape(mesh.shape)
    ends = np.random.default_rng(0).uniform(-10, 10, (50, 3))
    local.expect(ends, ends[::-1], 2.0)
    local.expect(np.full((1, 3), np.nan), ends[:1], 2.0)
    none = np.empty(0, dtype=np.int64)
    shape, at = local.about(none)
    assert shape.noise[at].shape == (0,)
    assert LocalShape(mesh.shape).about(none)[1].shape == (0,)
