"""What a report says of each stroke, as plain values: the rows of its tables and of its JSON.

Lengths in mm, times in s; None where a figure does not exist.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.metrics import on_surface as surface
from dmpcli.metrics.deviation import Taught, nearest_distance
from dmpcli.metrics.motion import log_dimensionless_jerk, motions, path_length, spectral_arc_length
from dmpcli.metrics.timing import punctuality
from dmpcli.records import tolerance_mark
from dmpcli.records.record import Record
from dmpcli.records.skill import SkillFile
from dmpcli.reporting import tracking
from dmpcli.reporting.stroke import ReportedStroke

Row = dict[str, Any]


def row_of(stroke: ReportedStroke, reference: ReportedStroke | None) -> Row:
    """Measure one stroke.

    Parameters
    ----------
    stroke : ReportedStroke
    reference : ReportedStroke, optional
        The demonstration; the stroke's deviation is taken from it, start and goal aligned.
    """
    aims = stroke.aims if stroke.intended else None
    motion = motions(stroke.t, stroke.position.T[:, None], *_ends(aims, stroke.position))
    raw = stroke.raw.T[:, None]
    return {
        "stroke": stroke.label,
        "kind": stroke.kind,
        "role": stroke.role,
        "simulated": stroke.simulated,
        "closed": stroke.closed,
        "elsewhere": stroke.elsewhere,
        "by_skill": stroke.by_skill,
        "samples": len(stroke.t),
        "start": stroke.start.tolist(),
        "goal": stroke.goal.tolist(),
        "duration": float(stroke.t[-1] - stroke.t[0]),
        "length": float(motion.length[0]),
        "peak_speed": float(motion.peak_speed[0]),
        "wave": _wave(stroke),
        "as_recorded": _as_recorded(stroke),
        "deviation": _deviation(stroke, reference),
        "guide": _from_guide(stroke),
        "ldlj": _finite(float(log_dimensionless_jerk(stroke.t, raw)[0])),
        "sparc": _finite(float(spectral_arc_length(stroke.t, raw)[0])),
        "start_error": None if aims is None else float(motion.start_error[0]),
        "goal_error": None if aims is None else float(motion.goal_error[0]),
        "end_heights": list(stroke.end_heights),
        "surface": on_surface(stroke),
        "beyond_tolerance": stroke.mark,
    }


def on_surface(stroke: ReportedStroke) -> Row | None:
    """How a stroke lies on the report's surface; see `SurfacePlacement`."""
    footing = stroke.footing
    if footing is None:
        return None
    wave, tilt = footing.wave, footing.tilt
    pieces = None if footing.uv is None else surface.stretch(footing.foot, footing.uv)
    length = path_length(footing.foot)
    taught = footing.demonstrated
    meant = None if taught is None else path_length(taught[:, :2])
    off = stroke.position[[0, -1]] - footing.aims(stroke.end_heights)
    start_error, goal_error = np.linalg.norm(off, axis=1).tolist()
    return {
        "distance_max": float(footing.distance.max()),
        "distance_rms": _rms(footing.distance),
        "height_least": float(footing.height.min()),
        "height_largest": float(footing.height.max()),
        "lifted_max": footing.lifted,
        "offset": 0.0 if stroke.over is None else stroke.over.offset,
        "contact_band": footing.band,
        "contact_share": footing.touching,
        "contact_lift": footing.lift,
        "wave_height": None if wave is None else wave.mean,
        "wave_spread": None if wave is None else wave.spread,
        "wave_heights": None if wave is None else wave.heights.tolist(),
        "geodesic": footing.length,
        "tilt_max": None if tilt is None else float(np.degrees(tilt.max())),
        "tilt_mean": None if tilt is None else float(np.degrees(tilt.mean())),
        "length": length,
        "demonstrated_length": meant,
        "length_change": None if meant is None else length / meant - 1.0,
        "stretch_least": None if pieces is None else float(pieces.min() - 1.0),
        "stretch_largest": None if pieces is None else float(pieces.max() - 1.0),
        "start_error": start_error,
        "goal_error": goal_error,
        "start_off": footing.start_off,
        "goal_off": footing.goal_off,
        "remark": footing.remark,
    }


def deadlines_of(run: Record) -> Row:
    """Punctuality of a run and tracking behind its look-ahead, over all its servo cycles."""
    lateness = np.asarray(run.columns["lateness"], dtype=float)
    deadline = np.asarray(run.columns["deadline"], dtype=float)
    period = float(np.median(np.diff(deadline))) if len(deadline) > 1 else math.inf
    off = tracking.tracking(run)
    return {
        "period": _finite(period),
        **asdict(punctuality(deadline, lateness, period)),
        "lookahead": tracking.lookahead_of(run),
        "tracking_rms": _rms(off),
        "tracking_max": float(off.max()),
    }


