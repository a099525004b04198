"""Objects are whole or not there, whatever befalls the requests; what a store says is told."""

import errno
import os
import re
import subprocess
import sys

import pytest

from dmpcli.errors import InputError, InstrumentError
from dmpcli.records import file_io, object_store
from dmpcli.records.draft import Draft
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import located
from tests.object_store import BUCKET, SECRETS, Fault, empty, environment_of, served

BIG = bytes(range(256)) * (100 << 10)
"""25 MiB: more than one request takes."""


@pytest.fixture(scope="module")
def running():
    with served() as store:
        yield store


@pytest.fixture
def store(running, monkeypatch):
    for name in list(os.environ):
        if name.startswith("AWS_"):
            monkeypatch.delenv(name)
    for name, value in running.environment.items():
        monkeypatch.setenv(name, value)
    empty(running)
    yield running
    empty(running)


def at(key):
    return ObjectPath(f"s3://{BUCKET}", key)


@pytest.mark.slow
def test_what_was_put_is_there_under_its_name_and_nothing_else(store):
    keys = ["a", "folder/b.csv", "trip data/a+b%20c?d#é@:.html"]
    for key in keys:
        assert at(key).put(key.encode()).st_size == len(key.encode())
    assert store.objects() == {key: key.encode() for key in keys}
    assert [at(key).read_bytes() for key in keys] == [key.encode() for key in keys]
    found = store.client().head_object(Bucket=BUCKET, Key=keys[2])
    assert found["ContentType"] == "text/html"


def test_folders_are_what_names_begin_with(store):
    at("f/part-00000.parquet").put(b"12")
    at("f/g/c").put(b"")
    for name in ("f", "f/g", ""):
        assert at(name).is_dir()
        assert not at(name).is_file()
    assert at("f/g/c").is_file()
    assert not at("f/g/c").is_dir()
    assert not at("f/h").exists()
    assert [(one.name, one.folder) for one in at("f").entries()] == [
        ("g", True),
        ("part-00000.parquet", False),
    ]
    assert [str(path) for path in at("f").glob("part-*")] == [f"s3://{BUCKET}/f/part-00000.parquet"]
    assert at("nothing").entries() == []
    listed = at("f").entries()[1].known
    assert listed == at("f/part-00000.parquet").stat()


def test_an_object_that_is_missing_is_a_missing_file(store):
    for ask in (ObjectPath.stat, ObjectPath.read_bytes, ObjectPath.unlink, ObjectPath.open):
        with pytest.raises(FileNotFoundError) as error:
            ask(at("no"))
        assert error.value.errno == errno.ENOENT
    at("no").unlink(missing_ok=True)
    with pytest.raises(InputError, match=f"s3://{BUCKET}/no: no such file"):
        file_io.read(f"s3://{BUCKET}/no")


@pytest.mark.slow
def test_an_object_is_read_piece_by_piece_as_a_file_is(store):
    at("t").put(b"one\ntwo\nthree\n" * 20_000)
    with at("t").open("rb") as stream:
        assert stream.readline() == b"one\n"
        stream.seek(-6, os.SEEK_END)
        assert stream.read() == b"three\n"
        assert stream.seek(4) == 4
        assert stream.read(4) == b"two\n"
    with at("t").open(encoding="utf-8") as text:
        assert sum(1 for _ in text) == 60_000


def test_what_is_removed_is_gone_and_replaced_is_as_the_last_one_wrote_it(store):
    at("x/a").put(b"first")
    at("x/a").put(b"second")
    assert store.objects() == {"x/a": b"second"}
    at("x/a").unlink()
    assert store.objects() == {}


@pytest.mark.sweep(kept=2)
@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    [
        Fault("POST", "uploads$"),
        Fault("PUT", "partNumber=1&", "500 Oops", "InternalError"),
        Fault("PUT", "partNumber=2", "500 Oops", "InternalError"),
        Fault("POST", "uploadId=", "200 OK", "InternalError"),
        Fault("POST", "uploadId=", "503 Slow Down"),
        Fault("PUT", "partNumber=2", "403 Forbidden", "AccessDenied"),
    ],
    ids=lambda fault: f"{fault.method}-{fault.path}-{fault.status[:3]}",
)
def test_an_upload_that_fails_leaves_what_was_there(store, monkeypatch, fault):
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "2")
    at("old").put(b"as it was")
    store.faults.append(fault)
    for name in ("old", "new"):
        with pytest.raises((InputError, InstrumentError), match=f"s3://{BUCKET}/{name}: the store"):
            at(name).put(BIG)
    assert store.objects() == {"old": b"as it was"}


