"""The formats that `export` writes: their words, suffixes and modules; nothing heavy is loaded."""

from dataclasses import dataclass
from pathlib import Path

from dmpcli.errors import InputError


@dataclass(frozen=True)
class FileFormat:
    """One format.

    Attributes
    ----------
    word : str
        Of ``--format``.
    suffixes : tuple of str
        The first is the usual one; none for what is a folder.
    meaning : str
    program : bool
        Whether it moves a machine: then speed, blend, lift and tool count.
    folder : bool
    outputs : bool
        Whether it holds what is switched along a stroke.
    """

    word: str
    suffixes: tuple[str, ...]
    meaning: str
    program: bool = False
    folder: bool = False
    outputs: bool = False


FORMATS = {
    one.word: one
    for one in (
        FileFormat("csv", (".csv",), "table, units in its header"),
        FileFormat("tum", (".tum",), "TUM trajectory, t x y z qx qy qz qw in s and m"),
        FileFormat("joints", (), "CSV of joint angles, for an arm of --robot-model"),
        FileFormat("ply", (".ply",), "polyline of vertices and edges"),
        FileFormat("obj", (".obj",), "polyline of vertices and lines"),
        FileFormat("gcode", (".gcode", ".ngc", ".nc"), "G-code in mm, XYZ alone", program=True),
        FileFormat(
            "urscript", (".script", ".urscript"), "Universal Robots program", True, outputs=True
        ),
        FileFormat("krl", (".src",), "KUKA program", True, outputs=True),
        FileFormat("rapid", (".mod", ".modx"), "ABB program", True, outputs=True),
        FileFormat("mcap", (".mcap",), "MCAP of ROS 2 messages"),
        FileFormat("ros2", (), "ROS 2 bag, a folder", folder=True),
        FileFormat("lerobot", (), "LeRobot v3 dataset, a folder", folder=True),
    )
}

_JOINTS = ".joints.csv"


def format_of(path: str | Path, word: str | None) -> FileFormat:
    """Return the format of an output, by a word or by its suffix.

    Raises
    ------
    InputError
        The word, or without one the suffix, is of no format.
    """
    if word is not None:
        if word not in FORMATS:
            raise InputError(f"--format {word}: must be one of {', '.join(FORMATS)}")
        return FORMATS[word]
    name = Path(path).name.lower()
    if name.endswith(_JOINTS):
        return FORMATS["joints"]
    suffix = Path(name).suffix
    for one in FORMATS.values():
        if suffix in one.suffixes:
            return one
    known = ", ".join(one.suffixes[0] for one in FORMATS.values() if one.suffixes)
    what = f"suffix {suffix!r} is of no format" if suffix else "has no suffix"
    raise InputError(f"-o {path}: {what}; there are {known}, or say --format {'|'.join(FORMATS)}")
