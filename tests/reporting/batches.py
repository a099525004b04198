"""Batches in folders, made from strokes of known shape, for the tests of report."""

import json

import numpy as np

from dmpcli.records import manifest, schemas
from dmpcli.records.record import Provenance, Record, encode
from dmpcli.records.schemas import EULER_ANGLES, NORMAL, POSITION

ORIGIN = Provenance("generalize", {"rate": 50.0}, ({"role": "skill", "sha256": "0" * 64},))


def put_batch(folder, parts, failed=(), facts=None, row_group=None, ends=None):
    """Write a finished batch.

    `parts` holds lists of (t, columns): x y z (n, 3) under "path", perhaps "normals", "euler";
    "normal" is the plane's. `failed` are statuses of further pairs. Ids count from 1.
    """
    folder.mkdir()
    facts = {"model": "modified", "forcing_scale": None} | (facts or {})
    rows, entries, number = [], [], 0
    for n, part in enumerate(parts):
        name, ids = f"part-{n:05d}.parquet", []
        for stroke in part:
            number += 1
            ids.append(str(number))
            path = stroke["path"]
            start, goal = stroke.get("ends", (path[0], path[-1]))
            normal = stroke.get("normal", [np.nan] * 3)
            rows.append((str(number), *start, *goal, *normal, name, "ok"))
        columns = {
            "id": np.repeat(np.array(ids, dtype=object), [len(s["t"]) for s in part]),
            "t": np.concatenate([s["t"] for s in part]),
        }
        for key, names in (("path", POSITION), ("euler", EULER_ANGLES), ("normals", NORMAL)):
            if key in part[0]:
                values = np.concatenate([s[key] for s in part])
                columns |= dict(zip(names, values.T, strict=True))
        origin = Provenance(ORIGIN.command, ORIGIN.options, ORIGIN.inputs, facts)
        (folder / name).write_bytes(encode(Record(schemas.TRAJECTORY, columns, origin)))
        if row_group:
            regrouped(folder / name, row_group)
        size = (folder / name).stat().st_size
        entries.append(
            manifest.Entry(file=name, pairs=len(part), rows=len(columns["t"]), bytes=size)
        )
    for status in failed:
        number += 1
        rows.append((str(number), *[0.0] * 3, *[9.0] * 3, *[np.nan] * 3, "", status))
    names = ["id", "x0", "y0", "z0", "xg", "yg", "zg", *NORMAL, "part", "status"]
    texts = {"id", "part", "status"}
    table = {
        name: np.array(values, dtype=object if name in texts else float)
        for name, values in zip(names, zip(*rows, strict=True), strict=True)
    }
    (folder / "pairs.parquet").write_bytes(encode(Record(schemas.PAIRS, table, ORIGIN)))
    text = json.dumps(manifest.document(entries, number, number - len(failed), ORIGIN))
    (folder / "_manifest.json").write_text(text)
    return folder


def regrouped(path, rows):
    """Write a Parquet file anew in row groups of so many rows."""
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    pq.write_table(table, path, row_group_size=rows)
