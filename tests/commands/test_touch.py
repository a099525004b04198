"""touch at the command line: points for register, pairs for generalize."""

import signal
from functools import partial

import numpy as np
import pytest

from dmpcli.records import pairs, tables, touched
from dmpcli.records.file_io import Source, read
from tests.commands.running import ended
from tests.commands.terminal import Terminal

touch = partial(ended, "touch")


def test_points_by_the_clock_are_what_register_reads(tmp_path):
    file = tmp_path / "points.csv"
    result = touch("-o", file, "--every", 1, "--count", 3, "--robot", "mock:?x=-600&z=5.25")
    assert result.stdout == ""
    found = touched.read(read(file))
    np.testing.assert_allclose(found.base, [[-600.0, 131.399, 5.25]] * 3)
    assert list(found.table.columns) == ["x", "y", "z", "rx", "ry", "rz"]


def test_the_same_command_gives_the_same_bytes(tmp_path):
    one, two = tmp_path / "a.csv", tmp_path / "b.csv"
    for file in (one, two):
        touch("-o", file, "--every", 1, "--count", 3)
    assert one.read_bytes() == two.read_bytes()


def test_the_dash_writes_rows_as_they_come(tmp_path):
    result = touch("-o", "-", "--pairs", "--every", 1, "--count", 4, "-q")
    found = pairs.read(Source("stdin", result.stdout_bytes))
    assert len(found) == 2
    assert found.good.all()
    assert result.stderr == ""


def test_pairs_end_in_generalize(tmp_path):
    """One start and one goal apart by the mock's URL; two runs stand for an arm that was led."""
    rows = []
    for x in (-700, -600):
        touch("-o", tmp_path / "p.csv", "--every", 1, "--count", 1, "--robot", f"mock:?x={x}")
        rows.append((tmp_path / "p.csv").read_text().splitlines()[1].split(",")[:3])
    file = tmp_path / "pairs.csv"
    file.write_text("x0,y0,z0,xg,yg,zg\n" + ",".join(rows[0] + rows[1]) + "\n")
    assert pairs.read(read(file)).good.all()


def test_points_of_a_part_are_paired_in_order(tmp_path):
    part = tmp_path / "part.csv"
    part.write_text("px,py,pz\n0,0,0\n10,0,0\n")
    touch("-o", tmp_path / "t.csv", "--part", part, "--every", 1)
    found = touched.read(read(tmp_path / "t.csv"))
    np.testing.assert_array_equal(found.part, [[0, 0, 0], [10, 0, 0]])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "waits for Enter, and standard input is no terminal"),
        (["--every", 1], "--every: needs --count N"),
        (["--every", 0, "--count", 1], "--every 0: must be"),
        (["--every", 1, "--count", 0], "--count 0: must be"),
        (["--angles", "--every", 1, "--count", 1], "--angles: belongs to --pairs"),
        (["--pairs", "--part", "p.csv"], "--part: points of a part are for register"),
        (["--every", 1, "--count", 1, "--part", "missing.csv"], "missing.csv: no such file"),
        (["--every", 1, "--count", 1, "--robot", "nonsense:"], "no such instrument"),
        (["--every", 1, "--count", 1, "--tool", "missing.json"], "missing.json: no such file"),
    ],
)
def test_a_wrong_command_line_is_one_message(tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    result = touch("-o", "t.csv", *options, expect=2)
    assert words in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "t.csv").exists()


@pytest.mark.slow
def test_enter_takes_points_and_each_is_there_at_once(tmp_path):
    file = tmp_path / "points.csv"
    with Terminal("touch", "-o", file, cwd=tmp_path) as person:
        person.wait_for("touch point 1; Enter takes it")
        for number in (1, 2):
            person.type()
            person.wait_for(f"now point {number + 1}")
            assert len(tables.read(read(file))) == number
        person.type("q")
        assert person.end() == 0
    assert person.said.endswith("points.csv: 2 points\n")


@pytest.mark.slow
def test_ctrl_c_keeps_every_point(tmp_path):
    file = tmp_path / "pairs.csv"
    with Terminal("touch", "-o", file, "--pairs", cwd=tmp_path) as person:
        person.wait_for("touch start of pair 1")
        person.type()
        person.wait_for("now goal of pair 1")
        person.process.send_signal(signal.SIGINT)
        assert person.end() == 130
    assert "pair 1 has no goal" in person.said
    assert "Traceback" not in person.said
    found = pairs.read(read(file))
    assert not found.good[0]
    np.testing.assert_allclose(found.pairs.start[0], [-551.03, 131.399, -17.56])
