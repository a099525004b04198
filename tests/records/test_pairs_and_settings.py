"""Tables of pairs keep every row; settings name what is wrong with them."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records import pairs
from dmpcli.records.file_io import Source
from dmpcli.settings import layers
from dmpcli.settings.fit import FitSettings
from dmpcli.settings.generalize import GeneralizeSettings
from dmpcli.settings.layers import resolve

HEADER = "x0,y0,z0,xg,yg,zg"


def table(*rows, header=HEADER):
    return Source("pairs.csv", "\n".join([header, *rows]).encode())


def test_pairs_without_ids_are_numbered_and_without_duration_take_the_skills():
    found = pairs.read(table("1,2,3,4,5,6", "7,8,9,10,11,12"))
    assert found.ids == ["1", "2"]
    assert np.isnan(found.duration).all()
    np.testing.assert_array_equal(found.pairs.goal[1], [10, 11, 12])
    assert found.good.all()


def test_parquet_tables_and_orientations_are_read():
    import pandas as pd

    columns = HEADER.split(",") + ["id", "duration", "rx0", "ry0", "rz0"]
    frame = pd.DataFrame([[1, 2, 3, 4, 5, 6, "a", 2.5, 3.0, 0.1, 0.2]], columns=columns)
    stream = io.BytesIO()
    frame.to_parquet(stream)
    found = pairs.read(Source("p.parquet", stream.getvalue()))
    assert found.ids == ["a"]
    assert found.duration[0] == 2.5
    assert found.pairs.start_rotation.shape == (1, 3, 3)
    assert found.pairs.goal_rotation is None


def test_bad_rows_are_kept_and_named():
    found = pairs.read(
        table(
            "a,1,2,3,4,5,6,",
            "b,1,nan,3,4,5,6,2",
            "c,1,2,three,4,5,6,2",
            "d,1,2,3,4,5,6,-1",
            "e,1,2,3,4,5,6,soon",
            header="id," + HEADER + ",duration",
        )
    )
    assert found.good.tolist() == [True, False, False, False, False]
    assert found.status[1] == "line 3, column 'y0': 'nan' is not a finite number"
    assert found.status[2] == "line 4, column 'z0': 'three' is not a finite number"
    assert found.status[3] == "line 5, column 'duration': '-1' is not a positive time in s"
    assert "line 6, column 'duration': 'soon'" in found.status[4]


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (table(), "holds no rows"),
        (table("1,2,3,4,5", header="x0,y0,z0,xg,yg"), "column 'zg' is missing"),
        (table("a,1,2,3,4,5,6", "a,1,2,3,4,5,7", header="id," + HEADER), "line 3: 'a' is also in"),
        (table("1,2,3,4,5,6,1", header=HEADER + ",rx0"), "column 'ry0' is missing"),
    ],
)
def test_a_table_that_is_no_table_of_pairs_is_refused(source, message):
    with pytest.raises(InputError, match=message):
        pairs.read(source)


def test_options_beat_config_which_beats_the_preset(tmp_path):
    (tmp_path / "c.toml").write_text("[fit]\nbasis = 40\nalpha_1 = 2.0\n")
    found = resolve(FitSettings, {"basis": 20, "tau": None}, "paper", tmp_path / "c.toml")
    assert (found.basis, found.alpha_1, found.widths) == (20, 2.0, "power")


def test_the_presets_of_the_package_are_whole():
    assert layers.preset_names() == ["default", "drag", "paper"]
    assert resolve(FitSettings, {}, "default") == FitSettings()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[fit]\nbasis = 0\n", r"p\.toml: \[fit\] basis = 0: input should be greater"),
        ("[fit]\ndamping = nan\n", r"p\.toml: \[fit\] damping = nan: input should be a finite"),
        ("[fit]\nbasics = 3\n", r"p\.toml: \[fit\] basics: no such setting"),
        ("[fit]\nmodel = 'new'\n", r"\[fit\] model = 'new': input should be 'modified' or"),
        ("[other]\n", r"has no \[fit\] section; it has \[other\]"),
        ("[units]\nlength = 'm'\n[fit]\n", r"\[units\] length = 'm': this program's are length in"),
        ("fit = [", "is not TOML"),
        ("fit = 3", "is not a section"),
    ],
)
def test_a_wrong_preset_is_refused_by_name(tmp_path, monkeypatch, text, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        resolve(FitSettings, {}, "p.toml")


def test_unknown_presets_and_missing_files_are_refused():
    with pytest.raises(InputError, match="no such preset; there are default, drag, paper"):
        resolve(FitSettings, {}, "fast")
    with pytest.raises(InputError, match="no such file"):
        resolve(FitSettings, {}, "none.toml")


@given(st.sampled_from(["duration", "rate", "ease_in", "snap_tol"]), st.floats())
def test_every_number_is_taken_or_refused_by_its_option(name, value):
    try:
        found = resolve(GeneralizeSettings, {name: value})
        assert np.isfinite(getattr(found, name))
    except InputError as error:
        assert str(error).startswith(f"--{name.replace('_', '-')} = ")