@pytest.mark.slow
def test_an_upload_that_failed_does_not_appear_when_python_ends(store):
    """Arrow would complete it then: https://github.com/apache/arrow/issues/40502."""
    program = f"""
from dmpcli.errors import DmpError
from dmpcli.records.object_store import ObjectPath
try:
    ObjectPath("s3://{BUCKET}", "new").put(bytes({len(BIG)}))
except DmpError as error:
    print(error)
"""
    store.faults.append(Fault("PUT", "partNumber=2", "500 Oops", "InternalError"))
    words = [sys.executable, "-c", program]
    environment = environment_of(store) | {"AWS_MAX_ATTEMPTS": "2"}
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == (
        f"s3://{BUCKET}/new: the store fails (INTERNAL_FAILURE); the same command goes on from "
        "here\n"
    )
    assert done.stderr == ""
    assert store.objects() == {}


@pytest.mark.slow
def test_throttled_and_failing_requests_are_made_again(store):
    store.faults += [
        Fault("PUT", "/k", times=1),
        Fault("PUT", "partNumber=2", "500 Oops", "InternalError", times=1),
        Fault("POST", "uploadId", "503 Slow Down", times=1),
        Fault("GET", "/k", times=1),
        Fault("HEAD", "/k", times=1),
    ]
    at("k").put(b"small")
    at("l").put(BIG)
    assert at("k").read_bytes() == b"small"
    assert store.objects() == {"k": b"small", "l": BIG}
    assert all(fault.times == 0 for fault in store.faults)


COMPLAINTS = [
    (Fault("PUT", "/k", "503 Slow Down", "SlowDown"), 4, "has no time .SLOW_DOWN., asked 1 times"),
    (Fault("PUT", "/k", "500 Oops", "InternalError"), 4, "the store fails .INTERNAL_FAILURE"),
    (Fault("PUT", "/k", "507 Full", "QuotaExceeded"), 4, "the store fails .QuotaExceeded"),
    (Fault("PUT", "/k", "403 Forbidden", "AccessDenied"), 2, "refuses it .ACCESS_DENIED"),
    (
        Fault("PUT", "/k", "403 Forbidden", "InvalidAccessKeyId"),
        2,
        "refuses it .INVALID_ACCESS_KEY",
    ),
    (Fault("PUT", "/k", "403 Forbidden", "SignatureDoesNotMatch"), 2, "refuses it .SIGNATURE_DOES"),
    (Fault("PUT", "/k", "400 Bad", "ExpiredToken"), 2, "refuses it .ExpiredToken"),
    (Fault("HEAD", "/k", "403 Forbidden"), 2, "refuses it .ACCESS_DENIED"),
    (Fault("PUT", "/k", "301 Moved", "PermanentRedirect"), 2, "another region .PermanentRedirect"),
    (Fault("PUT", "/k", "404 No", "NoSuchBucket"), 2, "there is no such bucket"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "code", "said"), COMPLAINTS, ids=lambda one: str(one))
def test_what_a_store_complains_of_is_told_by_its_code_alone(store, monkeypatch, fault, code, said):
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    store.faults.append(fault)
    with pytest.raises((InputError, InstrumentError), match=said) as error:
        at("k").put(b"x")
    assert error.value.exit_code == code
    assert len(str(error.value).splitlines()) == 1
    assert "a fault of ours" not in str(error.value)
    assert not any(secret in str(error.value) for secret in SECRETS.values())


