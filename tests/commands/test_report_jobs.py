"""``report`` of batches on meshes: whatever the processes, and as each stroke alone is reported."""

import csv
import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from dmpcli import extras
from dmpcli.cli import app
from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.records import schemas, skill
from dmpcli.records.record import Provenance, Record
from dmpcli.reporting.document import MOST_ROWS
from dmpcli.reporting.stroke_block import FIGURES
from tests.dmp.strokes import paper_stroke
from tests.extras_here import needs
from tests.reporting.example_files import put
from tests.surfaces import cases, fields

pytestmark = [needs(extras.FAST), pytest.mark.thorough]

COUNT, PART = 36, 12
ASTRAY = 4e-9
"""By how much a figure of a batch may miss that of the stroke alone, mm, degrees or none."""


def dmpcli(*words):
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == 0, (done.exit_code, done.stderr)
    return done


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    """A demonstration, its skill, a bumpy part and one with convex edges."""
    place = tmp_path_factory.mktemp("shop")
    stroke = paper_stroke(turning=True)
    result = fit([stroke], FitOptions())
    one = skill.Reproduction(sha256="0", duration=10.0, rms=0, largest=0, end=0, smoothing=0)
    (place / "skill.json").write_bytes(skill.encode(result.skill, [one], Provenance("fit")))
    columns = {"t": stroke.t} | dict(zip(schemas.POSITION, stroke.position.T, strict=True))
    put(place, "demo", Record(schemas.DEMONSTRATION, columns, Provenance("record")))
    bumpy = fields.square(cases.FIELDS["bumpy"], 3000)
    edged = cases.mesh("cylinder", 700)
    for name, (V, F) in {"bumpy": bumpy, "edged": (edged.V, edged.F)}.items():
        trimesh.Trimesh(V, F, process=False).export(place / f"{name}.ply")
    return place


def ends(name, count=COUNT):
    """Pairs about the middle of a part, (count, 6)."""
    rng = np.random.default_rng(len(name))
    if name == "bumpy":
        middle = rng.uniform(-15.0, 15.0, (count, 2))
        turn, half = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(15.0, 30.0, count)
        way = half[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.hstack([cases.FIELDS[name].point(*at.T) for at in (middle - way, middle + way)])
    # Along the part, so that waves go over its edges.
    angle, y = rng.uniform(-0.3, 0.3, (2, count)), rng.uniform(-45.0, -25.0, count)
    at = [(a, y + k * rng.uniform(50.0, 80.0, count)) for k, a in enumerate(angle)]
    return np.hstack([np.stack([60 * np.sin(a), y, 60 * np.cos(a) - 60], axis=1) for a, y in at])


def drawn(shop, folder, lines, *options):
    """Draw a table; its path."""
    table = shop / f"{folder.name}.csv"
    table.write_text("\n".join(lines) + "\n")
    dmpcli(
        *("generalize", shop / "skill.json", "-o", folder, "--pairs", table, "--on-error", "skip"),
        *("--snap-tol", 1, "--pairs-per-part", PART, "--kernels", "pure", "-q", *options),
    )
    return table


def lines_of(rows, names=None):
    """Lines of a table, of which each may name its surface."""
    head = ["id,x0,y0,z0,xg,yg,zg" + (",surface" if names else "")]
    for i, row in enumerate(rows):
        more = f",{names[i]}" if names else ""
        head.append(f"s{i}," + ",".join(f"{v:.6f}" for v in row) + more)
    return head


def kinds(shop):
    for name in ("bumpy", "edged"):
        on = ("--surface", shop / f"{name}.ply")
        yield name, lines_of(ends(name)), on
    names = ["bumpy.ply", "edged.ply"] * (COUNT // 2)
    rows = [ends(names[i].removesuffix(".ply"))[i] for i in range(COUNT)]
    yield "parts", lines_of(rows, names), ()


def printed(folder, name):
    with (folder / name).open(newline="") as stream:
        return list(csv.DictReader(stream))


def figures_of(row):
    """The figures of a stroke that was reported on its own, by name."""
    flat = row | {"wave_height": row["wave"]["mean"], "wave_spread": row["wave"]["spread"]}
    flat |= row["deviation"] or {}
    flat |= {f"surface_{key}": value for key, value in (row["surface"] or {}).items()}
    return {name: flat.get(name) for name in FIGURES}


def same_digits(text, value):
    """Tell whether six decimals are those of a value, or it lies half way to what they say."""
    if value is None or not text:
        return value is None and not text
    near = abs(float(text) - value) <= 0.5e-6 + ASTRAY
    beside = abs(1e6 * abs(value) % 1.0 - 0.5) <= 1e6 * ASTRAY
    return near and (text == f"{value:.6f}" or beside)


@pytest.mark.parametrize("number", range(3), ids=["bumpy", "edged", "parts"])
def test_batches_on_meshes_are_reported_alike_by_jobs_and_as_single_strokes(shop, tmp_path, number):
    name, lines, on = list(kinds(shop))[number]
    # Surfaces are named relative to the table.
    folder = tmp_path / name
    table = drawn(shop, folder, lines, *on)
    against = on or ("--pairs", table)
    found = {}
    for jobs in (1, 2):
        out = tmp_path / f"report-{jobs}"
        words = ["report", shop / "demo.parquet", folder, *against, "-o", out, "--jobs", jobs]
        document = json.loads(dmpcli(*words, "--kernels", "compiled", "--json").stdout)
        files = {n: (out / n).read_bytes() for n in ("strokes.csv", "wave_heights.csv")}
        found[jobs] = document, files
    assert found[1] == found[2]
    rows = {row["id"]: row for row in printed(tmp_path / "report-1", "strokes.csv")}
    assert len(rows) > 0.8 * COUNT
    assert sum(bool(row["surface_wave_height"]) for row in rows.values()) > 0.8 * len(rows)
    seen = 0
    for first in range(1, COUNT + 1, MOST_ROWS):
        few = tmp_path / f"few-{first}"
        some = drawn(shop, few, [lines[0], *lines[first : first + MOST_ROWS]], *on)
        words = ["report", shop / "demo.parquet", few, *(on or ("--pairs", some)), "--json"]
        document = json.loads(dmpcli(*words).stdout)
        for row in document["files"][1]["strokes"]:
            own = rows[row["stroke"].split("[")[1].rstrip("]")]
            for figure, value in figures_of(row).items():
                assert same_digits(own[figure], value), (row["stroke"], figure, own[figure], value)
            seen += 1
    assert seen == len(rows)
