import datetime as dt

import numpy as np
import pyarrow as pa
import pytest
from typer.testing import CliRunner

from dmpcli import cli
from dmpcli.records import stamps


@pytest.mark.parametrize("point", [".", ","])
def test_times_of_day_are_seconds_also_over_midnight(point):
    begin = dt.datetime(2024, 5, 3, 23, 59, 58, 500000)
    dates = [begin + dt.timedelta(milliseconds=20 * n) for n in range(200)]
    words = [d.strftime("%H:%M:%S.%f").replace(".", point) for d in dates]
    np.testing.assert_allclose(stamps._dates(pa.array(words)), 0.02 * np.arange(200), atol=1e-9)


def test_times_that_the_table_knows_as_such_are_read_alike():
    times = pa.array([dt.time(10, 0, 0), dt.time(10, 0, 0, 250000)])
    assert stamps._dates(times).tolist() == [0.0, 0.25]


def test_a_step_back_within_the_day_stays_one():
    assert stamps._dates(pa.array(["10:00:01", "10:00:00"])).tolist() == [0.0, -1.0]


@pytest.mark.parametrize("words", [["10:00:00", "25:00:00"], ["10:00:00", "soon"], ["10:00"]])
def test_what_is_no_time_of_day_is_left_to_others(words):
    assert stamps._dates(pa.array(words)) is None


def test_the_row_that_is_no_time_of_day_is_named(tmp_path):
    words = ["10:00:00.0", "10:00:00.5", "10:61:00.0"]
    rows = "".join(f"{word},{n},0,0\n" for n, word in enumerate(words))
    (tmp_path / "b.csv").write_text("Time,x,y,z\n" + rows)
    done = CliRunner().invoke(
        cli.app, ["fit", str(tmp_path / "b.csv"), "--map", "t=Time", "-o", str(tmp_path / "s.json")]
    )
    assert done.exit_code == 2
    assert "line 4: '10:61:00.0' is not a time of day HH:MM:SS" in done.stderr