def test_without_credentials_it_is_said_that_there_are_none(store, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in SECRETS:
        monkeypatch.delenv(name)
    store.faults.append(Fault("HEAD", ".*", "403 Forbidden"))
    object_store._reached.cache_clear()
    with pytest.raises(InputError, match=r"no credentials are set: AWS_ACCESS_KEY_ID"):
        at("k").exists()


def test_a_bucket_that_is_not_there_is_told_before_anything_is_made(store):
    for ask in (file_io.read, file_io.check_writable, file_io.check_folder):
        with pytest.raises(InputError, match=r"^s3://nobodys: there is no such bucket"):
            ask("s3://nobodys/x")


def test_a_store_that_nobody_serves_is_not_reached(store, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    with pytest.raises(InstrumentError, match=r"not reached \(NETWORK_CONNECTION\)") as error:
        at("k").exists()
    assert error.value.exit_code == 4
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize(
    "url", ["127.0.0.1:9", "ftp://host", "http://", "http://k:s3cr3t@host", "http://host/x"]
)
def test_an_endpoint_that_is_none_is_refused_and_not_repeated(store, monkeypatch, url):
    monkeypatch.setenv("AWS_ENDPOINT_URL", url)
    with pytest.raises(InputError, match=r"^AWS_ENDPOINT_URL: must be") as error:
        at("k").exists()
    assert "s3cr3t" not in str(error.value)


def test_the_region_of_a_bucket_is_asked_for_where_nothing_names_it(store, monkeypatch):
    from pyarrow import fs

    monkeypatch.delenv("AWS_ENDPOINT_URL")
    monkeypatch.delenv("AWS_REGION")
    monkeypatch.setattr(fs, "resolve_s3_region", lambda bucket: "eu-central-1")
    asked, _ = object_store._file_system("s3://somewhere", 1, ("", ""))
    assert asked.region == "eu-central-1"


def test_other_stores_come_from_the_same_code(monkeypatch):
    """They are made, and asked nothing: there is no server of theirs here."""
    from pyarrow import fs

    made, bucket = object_store._file_system("gs://bucket", 1, ("", ""))
    assert isinstance(made, fs.GcsFileSystem)
    assert bucket == "bucket"
    url = "abfs://box@account.dfs.core.windows.net"
    made, bucket = object_store._file_system(url, 1, ("", ""))
    assert isinstance(made, fs.AzureFileSystem)
    assert bucket == "box"


def test_a_key_file_that_is_not_there_is_told(monkeypatch):
    monkeypatch.setenv("GOOGLE_APPLICATION_CREDENTIALS", "/no/key.json")
    with pytest.raises(
        InputError, match=r"^GOOGLE_APPLICATION_CREDENTIALS: /no/key\.json: no such"
    ):
        object_store._file_system("gs://bucket", 2, ("", ""))


@pytest.mark.parametrize("text", ["import os; os.abort()", "import time; time.sleep(60)"])
def test_a_client_that_ends_its_process_or_never_answers_is_told(monkeypatch, text):
    """Arrow's for Azure ends by abort where no credentials are found."""
    monkeypatch.setattr(object_store, "_ASK", text)
    monkeypatch.setattr(object_store, "_APART", 5.0)
    with pytest.raises((InputError, InstrumentError), match=r"credentials for Azure|not reached"):
        ObjectPath("abfs://box@account.dfs.core.windows.net", "k").exists()


def test_a_draft_is_sent_when_it_is_whole_and_not_before(store):
    draft = Draft(at("d"))
    draft.stream.write(b"half")
    draft.settle()
    assert store.objects() == {}
    draft.stream.write(b" and half")
    assert draft.keep() == 13
    draft.drop()
    assert store.objects() == {"d": b"half and half"}
    dropped = Draft(at("e"))
    dropped.stream.write(b"half")
    dropped.drop()
    assert Draft(at("f")).keep() == 0
    assert store.objects() == {"d": b"half and half", "f": b""}


def test_what_cannot_be_made_again_is_not_written_into_a_store(store):
    with pytest.raises(InputError, match="on this machine"):
        file_io.write_new(f"s3://{BUCKET}/run.parquet", b"x")
    assert store.objects() == {}


def test_an_upload_that_somebody_else_overwrites_is_told(store):
    def other(method, path):
        if method == "HEAD" and re.search("/k$", path) and not seen:
            seen.append(path)
            store.client().put_object(Bucket=BUCKET, Key="k", Body=b"somebody's")

    seen = []
    at("x").put(b"1")
    store.happened = other
    with pytest.raises(InstrumentError, match="does somebody else write there"):
        at("k").put(b"ours")


def test_files_of_this_machine_are_written_as_ever(tmp_path):
    place = located(f"file://{tmp_path}/a.txt")
    file_io.write(place, b"here")
    assert (tmp_path / "a.txt").read_bytes() == b"here"
    draft = Draft(place)
    draft.stream.write(b"there")
    assert (tmp_path / "a.txt").read_bytes() == b"here"
    assert len(list(tmp_path.iterdir())) == 2
    assert draft.keep() == 5
    draft.drop()
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"there"]
