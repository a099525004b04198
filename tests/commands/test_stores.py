"""What reads and writes files does it in an object store with the same bytes, or says why not."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmpcli
from tests.commands.running import ended
from tests.commands.test_report_batch import FAILED, HEIGHTS, waves
from tests.object_store import BUCKET, SECRETS, Fault, served, used
from tests.reporting.batches import put_batch
from tests.reporting.example_files import demonstration, put

URL = f"s3://{BUCKET}"


@pytest.fixture(scope="module")
def running():
    with served() as store:
        yield store


@pytest.fixture
def store(running, monkeypatch):
    with used(running, monkeypatch) as store:
        yield store


@pytest.fixture
def here(tmp_path, store):
    """A demonstration and a batch of 30 strokes, here and in the store."""
    demo = put(tmp_path, "demo", demonstration())
    folder = put_batch(tmp_path / "batch", [waves(HEIGHTS[:18]), waves(HEIGHTS[18:], 18.0)], FAILED)
    for path in (Path(demo), *folder.iterdir()):
        key = f"in/{path.relative_to(tmp_path).as_posix()}"
        store.client().upload_file(str(path), BUCKET, key)
    return tmp_path, Path(demo), folder


def files(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*")}


@pytest.mark.thorough
def test_a_report_of_a_store_into_a_store_is_the_one_of_this_machine(here, store):
    place, demo, folder = here
    printed = ended("report", demo, folder, "-o", place / "out").stdout
    words = [f"{URL}/in/{demo.name}", f"{URL}/in/batch", "-o", f"{URL}/out", "--jobs", 2]
    assert ended("report", *words).stdout == printed
    assert store.objects("out/") == files(place / "out")
    ended("report", f"{URL}/in/{demo.name}", "-o", f"{URL}/out")
    assert "strokes.csv" not in store.objects("out/")


@pytest.mark.slow
def test_a_store_without_time_is_not_told_as_a_damaged_part(here, store, monkeypatch):
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    store.faults.append(Fault("GET", "part-00001", after=1))
    told = ended("report", f"{URL}/in/batch", "-o", f"{URL}/out", expect=4).stderr
    assert "part-00001.parquet: the store" in told
    assert "damaged" not in told
    assert len(told.splitlines()) == 1
    assert store.objects("out/") == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda client: client.delete_object(Bucket=BUCKET, Key="in/batch/pairs.parquet"),
            "holds no",
        ),
        (
            lambda client: client.delete_object(Bucket=BUCKET, Key="in/batch/part-00001.parquet"),
            "part-00001.parquet: is missing",
        ),
        (
            lambda client: client.put_object(
                Bucket=BUCKET, Key="in/batch/part-00001.parquet", Body=b"PAR1"
            ),
            "has 4 bytes, _manifest.json says",
        ),
    ],
)
def test_what_is_wrong_with_a_batch_in_a_store_is_told_as_of_a_folder(here, store, change, said):
    change(store.client())
    told = ended("report", f"{URL}/in/batch", expect=2).stderr
    assert said in told
    assert f"{URL}/in/batch" in told


@pytest.mark.slow
def test_a_whole_pipeline_runs_in_a_store(store, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended("record", "-o", "demo.parquet", "--seed", "1")
    store.client().upload_file("demo.parquet", BUCKET, "demo.parquet")
    pair = ["--start", -701.7, 132.4, -17.5, "--goal", -807.6, 129.7, -17.5]
    for at in ("", f"{URL}/"):
        ended("fit", f"{at}demo.parquet", "-o", f"{at}skill.json")
        ended("generalize", f"{at}skill.json", "-o", f"{at}traj.parquet", *pair)
    made = store.objects()
    for name in ("skill.json", "traj.parquet"):
        assert made[name] == (tmp_path / name).read_bytes(), name
    said = [ended("inspect", f"{at}skill.json", "--json").stdout for at in ("", f"{URL}/")]
    assert said[0] == said[1]
    trajectory = dmpcli.read(f"{URL}/traj.parquet")
    np.testing.assert_array_equal(trajectory.position, dmpcli.read("traj.parquet").position)
    dmpcli.write(trajectory, f"{URL}/again.parquet")
    assert store.objects()["again.parquet"] == made["traj.parquet"]
    ended("execute", f"{URL}/traj.parquet", "-o", "run.parquet", "--dry-run")
    kept = b"".join(store.objects().values())
    assert not any(secret.encode() in kept for secret in SECRETS.values())


def test_inspect_says_of_a_batch_in_a_store_what_it_says_of_a_folder(here):
    _, _, folder = here
    there, ours = (
        json.loads(ended("inspect", name, "--json").stdout)
        for name in (f"{URL}/in/batch", str(folder))
    )
    assert there == ours


def test_json_of_generalize_describes_what_lies_in_the_store(store, tmp_path):
    words = ["--reproduce", "--json", "-o", f"{URL}/t.parquet"]
    told = ended("generalize", "tests/records/version_0_1/skill.json", *words)
    said = json.loads(told.stdout)
    assert said["exit_code"] == 0
    assert said["output"]["found"]["file"] == "t.parquet"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["record", "-o", f"{URL}/demo.parquet"], "is written on this machine"),
        (["execute", "t.parquet", "-o", f"{URL}/run.parquet"], "is written on this machine"),
        (["touch", "-o", f"{URL}/touched.csv"], "is written on this machine"),
        (["execute", f"{URL}/t.parquet", "-o", "run.parquet"], "no such file"),
        (
            ["report", f"{URL}/in/demo.parquet", "-o", f"{URL}/o", "--open"],
            "--open: shows a page of",
        ),
        (["inspect", f"{URL}/no"], "no such file"),
        (["fit", f"{URL}/no", "-o", "s.json"], "no such file"),
        (["fit", f"{URL}/no", "-o", f"{URL}/s.csv"], "name it s.json"),
        (["import", f"{URL}/no.csv", "-o", "o"], "names a store"),
        (["export", f"{URL}/no.parquet", "-o", "o.csv"], "names a store"),
    ],
)
def test_what_a_command_does_not_do_in_a_store_is_told_in_one_line(
    store, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    told = ended(*words, expect=2).stderr
    assert said in told
    assert len(told.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
    assert store.objects() == {}