def skill_of(skill: SkillFile) -> Row:
    """What a skill says of itself: its model, and how well it gives back each demonstration."""
    return {
        "model": skill.model,
        "learning": skill.learning,
        "forcing_scale": skill.forcing_scale,
        "basis": skill.basis,
        "duration": skill.duration,
        "closed": skill.closed,
        "passes": skill.passes,
        "surface": None if skill.surface is None else skill.surface.model_dump(mode="json"),
        "heights": list(skill.heights),
        "side_guessed": skill.side_guessed,
        "reached": None if skill.reached is None else skill.reached.model_dump(mode="json"),
        "beyond_tolerance": tolerance_mark.of_file(skill),
        "spread": None if skill.spread is None else skill.spread.model_dump(mode="json"),
        "reproductions": [part.model_dump(mode="json") for part in skill.reproduction],
    }


def statistics_of(rows: Sequence[Row]) -> Row:
    """Distribution of each figure over many strokes; None where none has it."""
    values = {
        "wave_height": [row["wave"]["mean"] for row in rows],
        "wave_spread": [row["wave"]["spread"] for row in rows],
        **{
            key: [(row["deviation"] or {}).get(key) for row in rows]
            for key in ("nearest_rms", "nearest_max", "phase_rms", "phase_max")
        },
        **{
            key: [row[key] for row in rows]
            for key in (
                *("length", "duration", "peak_speed", "ldlj", "sparc"),
                *("start_error", "goal_error"),
            )
        },
        **{
            f"surface_{key}": [(row["surface"] or {}).get(key) for row in rows]
            for key in ON_SURFACE
        },
    }
    return {
        key: distribution(np.array([x for x in column if x is not None]))
        for key, column in values.items()
    }


ON_SURFACE = (
    *("wave_height", "distance_max", "distance_rms", "tilt_max", "tilt_mean"),
    *("length_change", "goal_off", "start_off"),
)
"""Figures of a stroke on the report's surface that have statistics."""

QUANTILES = (0.01, 0.05, 0.25, 0.75, 0.95, 0.99)


def distribution(values: Floats) -> Row | None:
    """Describe the values of one figure, shape (k,); None where there are none."""
    if not len(values):
        return None
    least, median, largest = np.quantile(values, [0.0, 0.5, 1.0]).tolist()
    quantiles = np.quantile(values, QUANTILES).tolist()
    return {
        "count": len(values),
        "least": least,
        "median": median,
        "largest": largest,
        "mean": float(values.mean()),
        "spread": float(values.std()),
        "quantiles": dict(zip(map(str, QUANTILES), quantiles, strict=True)),
    }


def _ends(aims: Floats | None, position: Floats) -> Floats:
    return (position[[0, -1]] if aims is None else aims)[:, None]


def _wave(stroke: ReportedStroke) -> Row:
    wave = stroke.wave
    t, where = wave.at(stroke.t), wave.at(stroke.position)
    return {
        "mean": wave.mean,
        "spread": wave.spread,
        "heights": wave.heights.tolist(),
        "extrema": [
            {"t": float(t[i]), "v": float(wave.value[i]), "position": where[i].tolist()}
            for i in range(len(wave.value))
        ],
    }


def _as_recorded(stroke: ReportedStroke) -> Row | None:
    """What smoothing took off a demonstration, and the wave height without smoothing."""
    if stroke.raw is stroke.position:
        return None
    removed = np.linalg.norm(stroke.raw - stroke.position, axis=1)
    raw = replace(stroke, position=stroke.raw)
    return {
        "wave_height": None if stroke.place is not None else raw.wave.mean,
        "removed_rms": _rms(removed),
        "removed_max": float(removed.max()),
        "noise": stroke.noise,
        "lost_rms": stroke.lost[0],
        "lost_max": stroke.lost[1],
    }


def _deviation(stroke: ReportedStroke, reference: ReportedStroke | None) -> Row | None:
    if reference is None or reference is stroke:
        return None
    reference = reference.seen_for(stroke)
    if reference.elsewhere:
        return None
    footing = stroke.footing
    if stroke.axes is None and footing and footing.place is not None:
        # On a curved surface strokes are compared in its chart.
        taught: Floats | None = footing.demonstrated
        place: Floats | None = footing.place
    else:
        taught, place = reference.as_drawn_by(stroke), stroke.flat
    if taught is None or place is None:
        return None
    off = Taught(reference.t, taught).deviations(stroke.t, place.T[:, None], np.ones(1))
    # From the recording: with what smoothing took off it beyond its noise.
    rms, largest = reference.lost
    return {
        "nearest_rms": float(np.hypot(off.nearest_rms[0], rms)),
        "nearest_max": max(float(off.nearest_max[0]), largest),
        "phase_rms": float(off.phase_rms[0]),
        "phase_max": float(off.phase_max[0]),
    }


def _from_guide(stroke: ReportedStroke) -> Row | None:
    """How far a demonstration strays from the curve it was dragged along, as recorded."""
    if stroke.guide is None:
        return None
    apart = nearest_distance(stroke.raw, stroke.guide)
    return {"rms": _rms(apart), "max": float(apart.max())}


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
