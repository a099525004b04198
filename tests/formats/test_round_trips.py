"""Export and import again, format by format: how near each comes back.

Doubles within 1e-9, text to its digits, programs within 0.01 mm and 0.01°, LeRobot within single
precision. What `import` does not read (polylines, joints) is read by arithmetic of the tests.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from dmpcli.formats.registry import FORMATS
from dmpcli.kinematics.chain import forward
from dmpcli.kinematics.models import model
from dmpcli.records import record, schemas
from dmpcli.records.file_io import read as read_file
from dmpcli.records.record import Provenance, Record
from dmpcli.spatial.rotations import to_euler_continuous
from tests.commands.running import ended
from tests.formats.motions import along, angle_between, wave


@dataclass(frozen=True)
class Nearness:
    """How near a format comes back: mm, degrees (None: it holds none), s (None: likewise)."""

    name: str
    position: float
    angle: float | None
    time: float | None
    options: tuple[str, ...] = ()
    reading: tuple[str, ...] = ()


_DEGREES = float(np.degrees(1e-9))
NEAR = {
    "csv": Nearness("o.csv", 1e-9, _DEGREES, 1e-9),
    "tum": Nearness("o.tum", 1e-9, _DEGREES, 1e-9, reading=("--layout", "tum")),
    "joints": Nearness("o.joints.csv", 1e-6, 1e-5, 1e-9, ("--robot-model", "ec66")),
    "ply": Nearness("o.ply", 1e-9, None, 1e-9),
    "obj": Nearness("o.obj", 1e-9, None, None),
    "gcode": Nearness("o.ngc", 0.01, None, 0.01, ("--tilt", "30")),
    "urscript": Nearness("o.script", 0.01, 0.01, 0.01),
    "krl": Nearness("o.src", 0.01, 0.01, 0.01),
    "rapid": Nearness("o.mod", 0.01, 0.01, 0.01),
    "mcap": Nearness("o.mcap", 1e-9, _DEGREES, 1e-9),
    "ros2": Nearness("bag", 1e-9, _DEGREES, 1e-9, ("--format", "ros2")),
    "lerobot": Nearness("set", 1.2e-4, 2e-5, 1e-6, ("--format", "lerobot", "--rate", "50")),
}
"""By the word of the format; LeRobot in single precision on its even grid."""


def stroke():
    """The wave, from 0.4 m in front of an arm, on an even grid of 50 Hz, tool down and turning."""
    one = wave(samples=201, offset=-100.0)
    t = 0.02 * np.arange(201)
    position, R = along(4.0 * (t / 4.0), one)
    return t, position, R


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    t, position, R = stroke()
    angles = to_euler_continuous(R)
    columns = {"id": np.full(len(t), "1", dtype=object), "t": t}
    columns |= dict(zip("xyz", position.T, strict=True))
    columns |= dict(zip(schemas.EULER_ANGLES, angles.T, strict=True))
    path = tmp_path_factory.mktemp("round") / "t.parquet"
    made = Record(schemas.TRAJECTORY, columns, Provenance("generalize"))
    path.write_bytes(record.encode(made))
    return path


def test_the_table_has_every_format():
    assert list(NEAR) == list(FORMATS)


@pytest.mark.slow
@pytest.mark.parametrize("word", NEAR)
def test_what_left_comes_back(trajectory, tmp_path, word):
    near = NEAR[word]
    there = tmp_path / near.name
    ended("export", trajectory, "-o", there, *near.options, "-q")
    t, position, R = stroke()
    found_t, found, found_R = BY_HAND[word](there) if word in BY_HAND else imported(there, near)
    if near.time is None or near.time < 1e-3:
        np.testing.assert_allclose(t if near.time is None else found_t, t, atol=near.time or 0.0)
        np.testing.assert_allclose(found, position, atol=near.position)
    else:  # corners of a program stand at other times: the same place at the same time
        at = np.column_stack([np.interp(t, found_t, axis) for axis in found.T])
        np.testing.assert_allclose(at, position, atol=near.position)
        np.testing.assert_allclose(found_t[-1], t[-1], atol=near.time)
    if near.angle is None:
        assert found_R is None
        return
    if len(found_R) != len(R):
        back = type("Back", (), {"t": found_t, "position": found, "rotation": found_R})
        _, found_R = along(t, back)
    assert np.degrees(angle_between(found_R, R).max()) < near.angle


def imported(there, near):
    back = there.with_name("back.parquet")
    ended("import", there, "-o", back, *near.reading, "-q")
    read = record.decode(read_file(back), schemas.DEMONSTRATION)
    return read.t, read.position(), read.rotation()


def joints(there):
    rows = np.loadtxt(there, delimiter=",", skiprows=1)
    at = forward(model("ec66"), rows[:, 1:])
    return rows[:, 0], at.position, at.rotation


def ply(there):
    head, _, body = there.read_bytes().partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    vertices = np.frombuffer(body[: 32 * count], "<f8").reshape(count, 4)
    return vertices[:, 3], vertices[:, :3], None


def obj(there):
    rows = [line.split()[1:] for line in there.read_text().splitlines() if line[:2] == "v "]
    return None, np.array(rows, dtype=float), None


BY_HAND = {"joints": joints, "ply": ply, "obj": obj}
