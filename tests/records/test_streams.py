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


def write_dataset(path, content):
    with streams.dataset(path) as folder:
        (folder / "part-00000.parquet").write_bytes(content)
        (folder / "pairs.parquet").write_bytes(content)


def test_a_dataset_replaces_an_older_one_and_leaves_other_files_alone(tmp_path):
    batch = tmp_path / "batch"
    batch.mkdir()
    for name in ("part-00000.parquet", "part-00001.parquet", "pairs.parquet", "notes.txt"):
        (batch / name).write_bytes(b"old")
    write_dataset(batch, b"new")
    assert {p.name: p.read_bytes() for p in batch.iterdir()} == {
        "part-00000.parquet": b"new",
        "pairs.parquet": b"new",
        "notes.txt": b"old",
    }
    assert os.listdir(tmp_path) == ["batch"]


@pytest.mark.parametrize("error", [InputError, KeyboardInterrupt, SystemExit, ZeroDivisionError])
def test_an_older_dataset_stays_whole_when_the_new_one_fails(tmp_path, error):
    write_dataset(tmp_path / "batch", b"old")

    def interrupted():
        with streams.dataset(tmp_path / "batch") as folder:
            (folder / "part-00000.parquet").write_bytes(b"half")
            raise error

    with pytest.raises(error):
        interrupted()
    assert os.listdir(tmp_path) == ["batch"]
    assert (tmp_path / "batch" / "part-00000.parquet").read_bytes() == b"old"
    assert (tmp_path / "batch" / "pairs.parquet").read_bytes() == b"old"


def test_a_link_is_followed_and_a_named_pipe_is_written_to(tmp_path):
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    streams.write(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    streams.write(tmp_path / "pipe", b"data")
    assert os.read(reader, 10) == b"data"
    os.close(reader)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
