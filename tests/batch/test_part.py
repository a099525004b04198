"""What becomes of strokes that leave the surface: fail, clip or skip."""

import numpy as np
import pytest

from dmpcli.batch import workers
from dmpcli.batch.part import Job
from dmpcli.batch.run import Batch
from dmpcli.batch.settled import Settled, settle
from dmpcli.batch.task import Task
from dmpcli.dmp.drawn_strokes import GeneralizeOptions
from dmpcli.dmp.generalization import draw
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.dmp.rollout import Pairs
from dmpcli.errors import RefusedError
from dmpcli.records import file_io, record
from dmpcli.records.pairs import PairTable
from dmpcli.records.record import Form, Provenance
from dmpcli.records.schemas import OK
from dmpcli.surfaces.mesh import Mesh
from dmpcli.surfaces.surface import Status
from tests.dmp.strokes import paper_stroke
from tests.records.meshes import grid

INSIDE, OVER = [-54.0, 0.0, 0.0, 54.0, 0.0, 0.0], [-54.0, 60.0, 0.0, 54.0, 60.0, 0.0]


@pytest.fixture(scope="module")
def skill():
    return fit([paper_stroke()], FitOptions(regression="ridge")).skill


@pytest.fixture(scope="module")
def mesh():
    return Mesh(*grid(n=17, half=75.0, height=lambda x, y: 0.0 * x))


def table_of(*ends):
    ends = np.array(ends)
    ids = [str(i) for i in range(len(ends))]
    pairs = Pairs(ends[:, :3], ends[:, 3:], None, None)
    lines = np.arange(2, 2 + len(ends))
    return PairTable("p.csv", ids, pairs, lines, np.full(len(ends), np.nan), [OK] * len(ends))


def write(folder, skill, mesh, table, on_border, stop=True):
    form, provenance = Form(), Provenance("generalize")
    job = Job(
        Task(skill, mesh, GeneralizeOptions(on_border=on_border)),
        stop,
        provenance,
        form,
        str(folder),
    )
    lasting = np.full(len(table), skill.duration)
    done = []
    Batch(job, table, table.pairs, lasting, 2000).run(
        workers.here, lambda pairs, *_, **__: done.append(pairs)
    )
    return done


def test_settled_clips_skips_or_refuses(skill, mesh):
    table = table_of(INSIDE, OVER)
    lasting = np.full(2, skill.duration)
    inside, over = draw(skill, table.pairs, lasting, mesh, GeneralizeOptions())
    assert over.status == Status.BORDER
    for on_border in ("fail", "clip", "skip"):
        task = Task(skill, mesh, GeneralizeOptions(on_border=on_border))
        assert settle(task, ["a"], [inside]) == [Settled(["a"], [inside], OK)]
        [one] = settle(task, ["b"], [over])
        [kept], status = one.strokes, one.status
        assert (status == OK) == (on_border == "clip")
        assert len(kept.position) < len(over.position) or on_border != "clip"
        assert np.abs(kept.position[:, 1]).max() <= 75.0 + 1e-6 or on_border != "clip"


def test_skip_leaves_out_strokes_over_the_border_and_nothing_else(skill, mesh, tmp_path):
    table = table_of(INSIDE, OVER, INSIDE)
    assert sum(write(tmp_path / "b", skill, mesh, table, "skip")) == 3
    assert [status == OK for status in table.status] == [True, False, True]
    assert Status.BORDER.reason in table.status[1]
    part = record.decode(file_io.read(tmp_path / "b" / "part-00000.parquet"))
    assert set(part.columns["id"]) == {"0", "2"}
    point = [0.0, 0.0, 0.0]
    for on_border, bad in (("fail", OVER), ("skip", point + point)):
        table = table_of(INSIDE, bad)
        with pytest.raises(RefusedError, match="line 3, pair 1"):
            write(tmp_path / on_border, skill, mesh, table, on_border)
        assert not (tmp_path / on_border).exists()
        table = table_of(INSIDE, bad)
        write(tmp_path / on_border, skill, mesh, table, on_border, stop=False)
        assert [status == OK for status in table.status] == [True, False]
