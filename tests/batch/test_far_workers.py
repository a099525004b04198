"""Workers that share no folder, and come and go, draw the same bytes into a store."""

import os
import signal
import subprocess

import pytest

from tests.batch.clusters import PATIENCE, cluster, waited_for
from tests.batch.test_run import DMPCLI, content, write_pairs
from tests.batch.test_run import learned as learned
from tests.object_store import BUCKET, SECRETS, empty, environment_of, served

pytestmark = pytest.mark.slow

URL = f"s3://{BUCKET}/far"


@pytest.fixture
def store():
    with served() as running:
        empty(running)
        yield running


def words_of(learned, table, output, *more):
    words = [DMPCLI, "generalize", learned, "-o", output, "--pairs", table, "-q", *more]
    return [str(word) for word in [*words, "--pairs-per-part", "100"]]


def parts(store):
    return len([r for r in store.requests if r.startswith("PUT ") and "/part-" in r])


@pytest.mark.thorough
def test_the_only_worker_dies_and_another_one_that_comes_goes_on(learned, store, tmp_path):
    table = write_pairs(tmp_path / "p.csv", 2000)
    subprocess.run(words_of(learned, table, tmp_path / "here"), check=True)
    environment = environment_of(store)
    with cluster(tmp_path / "cluster", environment) as far:
        first = far.add()
        words = words_of(learned, table, URL, "--cluster", far.address)
        drawing = subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True)
        waited_for(lambda: parts(store) >= 4 or drawing.poll() is not None)
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
        assert drawing.poll() is None
        far.add()
        _, told = drawing.communicate(timeout=PATIENCE)
    assert drawing.returncode == 0, told
    assert store.objects("far/") == content(tmp_path / "here")
    for kept in (told, "".join(path.read_text(errors="replace") for path in logs(tmp_path))):
        assert not any(secret in kept for secret in SECRETS.values())


def logs(place):
    return [path for path in (place / "cluster").rglob("*") if path.is_file()]
