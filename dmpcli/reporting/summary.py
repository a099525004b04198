"""A report in plain words: what was drawn, on what, and how well."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from dmpcli.reporting.stroke_measures import Row

SMALL = 0.01
"""Distances below this are not told more closely, mm."""
FEW = 4
"""So many strokes of a file are told one by one; more that are alike are told together."""

_WHAT = {
    "demonstration": "a demonstration",
    "builtin": "a demonstration by built-in drag",
    "modified": "planned by the modified model",
    "original axis": "planned by the original model, each axis scaled by its own",
    "original distance": "planned by the original model, scaled by the distance",
    "run": "what the arm did",
}


def sentences(report: Mapping[str, Any]) -> list[str]:
    """Return what there is to say of the document, a sentence or two for each stroke."""
    said = [_on_what(report)] if report["files"] else []
    for entry in report["files"]:
        said += _strokes(entry, report["reference"])
        if entry["statistics"]:
            said.append(_many(entry))
        if entry["states"]:
            said += _states(entry)
        if entry["skill"]:
            said.append(_skill(entry))
        if entry["deadlines"]:
            said.append(_run(entry))
    return said


def distance(value: float) -> str:
    """Return a distance in words that say no more than is known, mm."""
    if value < SMALL:
        return f"less than {SMALL:g} mm"
    return f"{value:.2f} mm" if value < 10.0 else f"{value:.1f} mm"


def _on_what(report: Mapping[str, Any]) -> str:
    surface = report["surface"]
    if surface is None:
        where = "Each stroke is measured on the plane that it lies in; no surface was named."
    else:
        where = f"The strokes are measured on {surface['file']}, along its surface."
    if report["reference"]:
        return f"{where} They are compared with the demonstration {report['reference']}."
    return f"{where} There is no demonstration to compare them with."


def _strokes(entry: Row, reference: str | None) -> list[str]:
    rows = entry["strokes"]
    kinds = {(row["role"], row["simulated"], row["closed"], bool(row["surface"])) for row in rows}
    if len(rows) > FEW and len(kinds) == 1 and reference not in {row["stroke"] for row in rows}:
        return [_together(entry["file"], rows)]
    return [_stroke(row, reference) for row in rows]


def _together(file: str, rows: Sequence[Row]) -> str:
    """Tell strokes that are alike by the range of each figure, and the worst by its name."""
    first = rows[0]
    gaps = f"from start to goal {_range(map(_gap, rows), 1)} mm"
    shape = "closed strokes" if first["closed"] else gaps
    text = (
        f"{file}: {len(rows)} strokes, {_what(first)}; {shape}, "
        f"{_range((row['duration'] for row in rows), 1)} s, "
        f"paths of {_range((row['length'] for row in rows), 1)} mm."
    )
    waves = [height for height in map(_height, rows) if height is not None]
    if waves:
        along = ", measured along the surface" if all(map(_along, rows)) else ""
        text += f" Their waves are {_range(waves, 2)} mm high{along}."
    off = {row["stroke"]: row["deviation"]["nearest_max"] for row in rows if row["deviation"]}
    if off:
        text += (
            " With start and goal laid upon each other they stay within "
            f"{_worst(off)} of the demonstrated shape."
        )
    ends = {row["stroke"]: max(errors) for row in rows if (errors := _errors(row))}
    if ends:
        text += f" They begin and end {_within(ends)} off where they should."
    if first["surface"]:
        text += _lie({row["stroke"]: row["surface"] for row in rows})
    return text


def _lie(along: Mapping[str, Any]) -> str:
    text = (
        " They lie within "
        f"{_worst({name: one['distance_max'] for name, one in along.items()})} of the surface"
    )
    touching = {name: one["contact_share"] for name, one in along.items()}
    least = min(touching, key=lambda name: touching[name])
    if touching[least] < 1.0:
        text += (
            f", touching it over {100.0 * touching[least]:.0f} % of the path or more "
            f"(least: {least})"
        )
    tilts = {name: one["tilt_max"] for name, one in along.items() if one["tilt_max"] is not None}
    if tilts:
        most = max(tilts, key=lambda name: tilts[name])
        text += f"; the tool leans up to {tilts[most]:.1f}° off its normal (most: {most})"
    return f"{text}."


def _range(values: Iterable[float], places: int) -> str:
    told = sorted({f"{value:.{places}f}" for value in values}, key=float)
    return told[0] if len(told) == 1 else f"{told[0]} to {told[-1]}"


def _worst(values: Mapping[str, float]) -> str:
    most = max(values, key=lambda name: values[name])
    told = distance(values[most])
    return told if values[most] < SMALL else f"{told} (most: {most})"


def _within(values: Mapping[str, float]) -> str:
    return _worst(values) if max(values.values()) < SMALL else f"up to {_worst(values)}"


def _what(row: Row) -> str:
    what = _WHAT.get(row["role"], str(row["role"]))
    return f"{what}, in simulation" if row["simulated"] else what


def _gap(row: Row) -> float:
    """Return the distance from start to goal, mm."""
    return float(sum((a - b) ** 2 for a, b in zip(row["start"], row["goal"], strict=True)) ** 0.5)


def _stroke(row: Row, reference: str | None) -> str:
    shape = "a closed stroke" if row["closed"] else f"from start to goal {_gap(row):.1f} mm"
    text = (
        f"{row['stroke']}: {_what(row)}; {shape}, {row['duration']:.1f} s, "
        f"path {row['length']:.1f} mm."
    )
    parts = [part for part in (_wave(row), _off(row, reference), _ends(row), _lies(row)) if part]
    return " ".join([text, *parts])


def _wave(row: Row) -> str:
    mean = _height(row)
    if mean is None:
        return ""
    return f"Its waves are {mean:.2f} mm high{', measured along the surface' * _along(row)}."


def _along(row: Row) -> bool:
    return (row["surface"] or {}).get("wave_height") is not None


def _height(row: Row) -> float | None:
    """Return the mean height of a stroke's waves, mm, along the surface where there is one."""
    along: float | None = (row["surface"] or {}).get("wave_height")
    flat: float | None = row["wave"]["mean"]
    return flat if along is None else along


