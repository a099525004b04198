from dataclasses import replace

import numpy as np

from dmpcli.control.run_log import Row, RunLog
from dmpcli.records import record, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record
from dmpcli.spatial.rotations import from_euler
from tests.control.streaming_fakes import PEN_DOWN, START


def row(i, wrench=None):
    pose = (START + i, from_euler(np.array([np.pi, 0.0, np.pi - 0.02 + 0.01 * i])))
    return Row(
        0.02 * i, 0.02 * i, pose, pose, (START, PEN_DOWN), 0.02 * i, 0.0, wrench, -0.5, "ready",
        "stroke",
    )  # fmt: skip


def columns(rows, **kinds):
    log = RunLog(**kinds)
    for r in rows:
        log.add(100.0 + r.t, r)
    return log.columns()


def test_columns_make_a_run_file_and_angles_do_not_jump():
    cols = columns([row(i) for i in range(5)], oriented=True, sensed=False, coupled=True)
    content = record.encode(Record(schemas.RUN, cols, Provenance("execute")))
    back = record.decode(Source("run", content), schemas.RUN)
    np.testing.assert_allclose(back.position("sent"), [START + i for i in range(5)])
    np.testing.assert_allclose(np.diff(back.columns["rz_plan"]), 0.01, atol=1e-9)
    assert set(back.columns["coupling"]) == {-0.5}
    assert not back.has("fx")


def test_what_was_not_asked_for_is_absent():
    cols = columns([row(0)], oriented=False, sensed=True, coupled=False)
    assert "rx_plan" not in cols
    assert "rx_sent" in cols
    assert "coupling" not in cols


def test_joints_are_kept_as_they_were_told_and_a_cycle_without_is_not_a_number():
    told = [replace(row(i), joints=0.1 * i + np.arange(6.0)) for i in range(3)]
    cols = columns([*told, row(3)], joints=6)
    np.testing.assert_array_equal(cols["q3"][:3], [2.0, 2.1, 2.2])
    assert np.isnan(cols["q6"][3])
    assert "q7" not in cols
    assert "q1" not in columns(told)
    assert "q1" not in columns(told, joints=9)  # the schema has no room for so many


def test_a_wrench_that_is_missing_in_one_row_is_not_a_number():
    cols = columns([row(0), row(1, np.arange(6.0))], oriented=True, sensed=True, coupled=False)
    assert np.isnan(cols["fz"][0])
    assert [cols[n][1] for n in ("fx", "fz", "tz")] == [0.0, 2.0, 5.0]
