"""Every importer as a function of bytes, with a small file that it reads."""

import io
import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dmpcli.formats import csv_table, gcode, krl, mcap_file, rapid, svg_paths, tum, urscript
from dmpcli.formats.toolpath import ProgramOptions
from dmpcli.records import layouts, recordings
from dmpcli.records.file_io import Source
from dmpcli.settings.import_file import ImportOptions
from dmpcli.workflows.import_file import sampled
from tests.formats.motions import motion, wave

SMALL = motion(wave(samples=25))
FLAT = motion(wave(samples=25, turning=False))
OPTIONS = ProgramOptions()
SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="50mm" viewBox="0 0 200 100">'
    b'<g transform="translate(5 5) rotate(10)"><path d="M 0 0 C 0 80, 200 80, 100 0 A 30 20 0 1 1 '
    b'50 50 Z"/></g><circle cx="100" cy="50" r="40"/><polyline points="0,0 10,20 30,5"/></svg>'
)


def parquet():
    one = SMALL.strokes[0]
    state = pa.array(np.ascontiguousarray(one.position).ravel())
    columns = {"t": one.t, "observation.state": pa.FixedSizeListArray.from_arrays(state, 3)}
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink)
    return sink.getvalue()


def table(layout=None):
    def read(content):
        recordings.read(Source("m.csv", content), layout)

    return read


def program(module):
    def read(content):
        for one in module.decode(Source("m", content)):
            sampled(one, ImportOptions().rate, "m")

    return read


LIST = layouts.Layout({axis: (f"observation.state[{i}]",) for i, axis in enumerate("xyz")})

IMPORTERS = {
    "csv": (table(), csv_table.encode(SMALL)),
    "tum": (table(layouts.LAYOUTS["tum"]), tum.encode(SMALL)),
    "parquet": (table(LIST), parquet()),
    "gcode": (program(gcode), gcode.encode(FLAT, OPTIONS)),
    "urscript": (program(urscript), urscript.encode(SMALL, OPTIONS, "m")),
    "krl": (program(krl), krl.encode(SMALL, OPTIONS, "m")),
    "rapid": (program(rapid), rapid.encode(SMALL, OPTIONS, "m")),
    "svg": (lambda content: svg_paths.decode(Source("m.svg", content)), SVG),
    "mcap": (
        lambda content: mcap_file.decode(io.BytesIO(content), "m.mcap", None),
        mcap_file.encode(SMALL),
    ),
}


def lerobot(folder, which):
    """A reader of a dataset of which one file is replaced by the bytes, and that file's bytes."""
    from dmpcli.formats import lerobot_dataset
    from dmpcli.workflows.motions import evenly

    lerobot_dataset.write(evenly(SMALL, 10.0), folder / "ds", 10, "draw")
    path = folder / "ds" / which
    content = path.read_bytes()
    assert which.endswith("parquet") or json.loads(content)

    def read(changed):
        path.write_bytes(changed)
        lerobot_dataset.read(folder / "ds", None)

    return read, content


def bag(folder, which):
    """The same of a ROS 2 bag."""
    from dmpcli.formats import ros_bag

    ros_bag.write(SMALL, folder / "bag")
    path = folder / "bag" / which
    content = path.read_bytes()

    def read(changed):
        path.write_bytes(changed)
        ros_bag.read(folder / "bag")

    return read, content


FOLDERS = {
    "lerobot info": (lerobot, "meta/info.json"),
    "lerobot data": (lerobot, "data/chunk-000/file-000.parquet"),
    "bag metadata": (bag, "metadata.yaml"),
    "bag storage": (bag, "bag.db3"),
}
