"""`--kernels`: chosen once for a job, recorded in it, and kept to."""

import importlib.util
import json
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from dmpcli import extras
from dmpcli.batch import cluster
from dmpcli.errors import InputError
from dmpcli.records import file_io
from dmpcli.workflows import kernels
from tests.commands.test_generalize import read, run, write_skill
from tests.dmp.strokes import paper_stroke
from tests.extras_here import needs
from tests.surfaces import cases

HEADER = "x0,y0,z0,xg,yg,zg"


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("skill")
    return write_skill(folder / "s.json", paper_stroke(turning=True), regression="ridge")


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    """A saddle as a mesh file, and a table of six pairs on it."""
    folder = tmp_path_factory.mktemp("shop")
    mesh, case = cases.mesh("saddle", 5000), cases.case("saddle", 6, 20, 1)
    lines = ["OFF", f"{len(mesh.V)} {len(mesh.F)} 0"]
    lines += [" ".join(map(repr, v)) for v in mesh.V.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in mesh.F.tolist()]
    (folder / "saddle.off").write_text("\n".join(lines))
    rows = np.hstack([case.start, case.goal])
    np.savetxt(folder / "p.csv", rows, delimiter=",", header=HEADER, comments="")
    return folder


def drawn(learned, shop, folder, *options):
    words = ["--pairs", shop / "p.csv", "--surface", shop / "saddle.off", "--pairs-per-part", 2]
    done = run(learned, "-o", folder, *words, *options)
    assert done.exit_code == 0, done.stderr
    return {path.name: path.read_bytes() for path in folder.glob("*.parquet")}


@pytest.mark.thorough
@needs(extras.FAST)
def test_a_job_with_kernels_says_so_and_is_the_same_but_for_rounding(learned, shop, tmp_path):
    turning = ("--orientation", "surface")
    drawn(learned, shop, tmp_path / "pure", *turning, "--kernels", "pure")
    one = drawn(learned, shop, tmp_path / "one", *turning, "--kernels", "compiled")
    two = drawn(learned, shop, tmp_path / "two", *turning, "--kernels", "compiled", "--jobs", 2)
    assert one == two
    manifests = [json.loads((tmp_path / f / file_io.MANIFEST).read_text()) for f in ("pure", "one")]
    assert [m["options"].get("kernels") for m in manifests] == [None, "compiled"]
    for part in ("part-00000.parquet", "part-00002.parquet"):
        pure, fast = (read(tmp_path / folder / part) for folder in ("pure", "one"))
        for name, values in pure.columns.items():
            if values.dtype == float:
                np.testing.assert_allclose(fast.columns[name], values, rtol=0, atol=1e-11)


@pytest.mark.thorough
@needs(extras.FAST)
def test_a_job_that_goes_on_keeps_to_its_means_and_takes_the_parts_that_are_there(
    learned, shop, tmp_path, monkeypatch
):
    folder = tmp_path / "b"
    before = drawn(learned, shop, folder, "--kernels", "compiled")
    (folder / "part-00001.parquet").unlink()
    (folder / file_io.MANIFEST).unlink()
    stamp = (folder / "part-00000.parquet").stat().st_mtime_ns
    assert drawn(learned, shop, folder) == before
    assert (folder / "part-00000.parquet").stat().st_mtime_ns == stamp
    monkeypatch.setattr(kernels, "there", lambda: False)
    words = ["--pairs", shop / "p.csv", "--surface", shop / "saddle.off", "--pairs-per-part", 2]
    refused = run(learned, "-o", folder, *words)
    assert refused.exit_code == 2
    assert "begun with --kernels compiled" in refused.stderr
    assert "pip install 'dmpcli[fast]'" in refused.stderr
    other = drawn(learned, shop, folder, "--kernels", "pure")
    assert other != before
    assert drawn(learned, shop, folder) == other


@pytest.mark.thorough
@needs(extras.FAST)
def test_a_table_that_names_its_meshes_has_one_means_and_the_same_bytes_with_and_without_a_cache(
    learned, shop, tmp_path, monkeypatch
):
    monkeypatch.setattr(kernels, "MANY_ON_MESH", 6)
    rows = (shop / "p.csv").read_text().split()
    for i, row in enumerate(rows[1:]):
        (tmp_path / f"{i}.off").write_text((shop / "saddle.off").read_text() + "\n" * i)
        rows[i + 1] = f"{row},{i}.off"
    (tmp_path / "p.csv").write_text("\n".join([rows[0] + ",surface", *rows[1:]]))
    words = ["--pairs", tmp_path / "p.csv", "--surfaces-per-part", 2]
    cache = ["--surface-cache", tmp_path / "cache"]

    def bytes_of(name, *more):
        done = run(learned, "-o", tmp_path / name, *words, *more)
        assert done.exit_code == 0, done.stderr
        return {path.name: path.read_bytes() for path in (tmp_path / name).glob("*.parquet")}

    auto = bytes_of("auto")
    assert auto == bytes_of("named", "--kernels", "compiled")
    assert auto == bytes_of("first", *cache, "--jobs", 2) == bytes_of("kept", *cache)
    bytes_of("pure", "--kernels", "pure")
    for name in ("part-00000.parquet", "part-00002.parquet"):
        pure, fast = (read(tmp_path / folder / name) for folder in ("pure", "auto"))
        for column, values in pure.columns.items():
            if values.dtype == float:
                np.testing.assert_allclose(fast.columns[column], values, rtol=0, atol=1e-11)


