"""What a person asks of a skill: how it was learned, how well, on what, and from what scatter."""

import numpy as np

from dmpcli.records.skill import SkillFile


def lines(file: SkillFile) -> list[str]:
    """Say it, a line each."""
    passes = f", {file.passes} passes of LWR" if file.passes > 1 else ""
    how = "by a tolerance" if file.learning == "tolerance" else "as the paper has it"
    said = [f"learned {how}: N = {file.basis}{passes}, {file.duration:.3f} s"]
    if file.reached is not None:
        r = file.reached
        verb = "within" if r.within else "beyond"
        said.append(
            f"gives the recording back with RMS {r.rms:.3g} mm, largest {r.largest:.3g} mm: "
            f"{verb} its tolerance of {r.tolerance:.3g} mm; noise {r.noise:.3g} mm"
        )
    low, high = file.heights
    n = " ".join(f"{row[2] + 0.0:.3f}" for row in file.task_frame.axes)
    where = f"on a plane with normal {n}" if file.surface is None else f"on a {file.surface.kind}"
    if file.model == "modified" and file.learning == "tolerance":
        guessed = "; its side is guessed" if file.side_guessed else ""
        said.append(f"taught {where}, w from {low:.2f} to {high:.2f} mm{guessed}")
    force = file.force_profile
    if force is not None:
        said.append(
            f"force along the normal from {force.start:.2f} N to {force.goal:.2f} N at the ends: "
            f"given back with RMS {force.rms:.3g} N, largest {force.largest:.3g} N"
        )
    if file.spread is not None:
        square = np.mean(np.square(file.spread.deviation), axis=0)
        u, v, w = np.sqrt(square[:3])
        said.append(
            f"{len(file.reproduction)} demonstrations scatter by {u:.2f} mm along, {v:.2f} across "
            f"and {w:.2f} off the surface (standard deviation)"
        )
    return said
