"""Taught on one curved part, drawn on another. ``python -m benchmarks.taught_surfaces [FACES]``.

Meshes of the saddle z = (x² - y²)/240, of the bumpy field of `benchmarks.surfaces` (smallest radius
29 mm) and of a cylinder (R 60), 50,000 faces each; a sine of 109 mm and 49.98 mm wave height, its
tool turning against the surface by 0.3 rad, taught in one heading and drawn on each mesh in 32. The
truth is a closed form or a Runge-Kutta geodesic in 160 steps: never a mesh.
"""

import sys

from tests.surfaces import cases, teaching

FACES, HEADINGS, SAMPLES, TAUGHT = 50_000, 32, 501, 1


def main() -> None:
    """Print a Markdown table: the worst of the headings, and what it may be."""
    faces = int(sys.argv[1]) if len(sys.argv) > 1 else FACES
    meshes, error = teaching.meshes(faces)
    truth = {name: cases.case(name, HEADINGS, SAMPLES, 1) for name in meshes}
    print(
        f"| taught on, {faces} faces | drawn on | learned by | N | RMS, mm | at most | wave, mm "
        "| turn, ° | refused |\n| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    )
    for name, mesh in meshes.items():
        for words, choices in (
            ("--regression ridge", teaching.RIDGE),
            ("--tolerance 0.02", teaching.TIGHT),
        ):
            skill = teaching.taught(name, mesh, truth[name], TAUGHT, choices)
            for other, there in meshes.items():
                found = teaching.carried(skill, there, truth[other])
                most = 1.5 * max(error[name], error[other]) + 0.02
                print(
                    f"| {name} | {other} | {words} | {len(skill.basis)} "
                    f"| {max(c.rms for c in found):.4f} | {most:.4f} "
                    f"| {max(c.wave for c in found):.4f} | {max(c.turn for c in found):.3f} "
                    f"| {sum(c.status != 0 for c in found)} |",
                    flush=True,
                )
                if other == name:
                    print(
                        f"| {name} | the same pair | {words} | {len(skill.basis)} "
                        f"| {found[TAUGHT].rms:.4f} | 0.0500 | {found[TAUGHT].wave:.4f} "
                        f"| {found[TAUGHT].turn:.3f} | |",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
