"""The recipes of docs/storage.md run as they are printed, with tasks and workers that die."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.batch.test_run import content, write_pairs
from tests.batch.test_run import learned as learned
from tests.docs.pages import ROOT, blocks
from tests.object_store import BUCKET, empty, environment_of, served

PAGE = ROOT / "docs" / "storage.md"
BIN = Path(sys.executable).parent

SBATCH = """#!{python}
# Runs the tasks of a job in turn; the second is killed over its part, and comes again.
import os, re, subprocess, sys, time
script = open(sys.argv[-1]).read()
array = re.search(r"#SBATCH --array=(\\d+)-(\\d+)", script)
tasks = range(int(array[1]), int(array[2]) + 1) if array else [None]
cores = re.search(r"--cpus-per-task=(\\d+)", script)
for task in tasks:
    said = dict(os.environ)
    if task is not None:
        said |= dict(SLURM_ARRAY_TASK_ID=str(task), SLURM_CPUS_PER_TASK=cores[1])
    if task == 2:
        begun = subprocess.Popen(["bash", sys.argv[-1]], env=said, start_new_session=True)
        while not os.path.exists(os.environ["SEEN"]) and begun.poll() is None:
            time.sleep(0.01)
        os.killpg(begun.pid, 9)
        begun.wait()
        with open(os.environ["KILLED"], "w") as file:
            file.write(str(begun.returncode))
    subprocess.run(["bash", sys.argv[-1]], env=said, check=True)
print(1)
"""


@pytest.fixture
def store():
    with served() as running:
        empty(running)
        yield running


@pytest.mark.thorough
def test_the_job_array_draws_a_batch_though_a_task_is_killed(learned, store, tmp_path):
    table = write_pairs(tmp_path / "pairs.csv", 2100, bad=(60,))
    here = tmp_path / "here"
    words = ["generalize", learned, "-o", here, "--pairs", table, "--on-error", "skip", "-q"]
    subprocess.run([str(word) for word in [BIN / "dmpcli", *words]], check=True)
    client = store.client()
    client.upload_file(str(learned), BUCKET, "in/skill.json")
    client.upload_file(str(table), BUCKET, "in/pairs.csv")
    stubs = tmp_path / "bin"
    stubs.mkdir()
    for name, text in {
        "sbatch": SBATCH.format(python=sys.executable),
        "srun": '#!/bin/sh\nexec "$@"\n',
    }.items():
        (stubs / name).write_text(text)
        (stubs / name).chmod(0o755)
    draw, finish, submit, _ = blocks(PAGE, "bash")
    (tmp_path / "draw.sbatch").write_text(draw)
    (tmp_path / "finish.sbatch").write_text(finish)
    seen = tmp_path / "seen"

    def sees(method, path):
        # The second shard of four has part 1.
        if method == "PUT" and "part-00001.parquet" in path:
            seen.touch()

    store.happened = sees
    environment = environment_of(store) | {
        "PATH": f"{stubs}:{BIN}:{os.environ['PATH']}",
        "IN": f"s3://{BUCKET}/in",
        "OUT": f"s3://{BUCKET}/out",
        "SEEN": str(seen),
        "KILLED": str(tmp_path / "killed"),
    }
    done = subprocess.run(
        ["bash", "-e", "-c", submit], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "killed").read_text() == "-9"
    assert "shard 4/4" in done.stderr
    assert store.objects("out/") == content(here)


def test_the_line_for_dask_is_what_the_command_takes():
    """The workers of a cluster are tests/batch/test_far_workers.py's."""
    *_, dask = blocks(PAGE, "bash")
    assert "--cluster tcp://HEAD:8786" in dask
    for word in ("--nthreads 1", "--nworkers 8"):
        assert word in dask
    from distributed.cli.dask_worker import main

    options = {word for parameter in main.params for word in parameter.opts}
    assert {"--nthreads", "--nworkers"} <= options