def _off(row: Row, reference: str | None) -> str:
    off = row["deviation"]
    if not off or row["stroke"] == reference:
        return ""
    return (
        f"With start and goal laid upon each other it stays within {distance(off['nearest_max'])} "
        "of the demonstrated shape."
    )


def _ends(row: Row) -> str:
    errors = _errors(row)
    if errors is None:
        return ""
    start, goal = errors
    if max(start, goal) < SMALL:
        return f"It begins and ends {distance(0.0)} off where it should."
    return f"It begins {distance(start)} and ends {distance(goal)} off where it should."


def _errors(row: Row) -> tuple[float, float] | None:
    """Return how far a stroke begins and ends off where it should, mm, where that is known."""
    along = row["surface"] or {}
    start, goal = (along.get(f"{end}_error", row[f"{end}_error"]) for end in ("start", "goal"))
    return None if start is None or goal is None else (start, goal)


def _lies(row: Row) -> str:
    along = row["surface"]
    if not along:
        return ""
    text = f"It lies within {distance(along['distance_max'])} of the surface"
    if along["contact_share"] < 1.0:
        text += f", touching it over {100.0 * along['contact_share']:.0f} % of the path"
    if along["tilt_max"] is not None:
        text += f"; the tool leans up to {along['tilt_max']:.1f}° off its normal"
    return f"{text}."


def _many(entry: Row) -> str:
    text = f"{entry['file']}: {entry['count']} strokes."
    found = entry["statistics"]
    for key, name in (
        ("wave_height", "wave heights"),
        ("nearest_max", "largest distances from the demonstrated shape"),
        ("goal_error", "distances from the goal"),
        ("surface_distance_max", "largest distances to the surface"),
    ):
        one = found.get(key)
        if one:
            least, most = one["least"], one["largest"]
            if most < SMALL:
                text += f" {name.capitalize()}: all {distance(0.0)}."
            elif most - least < SMALL:
                text += f" {name.capitalize()}: all {one['median']:.2f} mm."
            else:
                text += f" {name.capitalize()}: {least:.2f} to {most:.2f} mm."
    return text


def _states(entry: Row) -> list[str]:
    bad = {state: count for state, count in entry["states"].items() if state != "ok"}
    if not bad:
        return []
    reason = max(bad, key=lambda state: bad[state])
    return [f"{entry['file']}: {sum(bad.values())} not drawn; most often: {reason}."]


def _skill(entry: Row) -> str:
    skill = entry["skill"]
    text = (
        f"{entry['file']}: a skill of {skill['basis']} basis functions, {skill['duration']:.1f} s."
    )
    reached = skill["reached"]
    if reached:
        text += f" It gives its recording back within {distance(reached['largest'])}."
    return text


def _run(entry: Row) -> str:
    told = entry["deadlines"]
    missed = "no set-point" if not told["missed"] else f"{told['missed']} set-points"
    text = (
        f"{entry['file']}: {told['cycles']} set-points, the latest {1e3 * told['worst']:.1f} ms "
        f"late, {missed} left out; the arm followed within {distance(told['tracking_max'])}."
    )
    pressed = entry["contact"]
    if pressed:
        text += (
            f" It pressed with {pressed['mean']:.1f} N on average, {pressed['least']:.1f} to "
            f"{pressed['largest']:.1f} N, and was without contact for "
            f"{100.0 * pressed['absent']:.1f} % of the time."
        )
        if pressed.get("unknown"):
            text += (
                f" Of {100.0 * pressed['unknown']:.1f} % of what it drew no force is known: these "
                "figures leave it out."
            )
    return text
