"""One reader of trajectory files: what it refuses, execute, report and inspect refuse alike."""

import numpy as np
import pytest
from typer.testing import CliRunner

from dmpcli.cli import app
from dmpcli.errors import InputError
from dmpcli.records import record, schemas
from dmpcli.records.record import Provenance, Record
from dmpcli.records.trajectory_reader import rows_by_id, stored
from tests.minimum_jerk import minimum_jerk

N = 101


def trajectory(normal=None, named=None, t=None, angles=None, ids=None):
    s = np.linspace(0.0, 1.0, N)
    columns = {
        "id": np.array(ids or ["a"] * N, dtype=object),
        "t": 2.0 * s if t is None else t,
        "x": -600.0 + 50.0 * minimum_jerk(s),
        "y": 130.0 + 0.0 * s,
        "z": -17.0 + 0.0 * s,
    }
    if angles is not None:
        columns |= dict(zip(schemas.EULER_ANGLES, np.asarray(angles, float).T, strict=True))
    if normal is not None:
        rows = np.broadcast_to(np.asarray(normal, dtype=float), (N, 3))
        columns |= dict(zip(schemas.NORMAL, rows.T.copy(), strict=True))
    facts = {"k": [100.0] * 6, "d": [20.0] * 6, "alpha_e": [5.0] * 6, "tau": 1.0}
    facts |= {} if named is None else {"normal": named}
    return Record(schemas.TRAJECTORY, columns, Provenance("generalize", facts=facts))


def only(made):
    (pair,) = rows_by_id(made.columns["id"]).items()
    return stored(made, *pair)


def test_rows_of_several_ids_come_in_order_of_first_appearance():
    ids = ["b"] * 40 + ["a"] * 30 + ["b"] * 31
    found = rows_by_id(np.array(ids, dtype=object))
    assert list(found) == ["b", "a"]
    assert found["b"].tolist() == [*range(40), *range(70, 101)]
    second = stored(trajectory(ids=ids), "a", found["a"])
    assert (second.id, second.first_row, len(second)) == ("a", 41, 30)


def test_a_named_normal_holds_for_every_row_and_a_missing_one_stays_missing():
    flat = only(trajectory(named=[0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(flat.normal, np.tile([0.0, 0.0, 1.0], (N, 1)))
    np.testing.assert_array_equal(flat.plane_normal, [0.0, 0.0, 1.0])
    assert only(trajectory()).normal is None


def test_normals_that_turn_have_no_plane_and_are_made_unit_to_the_last_digit():
    a = np.linspace(0.0, 0.4, N)
    turning = np.column_stack([np.sin(a), 0 * a, np.cos(a)])
    found = only(trajectory(normal=1.0005 * turning))
    np.testing.assert_allclose(found.normal, turning, atol=1e-12)
    assert found.plane_normal is None


def test_normals_by_row_may_repeat_the_named_one():
    found = only(trajectory(normal=[0.0, 0.0, 1.0], named=[0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(found.plane_normal, [0.0, 0.0, 1.0])


BAD = {
    "contradiction": (
        {"normal": [0.0, 0.6, 0.8], "named": [0.0, 0.0, 1.0]},
        "row 1 (nx, ny, nz) lies 36.9° off the one that is named for the whole stroke",
    ),
    "opposite": (
        {"normal": [0.0, 0.0, -1.0], "named": [0.0, 0.0, 1.0]},
        "lies 180° off the one that is named",
    ),
    "long": ({"normal": [0.0, 0.0, 2.0]}, "the normal at row 1 has length 2"),
    "long name": ({"named": [0.0, 0.0, 0.5]}, "the normal that the file names has length 0.5"),
    "time": (
        {"t": np.r_[np.linspace(0, 1, 50), 0.9, np.linspace(1.1, 2, 50)]},
        "column 't', row 51: 0.9 s does not come after 1 s",
    ),
    "angles": (
        {"angles": np.where(np.arange(N)[:, None] == 7, np.nan, [[3.1, 0.0, 0.0]])},
        "column 'rx', row 8: no value",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_drawn_is_refused_with_its_row(case):
    said, message = BAD[case]
    with pytest.raises(InputError) as refused:
        only(trajectory(**said))
    assert message in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize(
    "words", [["execute", "--dry-run"], ["report"], ["inspect"]], ids=lambda words: words[0]
)
def test_every_command_that_reads_trajectories_refuses_it_alike(tmp_path, case, words):
    said, message = BAD[case]
    path = tmp_path / "bad.parquet"
    path.write_bytes(record.encode(trajectory(**said)))
    result = CliRunner().invoke(app, [*words, str(path)])
    assert result.exit_code == 2
    assert message in result.stderr
    assert "bad.parquet" in result.stderr
