"""``report.html`` and ``view.html``: whole in themselves, the same twice, and true."""

import html.parser
import json
import re
from functools import partial
from importlib import resources

import jsonschema
import numpy as np
import pytest

from dmpcli.extras import VIEW
from dmpcli.records.record import Provenance, Record
from tests.commands.running import invoke
from tests.extras_here import needs
from tests.reporting.example_files import (
    NEW_GOAL,
    NEW_START,
    curved_trajectory,
    demonstration,
    fillet_mesh,
    fillet_wave,
    paper_files,
    put,
    put_stl,
    run,
    trajectory,
    wave,
)

dmpcli = partial(invoke, "report")


def pressed():
    """A run with a force that presses, and friction."""
    made = run(trajectory(wave(NEW_START, NEW_GOAL, 49.9)))
    n = len(made.t)
    wrench = {"fx": np.full(n, 1.5), "fy": np.zeros(n), "fz": 5.0 + np.sin(made.t)}
    columns = made.columns | wrench | {name: np.zeros(n) for name in ("tx", "ty", "tz")}
    said = Provenance("execute", {"coupling": "force", "force_setpoint": 5.0}, (), {})
    return Record(
        made.schema, columns, Provenance(said.command, said.options, (), made.provenance.facts)
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A report of a demonstration, strokes in two places on a curved part, and a run with force."""
    folder = tmp_path_factory.mktemp("pages")
    files = paper_files(folder)
    pressing = put(folder, "pressing", pressed())
    out = folder / "out"
    done = dmpcli(files["demo"], files["modified"], files["carried"], pressing, "-o", out, "-q")
    assert done.exit_code == 0, done.output
    return out


@pytest.fixture(scope="module")
def page(made):
    return (made / "report.html").read_text()


class Reader(html.parser.HTMLParser):
    """Reads a page: which tags are open, which words it has, what it names and refers to."""

    VOID = ("meta", "link", "br", "img", "input")

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.ids, self.refs, self.words = [], [], [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        known = dict(attrs)
        self.ids += [known["id"]] if "id" in known else []
        self.refs += [v for k, v in attrs if k in ("src", "href", "xlink:href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if self.open and self.open[-1] == tag and tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words += data


@pytest.mark.slow
def test_the_page_is_whole_in_itself_and_small(page):
    read = Reader(page)
    assert read.open == []
    assert "script" not in read.tags
    assert len(read.ids) == len(set(read.ids))
    for ref in read.refs:
        assert ref.startswith(("#", "data:")), ref
        assert not ref.startswith("#") or ref[1:] in read.ids, ref
    assert not re.search(r"url\((?!#)", page)
    assert 'name="viewport"' in page
    assert "@media print" in page
    assert len(page.encode()) <= 1_000_000


@pytest.mark.slow
def test_it_says_in_plain_words_what_was_drawn_and_how_well(page, made):
    words = Reader(page).words
    report = json.loads((made / "report.json").read_text())
    assert report["summary"]
    for sentence in report["summary"]:
        assert sentence.partition(": ")[2] in words
    assert "It pressed with" in words
    assert "49.98 mm high" in words
    assert re.search(r"\d{4}-\d\d-\d\d", words) is None


@pytest.mark.slow
def test_figures_are_called_by_what_they_show_and_stand_in_the_page(page, made):
    names = {path.stem for path in made.glob("*.svg")}
    assert names == {"plane", "time", "plane_2", "time_2", "force", "deadlines"}
    assert page.count("<svg") == len(names)
    assert page.count("<figcaption>") == len(names)
    assert not list(made.glob("*.png"))


@pytest.mark.slow
def test_files_stand_in_the_chain_with_hash_and_options(page, made):
    for entry in json.loads((made / "report.json").read_text())["files"]:
        assert entry["sha256"] in page
    assert "force_setpoint=5" in page


@pytest.mark.slow
def test_the_document_is_as_its_published_schema_says(made):
    folder = resources.files("dmpcli.records") / "json_schemas"
    schema = json.loads((folder / "report.schema.json").read_text())
    jsonschema.validate(json.loads((made / "report.json").read_text()), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"schema": "report"}, schema)


@pytest.fixture(scope="module")
def curved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("curved")
    path, normal = fillet_wave()
    return {
        "demo": put(folder, "demo", demonstration()),
        "along": put(folder, "along", curved_trajectory(path, normal)),
        "mesh": put_stl(folder, "fillet", *fillet_mesh()),
        "out": folder / "out",
    }


@pytest.mark.thorough
@needs(VIEW)
def test_a_part_is_drawn_and_can_be_turned_the_same_twice(curved):
    words = (curved["demo"], curved["along"], "--surface", curved["mesh"], "-o", curved["out"])
    assert dmpcli(*words, "--view", "-q").exit_code == 0
    first = {path.name: path.read_bytes() for path in curved["out"].iterdir()}
    assert {"report.html", "view.html", "plane.svg", "time.svg", "surface.svg"} <= set(first)
    surface = first["surface.svg"].decode()
    assert "data:image/png;base64," in surface
    assert "unrolled" in first["plane.svg"].decode()
    assert dmpcli(*words, "--view", "-q").exit_code == 0
    assert {path.name: path.read_bytes() for path in curved["out"].iterdir()} == first
    view = first["view.html"].decode()
    assert "<title>demo, along on fillet.stl</title>" in view
    assert 'name="viewport"' in view
    assert not re.search(r'(src|href)="https?:', view)
    assert len(view) <= 3_000_000
    # Without --view the page of another report would be taken for this one's.
    assert dmpcli(*words, "-q").exit_code == 0
    assert not (curved["out"] / "view.html").exists()


def test_pages_need_a_folder(curved):
    for option in ("--view", "--open"):
        done = dmpcli(curved["demo"], option)
        assert done.exit_code == 2
        assert "-o DIR" in done.stderr


@pytest.mark.slow
def test_open_shows_the_page(curved, monkeypatch, tmp_path):
    shown = []
    monkeypatch.setattr("typer.launch", shown.append)
    assert dmpcli(curved["demo"], "-o", tmp_path / "r", "--open", "-q").exit_code == 0
    assert shown == [str(tmp_path / "r" / "report.html")]


def test_without_the_extra_view_says_how_to_install_it(curved, monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "k3d", None)
    done = dmpcli(curved["demo"], "-o", tmp_path / "r", "--view")
    assert done.exit_code == 2
    assert "pip install 'dmpcli[view]'" in done.stderr
    assert not (tmp_path / "r").exists()


def test_what_is_rounding_alone_is_no_end_of_a_scale():
    from dmpcli.reporting.turnable import Quantity

    off = Quantity("off the surface", "mm", [np.array([-1e-14, 3e-13]), np.array([np.nan])])
    assert off.limits == (0.0, 1.0)
    speed = Quantity("speed", "mm/s", [np.array([4.58e-13, 35.7])])
    assert speed.limits == (0.0, 35.7)
