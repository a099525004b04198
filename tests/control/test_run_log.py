from dataclasses import replace

import numpy as np
import pytest

from dmpcli.control.run_log import Row, RunLog, recovered
from dmpcli.records import record, schemas
from dmpcli.records.file_io import Source
from dmpcli.records.record import Provenance, Record
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.rotations import from_euler
from tests.control.streaming_fakes import PEN_DOWN, START


def row(i, wrench=None):
    pose = Pose(START + i, from_euler(np.array([np.pi, 0.0, np.pi - 0.02 + 0.01 * i])))
    return Row(
        0.02 * i, 0.02 * i, pose, pose, Pose(START, PEN_DOWN), 0.02 * i, 0.0, wrench, -0.5, "ready",
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


def test_every_value_of_a_row_stands_in_its_column():
    lean, goal = np.array([0.1, 0.2, 0.97]), np.array([7.0, 8.0, 9.0])
    known = replace(
        row(1, np.arange(6.0)), t=0.5, t_plan=0.25, deadline=0.75, lateness=0.125, coupling=-1.5,
        force=3.0, contact="drawing", state="fault", phase="retract", id="a", event="on DO1",
        goal=goal, normal=lean, joints=np.arange(6.0) + 0.5,
    )  # fmt: skip
    without = replace(
        known, wrench=None, goal=None, normal=None, joints=np.zeros(7), id=None, event=""
    )
    log = RunLog(sensed=True, coupled=True, joints=6, switching=True, moving=True)
    for i, one in enumerate((known, without)):
        log.add(200.0 + i, one)
    cols = log.columns()
    for name, value in {
        "t": 0.5, "t_plan": 0.25, "deadline": 0.75, "lateness": 0.125, "coupling": -1.5, "fn": 3.0,
        "contact": "drawing", "state": "fault", "phase": "retract", "id": "a", "event": "on DO1",
        "fx": 0.0, "tz": 5.0, "nx_felt": 0.1, "nz_felt": 0.97, "xg": 7.0, "zg": 9.0, "q1": 0.5,
        "q6": 5.5, "x_plan": START[0] + 1, "x_sent": START[0] + 1, "x": START[0],
    }.items():  # fmt: skip
        assert cols[name][0] == value, name
    for name in ("fx", "nx_felt", "xg", "q1"):
        assert np.isnan(cols[name][1]), name
    assert (cols["id"][1], cols["event"][1], cols["contact"][1]) == (None, None, "drawing")
    np.testing.assert_array_equal(log.rows.numbers("clock"), [200.0, 201.0])
    assert len(log) == 2


def test_a_normal_that_was_never_felt_is_no_column():
    cols = columns([row(0)], coupled=True)
    assert "nx_felt" not in cols
    assert cols["fn"][0] == 0.0
    assert "event" not in cols
    assert "xg" not in cols
    assert len(columns([replace(row(0), joints=np.zeros(7))], joints=7)) > len(columns([row(0)]))


def test_of_a_run_that_only_a_journal_is_left_of_the_times_are_told_by_its_rows():
    deadlines = np.array([0.0, 0.02, 0.04, 0.1, 0.12])
    late = np.array([1e-3, 2e-3, 3e-3, 4e-3, 5e-3])
    found = recovered({"deadline": deadlines, "lateness": late}, {"period": 0.02})
    assert (found["completed"], found["missed"]) == (False, 2)
    assert found["lateness"]["max"] == pytest.approx(5e-3)
    assert found["lateness"]["p50"] == pytest.approx(3e-3)
    assert found["reason"] == "recovered after a crash"
