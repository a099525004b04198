"""Files are called what people call them: no name is markup, a formula, or left out."""

import re
import warnings
from html import unescape

import pytest

from tests.commands.running import invoke

NAMES = [
    "_cost $5 and $6",  # matplotlib leaves such beginnings out, and reads what is between dollars
    "a$x_{$b <b>&amp;",  # no formula; and browsers read tags
    "run [bold]2[red] at 12:100:00",  # rich reads markup, and emoji
    "Müller ß 日本 {id}",
]


def wave(height):
    from tests.reporting.example_files import demonstration
    from tests.reporting.example_files import wave as points

    made = demonstration(points(height=height, n=101), dt=0.08)
    x, y, z = (made.columns[name] for name in "xyz")
    rows = "\n".join(f"{t:.3f},{a:.5f},{b:.5f},{c:.5f}" for t, a, b, c in zip(
        made.columns["t"], x, y, z, strict=True))  # fmt: skip
    return f"t,x,y,z\n{rows}\n"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("odd")
    files = []
    for k, name in enumerate(NAMES):
        file = folder / f"{name}.csv"
        file.write_text(wave(30.0 + k))
        files.append(file)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        done = invoke("report", *files, "-o", folder / "out")
    assert done.exit_code == 0, done.stderr + repr(done.exception)
    return folder / "out", done


def words(text):
    return unescape(re.sub(r"<[^>]*>", " ", text))


@pytest.mark.slow
def test_tables_page_and_legends_call_every_file_what_it_is_called(made):
    out, done = made
    page = (out / "report.html").read_text()
    plane = words((out / "plane.svg").read_text())
    told = words(page.partition("<main>")[2])
    for name in NAMES:
        assert name in done.stdout, name
        assert name in told, name
        assert f"{name}: demonstration" in plane, name
    assert "<b>&amp;.csv" not in page


@pytest.mark.slow
def test_files_of_one_name_in_two_folders_are_told_apart(tmp_path):
    for k, folder in enumerate(("method1", "method2")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "traj01.csv").write_text(wave(30.0 + 5.0 * k))
    files = [tmp_path / folder / "traj01.csv" for folder in ("method1", "method2")]
    done = invoke("report", *files, "-o", tmp_path / "out", "-q")
    assert done.exit_code == 0
    plane = words((tmp_path / "out" / "plane.svg").read_text())
    found = re.findall(r"[12]\s+(\S+…\S+|\S+traj01.csv): demonstration", plane)
    assert len(set(found)) == 2
