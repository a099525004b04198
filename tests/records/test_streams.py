"""Outputs appear whole or not at all; inputs that cannot be read are named."""

import os
import stat

import pytest

from dmpcli.errors import InputError
from dmpcli.records import streams


def test_write_replaces_whole_and_leaves_no_temporary(tmp_path):
    target = tmp_path / "a.json"
    target.write_bytes(b"old")
    streams.write(target, b"new")
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.json"]


def test_a_failing_write_keeps_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "a.json"
    target.write_bytes(b"old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"a\.json: cannot be written: No space left"):
        streams.write(target, b"new")
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.json"]


def test_new_files_have_the_usual_mode(tmp_path):
    streams.write(tmp_path / "a", b"x")
    (tmp_path / "b").write_bytes(b"x")
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == stat.S_IMODE(
        (tmp_path / "b").stat().st_mode
    )


def test_inputs_that_cannot_be_read_are_named(tmp_path):
    (tmp_path / "empty").touch()
    for path, message in (
        (tmp_path, "is a directory"),
        (tmp_path / "none", "no such file"),
        (tmp_path / "empty", "is empty"),
    ):
        with pytest.raises(InputError, match=message):
            streams.read(path)


def test_outputs_that_cannot_be_written_are_refused_first(tmp_path):
    for path, message in (
        (tmp_path, "is a directory"),
        (tmp_path / "no" / "a", "does not exist"),
    ):
        with pytest.raises(InputError, match=message):
            streams.check_writable(path)


def test_a_dataset_folder_is_refused_where_a_file_lies(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a file"):
        streams.check_folder(tmp_path / "file")
    with pytest.raises(InputError, match="standard output"):
        streams.check_folder("-")
    with pytest.raises(InputError, match="does not exist"):
        streams.check_folder(tmp_path / "no" / "batch")


def test_a_dataset_folder_begins_without_the_parts_of_an_older_one(tmp_path):
    for name in ("part-00000.parquet", "pairs.parquet", "notes.txt"):
        (tmp_path / name).touch()
    streams.begin_folder(tmp_path)
    assert os.listdir(tmp_path) == ["notes.txt"]
