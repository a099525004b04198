"""The importers of other programs' files: from the bytes to the demonstration that is written."""

import functools
import io
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.mutations.guard import Read, Reader
from dmpcli.formats import (
    csv_table,
    gcode,
    krl,
    lerobot_dataset,
    mcap_file,
    rapid,
    ros_bag,
    tum,
    urscript,
)
from dmpcli.formats.motion import Motion, MotionStroke
from dmpcli.formats.pose_series import PoseBlocks
from dmpcli.formats.toolpath import ProgramOptions
from dmpcli.records import layouts, record
from dmpcli.records.file_io import Source
from dmpcli.records.layouts import Layout
from dmpcli.settings.import_file import ImportOptions
from dmpcli.spatial.rotations import from_euler
from dmpcli.workflows.import_file import demonstrations, strokes_of
from dmpcli.workflows.motions import evenly

_SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="50mm" viewBox="0 0 200 100">'
    b'<g transform="translate(5 5) rotate(10)"><path d="M 0 0 C 0 80, 200 80, 100 0 A 30 20 0 1 1 '
    b'50 50 Z"/></g><circle cx="100" cy="50" r="40"/><polyline points="0,0 10,20 30,5"/></svg>'
)
_LIST = Layout({axis: (f"observation.state[{i}]",) for i, axis in enumerate("xyz")})
_OPTIONS, _NAME = ProgramOptions(), "m"


def motion(turning: bool = True, samples: int = 20) -> Motion:
    """Return a stroke whose tool leans and turns on the way, with a wrench."""
    s = np.linspace(0.0, 1.0, samples)
    place = [500.0 + 110.0 * s, 24.0 * np.sin(2.0 * np.pi * s), 30.0 + 3.0 * np.cos(5.0 * s)]
    lean = 0.3 * np.sin(4.0 * s) * turning
    R = from_euler(np.column_stack([np.pi - lean, 0.5 * lean, lean]))
    wrench = np.column_stack([s, 0.0 * s, 5.0 + s, 0.1 * s, 0.0 * s, 0.0 * s])
    one = MotionStroke(4.0 * s**1.2, np.column_stack(place), R, wrench=wrench)
    return Motion("wave.parquet", "trajectory", [one])


def _written(strokes: Sequence[MotionStroke | PoseBlocks], name: str) -> None:
    for one in strokes:
        record.store_groups(demonstrations(one, (), {}, name), io.BytesIO())


def _whole(kind: str, form: Layout | None = None) -> Read:
    def read(source: Source) -> None:
        _written(strokes_of(source, kind, ImportOptions(), form), source.name)

    return read


def _parquet() -> bytes:
    one = motion().strokes[0]
    state = pa.array(np.ascontiguousarray(one.position).ravel())
    columns = {"t": one.t, "observation.state": pa.FixedSizeListArray.from_arrays(state, 3)}
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink)
    return sink.getvalue()