@pytest.mark.slow
def test_small_tables_and_single_strokes_are_drawn_without_kernels(
    learned, shop, tmp_path, monkeypatch
):
    def never():
        raise AssertionError("kernels were made ready")

    monkeypatch.setattr(kernels, "get_ready", never)
    auto = drawn(learned, shop, tmp_path / "auto")
    assert auto == drawn(learned, shop, tmp_path / "pure", "--kernels", "pure")
    x = np.loadtxt(shop / "p.csv", delimiter=",", skiprows=1)[0].tolist()
    ends = ["--start", *x[:3], "--goal", *x[3:], "--surface", shop / "saddle.off"]
    one = tmp_path / "one.parquet"
    assert run(learned, "-o", one, *ends).exit_code == 0
    assert b"kernels" not in pq.read_metadata(one).metadata[b"dmpcli"]


@pytest.mark.parametrize(
    ("rows", "mesh", "turning", "here", "means"),
    [
        (999, True, True, True, "pure"),
        (1000, True, False, True, "compiled"),
        (1000, True, False, False, "pure"),
        (100_000, False, False, True, "pure"),
        (29_999, False, True, True, "pure"),
        (30_000, False, True, True, "compiled"),
    ],
)
def test_auto_is_decided_by_the_whole_table_and_by_what_is_here(
    tmp_path, monkeypatch, rows, mesh, turning, here, means
):
    monkeypatch.setattr(kernels, "there", lambda: here)
    assert kernels.means("auto", rows, mesh, turning, tmp_path / "none") == means


def test_kernels_that_are_asked_for_and_not_here_are_refused_with_the_line_that_installs_them(
    tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(InputError, match=r"--kernels compiled: needs numba.*dmpcli\[fast\]"):
        kernels.means("compiled", 5, True, False, tmp_path)
    assert kernels.means("pure", 10**6, True, True, tmp_path) == "pure"


@needs(extras.FAST)
def test_numba_that_is_switched_off_is_as_good_as_none(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    with pytest.raises(InputError, match="NUMBA_DISABLE_JIT keeps numba from compiling: unset it"):
        kernels.means("compiled", 5, True, False, tmp_path)
    assert kernels.means("auto", 10**6, True, True, tmp_path / "none") == "pure"
    assert "NUMBA_DISABLE_JIT" in cluster.versions(kernels=True)["numba"]
    monkeypatch.setattr(kernels, "recorded", lambda _: "compiled")
    with pytest.raises(InputError, match=r"was begun with --kernels compiled; NUMBA_DISABLE_JIT"):
        kernels.means("auto", 10**6, True, True, tmp_path)


def test_workers_of_a_job_with_kernels_are_asked_for_numba_and_no_others(monkeypatch):
    assert "numba" not in cluster.versions()
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert cluster.versions(kernels=True)["numba"] == "not installed"


@pytest.mark.thorough
@needs(extras.FAST)
def test_the_first_compile_is_told_in_one_line(monkeypatch, caplog):
    from dmpcli.surfaces.kernels import ready

    ready.load()
    assert kernels.kept()
    places = ready.files()

    def told(load, nowhere):
        caplog.clear()
        monkeypatch.setattr(ready, "load", load)
        if nowhere:
            monkeypatch.setattr(ready, "files", lambda: [("/nowhere", ".lift-")])
        with caplog.at_level("INFO", logger="dmpcli"):
            kernels.get_ready()
        return [entry.getMessage() for entry in caplog.records]

    assert told(lambda: None, nowhere=False) == []
    [line] = told(lambda: monkeypatch.setattr(ready, "files", lambda: places), nowhere=True)
    assert "kernels are compiled, once on this machine" in line
    _, doubt = told(lambda: None, nowhere=True)
    assert "cannot be kept" in doubt
    assert "NUMBA_CACHE_DIR" in doubt
