"""Pose by pose: recordings and strokes beside the first one of their kind, runs beside plans."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from dmpcli.arrays import Floats, Integers
from dmpcli.metrics import pose_error
from dmpcli.metrics.motion import path_length
from dmpcli.metrics.pose_error import PoseErrors, RigidAlignment
from dmpcli.records.record import Record
from dmpcli.reporting import tables, tracking
from dmpcli.reporting.stroke_measures import Row
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory

FEW = 0.9
"""Where less than this share of the samples has a like it is said."""


@dataclass(frozen=True)
class Compared:
    """Two trajectories, sample by sample.

    Attributes
    ----------
    name, against : str
    reference, estimate : Trajectory
        Of n samples each, paired.
    lengths : tuple of float
        Of the whole paths, reference and estimate, mm.
    most : int
        Samples of the shorter one: as many pairs there could be.
    alignment : RigidAlignment or None
        What brings the estimate nearest to the reference.
    """

    name: str
    against: str
    reference: Trajectory
    estimate: Trajectory
    lengths: tuple[float, float]
    most: int
    alignment: RigidAlignment | None

    @property
    def absolute(self) -> PoseErrors:
        """APE as it is."""
        return pose_error.absolute(self.reference, self.estimate)

    @property
    def aligned(self) -> PoseErrors | None:
        """APE after alignment; None where there is none."""
        if self.alignment is None:
            return None
        return pose_error.absolute(self.reference, self.alignment.apply(self.estimate))


def compared(
    name: str, against: str, estimate: Trajectory, reference: Trajectory
) -> Compared | None:
    """Pair two trajectories by time; None where fewer than two samples have a like.

    Parameters
    ----------
    name, against : str
        What the report calls the estimate and the reference.
    estimate, reference : Trajectory
        mm and s, on one clock; they need not share samples.
    """
    rows, others = pose_error.associate(reference.t, estimate.t)
    if len(rows) < 2:
        return None
    there, here = _some(reference, rows), _some(estimate, others)
    return Compared(
        name,
        against,
        there,
        here,
        (path_length(reference.position), path_length(estimate.position)),
        min(len(reference), len(estimate)),
        pose_error.alignment(there.position, here.position),
    )


def apart(name: str, against: str, estimate: Trajectory, reference: Trajectory) -> str:
    """Say why two trajectories have no pair of poses.

    Parameters
    ----------
    name, against : str
        What the report calls the estimate and the reference.
    estimate, reference : Trajectory
        Of which `compared` makes nothing.
    """
    after = float(estimate.t[0] - reference.t[-1])
    before = float(reference.t[0] - estimate.t[-1])
    if max(after, before) > 0.0:
        way = f"begins {after:.4g} s after {against} ends"
        if before > 0.0:
            way = f"ends {before:.4g} s before {against} begins"
        return f"{name}: by its clock it {way}: there is no pose error of what is not at one time"
    return (
        f"{name}: fewer than two of its samples have one of {against} within "
        f"{pose_error.MOST_APART:g} s: there is no pose error"
    )


def followed(run: Record, name: str) -> Compared | None:
    """Compare what an arm did while it drew with what was planned, one look-ahead before."""
    rows = np.flatnonzero(run.columns["phase"] == "stroke")
    if len(rows) < 2:
        return None
    drawn = tracking.reached(run, rows)
    plan = Trajectory(drawn.t, drawn.position("plan"), drawn.rotation("plan"))
    actual = Trajectory(drawn.t, drawn.position(), drawn.rotation())
    return compared(name, "its plan", actual, plan)


def row_of(pair: Compared) -> Row:
    """Return what the document says of a pair: lengths in mm, angles in degrees."""
    relative = pose_error.relative(pair.reference, pair.estimate)
    found, aligned = pair.alignment, pair.aligned
    sized = pose_error.alignment(pair.reference.position, pair.estimate.position, scaled=True)
    gap = float(np.diff(pair.estimate.t).max())
    return {
        "stroke": pair.name,
        "against": pair.against,
        "pairs": len(pair.reference),
        "of": pair.most,
        "largest_gap": gap,
        "length": pair.lengths[1],
        "reference_length": pair.lengths[0],
        "ape": _summaries(pair.absolute),
        "rpe": _summaries(relative),
        "aligned": None
        if found is None or aligned is None
        else {
            "ape": _summaries(aligned),
            "rotation": rotations.to_quaternion(found.pose.rotation[None])[0].tolist(),
            "position": found.pose.position.tolist(),
            "scale": None if sized is None else sized.scale,
        },
    }


def table(rows: Sequence[Row]) -> Table:
    """APE and RPE, root mean square; each pair with its names."""
    made = Table(title="Pose error, RMS in mm and degrees", title_justify="left")
    made.box, made.pad_edge = None, False
    made.add_column("stroke", overflow="fold")
    made.add_column("against", overflow="fold")
    for name in ("pairs", "APE", "APE °", "aligned", "RPE", "RPE °"):
        made.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        aligned = row["aligned"]["ape"]["position"]["rmse"] if row["aligned"] else None
        made.add_row(
            row["stroke"],
            row["against"],
            f"{row['pairs']}/{row['of']}",
            tables.number(row["ape"]["position"]["rmse"], 4),
            tables.number((row["ape"]["rotation"] or {}).get("rmse"), 3),
            tables.number(aligned, 4),
            tables.number(row["rpe"]["position"]["rmse"], 4),
            tables.number((row["rpe"]["rotation"] or {}).get("rmse"), 4),
        )
    return made


def remarks(rows: Sequence[Row]) -> list[str]:
    """Say which pairs are fewer than they could be."""
    return [
        f"{row['stroke']}: only {row['pairs']} of {row['of']} samples have one of "
        f"{row['against']} within {pose_error.MOST_APART:g} s, with a gap of "
        f"{row['largest_gap']:.3g} s: RPE is from pair to pair, so that a gap counts as one step; "
        "look at the clocks."
        for row in rows
        if row["pairs"] < FEW * row["of"]
    ]


def _some(one: Trajectory, rows: Integers) -> Trajectory:
    rotation = None if one.rotation is None else one.rotation[rows]
    return Trajectory(one.t[rows], one.position[rows], rotation)


def _summaries(errors: PoseErrors) -> Row:
    turned: Floats | None = errors.rotation
    return {
        "position": pose_error.summary(errors.position),
        "rotation": None if turned is None else pose_error.summary(np.degrees(turned)),
    }