def _matrices() -> bytes:
    """A table of libfranka's: poses as matrices, column by column."""
    one = motion().strokes[0]
    assert one.rotation is not None
    pose = np.tile(np.eye(4), (len(one), 1, 1))
    pose[:, :3, :3], pose[:, :3, 3] = one.rotation, one.position / 1000.0
    rows = np.column_stack([one.t, np.swapaxes(pose, 1, 2).reshape(-1, 16)])
    head = ",".join(["time", *(f"O_T_EE[{i}]" for i in range(16))])
    return (head + "\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows)).encode()


def _euroc() -> bytes:
    from dmpcli.spatial.rotations import to_quaternion

    one = motion().strokes[0]
    assert one.rotation is not None
    q = to_quaternion(one.rotation)[:, [3, 0, 1, 2]]
    head = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
    rows = [
        f"{1403636579758555392 + round(1e9 * t)},"
        + ",".join(f"{v:.9g}" for v in (*(p / 1000.0), *quaternion))
        for t, p, quaternion in zip(one.t, one.position, q, strict=True)
    ]
    return "\n".join([head + "q_RS_z []", *rows, ""]).encode()


def _decimal_comma() -> bytes:
    one = motion().strokes[0]
    rows = [
        ";".join(f"{v:.6f}".replace(".", ",") for v in (t, *p))
        for t, p in zip(one.t, one.position, strict=True)
    ]
    return "\r\n".join(["Zeit [s];x [mm];y [mm];z [mm]", *rows, ""]).encode()


Sound = tuple[Read, str, tuple[bytes, ...]]


def _mcap() -> Sound:
    def read(source: Source) -> None:
        stroke, _ = mcap_file.decode(io.BytesIO(source.content), source.name, None)
        _written([stroke], source.name)

    return read, "m.mcap", (mcap_file.encode(motion()),)


_SOUND: dict[str, Callable[[], Sound]] = {
    "import csv": lambda: (_whole("table"), "m.csv", (csv_table.encode(motion()),)),
    "import csv, decimal comma": lambda: (
        _whole("table", layouts.adapted(Layout(decimal=None), ["t=Zeit"], {})),
        "m.csv",
        (_decimal_comma(),),
    ),
    "import csv, matrices": lambda: (
        _whole("table", layouts.LAYOUTS["franka"]),
        "m.csv",
        (_matrices(),),
    ),
    "import csv, euroc": lambda: (
        _whole("table", layouts.LAYOUTS["euroc"]),
        "m.csv",
        (_euroc(),),
    ),
    "import tum": lambda: (
        _whole("table", layouts.LAYOUTS["tum"]),
        "m.tum",
        (tum.encode(motion()),),
    ),
    "import parquet, lists": lambda: (_whole("table", _LIST), "m.parquet", (_parquet(),)),
    "import gcode": lambda: (_whole("gcode"), _NAME, (gcode.encode(motion(False), _OPTIONS), _ARC)),
    "import urscript": lambda: (
        _whole("urscript"),
        _NAME,
        (urscript.encode(motion(), _OPTIONS, _NAME),),
    ),
    "import krl": lambda: (_whole("krl"), _NAME, (krl.encode(motion(), _OPTIONS, _NAME),)),
    "import rapid": lambda: (_whole("rapid"), _NAME, (rapid.encode(motion(), _OPTIONS, _NAME),)),
    "import svg": lambda: (_whole("svg"), "m.svg", (_SVG,)),
    "import mcap": _mcap,
}
_ARC = b"G21 G90 G17\nG0 X0 Y0 Z5\nG1 Z0 F300\nG2 X20 Y0 I10 J0\nG3 X40 Y0 R10\nG1 X40 Y9\nM2\n"


def _make(name: str, folder: Path | None = None) -> Reader:  # noqa: ARG001
    return Reader(name, *_SOUND[name]())


def _in_folder(
    name: str, write: Callable[[Path], None], read: Callable[[Path], Any], which: str, place: Path
) -> Reader:
    """Read a folder of which one file is replaced by the bytes."""
    folder = Path(tempfile.mkdtemp(dir=place)) / "m"
    write(folder)
    path = folder / which

    def changed(source: Source) -> None:
        path.write_bytes(source.content)
        for stray in ("-journal", "-wal", "-shm"):
            path.with_name(path.name + stray).unlink(missing_ok=True)
        stroke, _ = read(folder)
        _written([stroke], source.name)

    return Reader(name, changed, "m", (path.read_bytes(),))


def _lerobot(folder: Path) -> None:
    lerobot_dataset.write(evenly(motion(), 10.0), folder, 10, "draw")


_EPISODE = functools.partial(lerobot_dataset.read, episode=None)

MAKES: dict[str, Callable[[Path], Reader]] = {
    **{name: functools.partial(_make, name) for name in _SOUND},
    **{
        name: functools.partial(_in_folder, name, write, read, which)
        for name, write, read, which in (
            ("import lerobot, info", _lerobot, _EPISODE, "meta/info.json"),
            ("import lerobot, data", _lerobot, _EPISODE, "data/chunk-000/file-000.parquet"),
            (
                "import bag, metadata",
                functools.partial(ros_bag.write, motion()),
                ros_bag.read,
                "metadata.yaml",
            ),
            (
                "import bag, storage",
                functools.partial(ros_bag.write, motion()),
                ros_bag.read,
                "m.db3",
            ),
        )
    },
}
"""All of them, by name."""
