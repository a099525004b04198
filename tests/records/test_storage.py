"""What a name means: a file here, or an object; and what of it may be shown."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmpcli.errors import InputError
from dmpcli.records.object_store import ObjectPath
from dmpcli.records.storage import beside, hidden, located


def test_names_without_a_scheme_are_files_of_this_machine_as_ever():
    for name in ("a.csv", "./a/b", "/a", "-", "C:a", "a:b/c", "s3", "s3.d/x"):
        assert located(name) == Path(name)
    given = Path("x")
    assert located(given) is given


@pytest.mark.parametrize(
    ("url", "path"),
    [
        ("file:///data/pairs.csv", "/data/pairs.csv"),
        ("file://localhost/data/a%20b%25.csv", "/data/a b%.csv"),
        ("FILE:///data/a+b", "/data/a+b"),
    ],
)
def test_file_urls_are_files_of_this_machine(url, path):
    assert located(url) == Path(path)


@pytest.mark.parametrize("url", ["file://data/pairs.csv", "file://data", "file://host/x"])
def test_file_urls_of_no_whole_path_are_refused(url):
    with pytest.raises(InputError, match="must be whole"):
        located(url)


@pytest.mark.parametrize(
    ("url", "root", "key"),
    [
        ("s3://bucket/a/b.csv", "s3://bucket", "a/b.csv"),
        ("S3://bucket/batch/", "s3://bucket", "batch"),
        ("s3://bucket", "s3://bucket", ""),
        ("s3://bucket/", "s3://bucket", ""),
        (
            "s3://bucket/trip data/a+b%20c?d#e@f:g.csv",
            "s3://bucket",
            "trip data/a+b%20c?d#e@f:g.csv",
        ),
        ("gs://bucket/k", "gs://bucket", "k"),
        (
            "abfs://box@account.dfs.core.windows.net/k",
            "abfs://box@account.dfs.core.windows.net",
            "k",
        ),
        ("abfss://box@a.net/k", "abfss://box@a.net", "k"),
    ],
)
def test_keys_stand_in_a_name_as_they_are(url, root, key):
    assert located(url) == ObjectPath(root, key)
    assert located(str(located(url))) == ObjectPath(root, key)


@pytest.mark.parametrize(
    "url", ["s3://bucket//a", "s3://bucket/a//b", "s3://bucket/../a", "s3://bucket/./a"]
)
def test_names_with_empty_parts_or_dots_are_refused(url):
    with pytest.raises(InputError, match="no empty part"):
        located(url)


@pytest.mark.parametrize("url", ["s3://", "s3:///a", "gs:// /a"])
def test_names_of_no_bucket_are_refused(url):
    with pytest.raises(InputError, match="no bucket"):
        located(url)


@pytest.mark.parametrize(
    ("url", "meant"),
    [("s3a://b/k", "s3:// is meant"), ("gcs://b/k", "gs:// is meant"), ("http://b/k", "no kind")],
)
def test_other_schemes_are_refused_with_what_was_meant(url, meant):
    with pytest.raises(InputError, match=meant):
        located(url)


def test_what_a_path_made_of_a_url_is_refused():
    with pytest.raises(InputError, match="names a store"):
        located(Path("s3://bucket/key"))


SECRET = "wJalr/XUtnFEMI"


@pytest.mark.parametrize(
    "url",
    [
        f"s3://AKIA123:{SECRET}@bucket/key",
        "s3://AKIA123@bucket/key",
        f"gs://user:{SECRET}@bucket/key",
        f"abfs://box:{SECRET}@account.dfs.core.windows.net/key",
        f"http://AKIA123:{SECRET}@host/key",
    ],
)
def test_credentials_in_a_name_are_refused_and_shown_nowhere(url):
    with pytest.raises(InputError) as error:
        located(url)
    for word in (str(error.value), hidden(url), hidden(f"--pairs={url}"), hidden(f"-o={url}")):
        assert "AKIA123:" not in word
        assert SECRET not in word
        assert SECRET.split("/")[1] not in word


SIGNED = "X-Amz-Credential=AKIA123&X-Amz-Signature=0f0f0f&X-Amz-Security-Token=TOKEN"


@pytest.mark.parametrize(
    "url",
    [
        f"https://bucket.s3.amazonaws.com/in/p.csv?{SIGNED}",
        f"HTTPS://bucket.s3.amazonaws.com/in/p.csv?list-type=2&{SIGNED}",
        f"s3://bucket/p.csv?{SIGNED}",
        f"s3a://bucket/p.csv?{SIGNED}",
        "s3://bucket/p.csv?access_key=AKIA123&secret_key=0f0f0f",
        "abfs://box@account.dfs.core.windows.net/p.csv?sv=2022-11-02&sig=0f0f0f",
        "https://account.blob.core.windows.net/box/p.csv?sv=2022-11-02&sig=0f0f0f",
        "wasbs://box@account.blob.core.windows.net/p.csv?sv=2022-11-02&sig=0f0f0f",
    ],
)
def test_what_signs_a_link_is_shown_nowhere(url):
    with pytest.raises(InputError) as error:
        located(url)
    for word in (str(error.value), hidden(url), hidden(f"--pairs={url}"), hidden(f"-o={url}")):
        assert "p.csv?***" in word
        assert not any(secret in word for secret in ("0f0f0f", "AKIA123", "TOKEN"))


@pytest.mark.parametrize("option", ["region=us-east-1", "a=b&endpoint_override=localhost:9000"])
def test_options_as_arrows_own_names_take_them_are_refused_and_not_part_of_a_key(option):
    with pytest.raises(InputError, match="holds no options"):
        located(f"s3://bucket/batch?{option}")


def test_a_question_mark_may_be_part_of_a_key():
    assert located("s3://bucket/what?.csv") == ObjectPath("s3://bucket", "what?.csv")


def test_azures_names_have_an_account():
    with pytest.raises(InputError, match="names no account, as in abfs://CONTAINER@ACCOUNT"):
        located("abfs://box/key")


def test_what_holds_no_credentials_is_shown_as_it_is():
    for word in (
        "s3://bucket/a@b:c",
        "tcp://host:8786",
        "elite://192.168.1.20:8055?mode=file",
        "s3://bucket/what?.csv",
        "abfs://box@account.dfs.core.windows.net/k",
        "a:b@c",
    ):
        assert hidden(word) == word


@pytest.mark.parametrize(
    ("folder", "name", "meant"),
    [
        ("s3://b/tables", "parts/a.stl", "s3://b/tables/parts/a.stl"),
        ("s3://b/tables", "../parts/./a.stl", "s3://b/parts/a.stl"),
        ("s3://b/tables", "s3://c/a.stl", "s3://c/a.stl"),
        ("s3://b", "a.stl", "s3://b/a.stl"),
        ("s3://b/tables", "/a.stl", "/a.stl"),
        ("tables", "../a.stl", "tables/../a.stl"),
        ("tables", "s3://c/a.stl", "s3://c/a.stl"),
        ("tables", "/a.stl", "/a.stl"),
    ],
)
def test_names_in_a_table_begin_in_its_folder_unless_they_are_whole(folder, name, meant):
    assert str(beside(located(folder), name)) == meant


KEYS = st.lists(
    st.text(st.characters(exclude_characters="/", exclude_categories=("Cs", "Cc")), min_size=1)
    .filter(lambda part: part not in (".", ".."))
    .filter(lambda part: part == part.strip()),
    min_size=1,
    max_size=4,
)


@pytest.mark.slow
@given(KEYS)
def test_an_object_path_answers_as_a_path_of_this_machine_does(parts):
    here, there = Path("/bucket", *parts), ObjectPath("s3://bucket")
    for part in parts:
        there = there / part
    assert located(str(there)) == there
    assert (there.name, there.stem, there.suffix) == (here.name, here.stem, here.suffix)
    assert there.parent.key == "/".join(here.parent.parts[2:])
    assert there.absolute() == there
