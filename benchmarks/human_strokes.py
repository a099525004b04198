"""Reproduction of real handwriting: 30 shapes × 7 strokes of the LASA set. ``make bench``."""

import numpy as np

from dmpcli.dmp.learning import fit
from dmpcli.dmp.options import FitOptions
from dmpcli.surfaces.plane import extent
from tests.human_strokes import shapes, strokes
from tests.nearest import nearest_rms


def main() -> None:
    """Print a Markdown table: nearest-point RMS in percent of the bounding box's diagonal."""
    everything = [(f"{shape} {i}", s) for shape in shapes() for i, s in enumerate(strokes(shape))]
    print(
        f"| {len(everything)} human strokes, N by tolerance | median % | worst % | worst stroke "
        "| ends, mm | N | beyond tolerance |\n"
        "| --- | ---: | ---: | --- | ---: | ---: | ---: |"
    )
    for regression in ("lwr", "ridge"):
        errors, ends, counts, beyond = [], [], [], 0
        for _, stroke in everything:
            result = fit([stroke], FitOptions(regression=regression, trim=False))
            frame, reached = result.skill.frame, result.skill.reached
            assert reached is not None
            reproduced = frame.start + result.reproductions[0].reproduced @ frame.axes.T
            errors.append(100 * nearest_rms(reproduced, stroke.position) / extent(stroke.position))
            missed = reproduced[[0, -1]] - stroke.position[[0, -1]]
            ends.append(np.linalg.norm(missed, axis=1).max())
            counts.append(len(result.skill.basis))
            beyond += not reached.within
        worst = int(np.argmax(errors))
        print(
            f"| {regression} | {np.median(errors):.4f} | {errors[worst]:.4f} "
            f"| {everything[worst][0]} | {max(ends):.1e} | {min(counts)} to {max(counts)} "
            f"| {beyond} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
