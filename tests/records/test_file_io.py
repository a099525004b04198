"""Outputs appear whole or not at all; inputs that cannot be read are named."""

import errno
import os
import stat
from pathlib import Path

import pytest

from dmpcli.errors import InputError
from dmpcli.records import file_io
from dmpcli.records.atomic_text import growing


def test_write_replaces_whole_and_leaves_no_temporary(tmp_path):
    target = tmp_path / "a.json"
    target.write_bytes(b"old")
    file_io.write(target, b"new")
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.json"]


def test_the_new_name_is_on_the_disk_when_the_write_is_over(tmp_path, monkeypatch):
    synced = []

    def sync(number):
        # What is synced, and whether the output has its name by then.
        synced.append((stat.S_ISDIR(os.fstat(number).st_mode), (tmp_path / "out").exists()))

    monkeypatch.setattr(os, "fsync", sync)
    file_io.write(tmp_path / "out", b"new")
    assert synced == [(False, False), (True, True)]


def test_a_folder_that_cannot_be_synced_costs_nothing(tmp_path, monkeypatch):
    def sync(number):
        if stat.S_ISDIR(os.fstat(number).st_mode):
            raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(os, "fsync", sync)
    file_io.write(tmp_path / "out", b"new")
    assert (tmp_path / "out").read_bytes() == b"new"


def test_a_failing_write_keeps_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "a.json"
    target.write_bytes(b"old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"a\.json: cannot be written: No space left"):
        file_io.write(target, b"new")
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.json"]


def test_new_files_have_the_usual_mode(tmp_path):
    file_io.write(tmp_path / "a", b"x")
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
            file_io.read(path)


def test_outputs_that_cannot_be_written_are_refused_first(tmp_path):
    for path, message in (
        (tmp_path, "is a directory"),
        (tmp_path / "no" / "a", "does not exist"),
    ):
        with pytest.raises(InputError, match=message):
            file_io.check_writable(path)


def test_a_dataset_folder_is_refused_where_a_file_lies(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a file"):
        file_io.check_folder(tmp_path / "file")
    with pytest.raises(InputError, match="standard output"):
        file_io.check_folder("-")
    with pytest.raises(InputError, match="does not exist"):
        file_io.check_folder(tmp_path / "no" / "batch")


def test_a_link_is_followed_and_a_named_pipe_is_written_to(tmp_path):
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    file_io.write(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    file_io.write(tmp_path / "pipe", b"data")
    assert os.read(reader, 10) == b"data"
    os.close(reader)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_what_cannot_be_made_again_is_kept_beside_what_appeared(tmp_path):
    target = tmp_path / "run.parquet"
    assert file_io.write_new(target, b"mine") == target
    assert file_io.write_new(target, b"second") == tmp_path / "run-1.parquet"
    assert file_io.write_new(target, b"third") == tmp_path / "run-2.parquet"
    assert target.read_bytes() == b"mine"
    assert sorted(os.listdir(tmp_path)) == ["run-1.parquet", "run-2.parquet", "run.parquet"]


def test_a_file_system_without_links_replaces_nothing_either(tmp_path, monkeypatch):
    def link(*_, **__):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", link)
    target = tmp_path / "run.parquet"
    target.write_bytes(b"theirs")
    assert file_io.write_new(target, b"mine") == tmp_path / "run-1.parquet"
    assert target.read_bytes() == b"theirs"
    assert (tmp_path / "run-1.parquet").read_bytes() == b"mine"
    assert len(os.listdir(tmp_path)) == 2


@pytest.mark.parametrize("write", [file_io.write, file_io.write_new])
def test_a_temporary_follows_no_link_that_somebody_has_laid(write, tmp_path, monkeypatch):
    """Whatever the temporary's name: a link that lies there already is not written through."""
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    opened = os.open

    def lay_link_first(path, flags, *mode, **more):
        if str(path).endswith(".tmp"):
            os.symlink(victim, path)
        return opened(path, flags, *mode, **more)

    monkeypatch.setattr(os, "open", lay_link_first)
    with pytest.raises(InputError, match="cannot be written"):
        write(tmp_path / "out", b"new")
    assert victim.read_bytes() == b"precious"


def test_the_name_of_a_temporary_cannot_be_foreseen(tmp_path):
    trap = tmp_path / f".out.{os.getpid()}.tmp"
    trap.symlink_to(tmp_path / "victim")
    file_io.write(tmp_path / "out", b"new")
    assert not (tmp_path / "victim").exists()
    with growing(tmp_path, ["rows.csv"]) as (stream,):
        stream.write("1")
    assert (tmp_path / "rows.csv").read_text() == "1"
    assert not (tmp_path / "victim").exists()


@pytest.mark.parametrize(
    "name", ["..", "../part-00000.parquet", "/etc/passwd", "part-00000.parquet/..", "pairs.parquet",
             "part-00000.parquet\0", "part-1.parquet", ""]
)  # fmt: skip
def test_a_part_of_a_batch_is_one_of_its_folder(name, tmp_path):
    with pytest.raises(InputError, match="names the part"):
        file_io.part_in(tmp_path, name, "pairs.parquet")
    assert file_io.part_in(tmp_path, "part-00012.parquet", "") == tmp_path / "part-00012.parquet"


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="a file that tells no size")
def test_a_file_that_is_longer_than_it_tells_is_read_to_its_end():
    """As what the kernel tells of itself is, and a log that somebody writes."""
    assert Path("/proc/self/status").stat().st_size == 0
    assert b"\nThreads:" in file_io.read("/proc/self/status").content
