"""A report in plain words: what was drawn, on what, and how well."""

from collections.abc import Mapping
from typing import Any

from dmpcli.reporting.stroke_measures import Row

SMALL = 0.01
"""Distances below this are not told more closely, mm."""

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
        said += [_stroke(row, report["reference"]) for row in entry["strokes"]]
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


def _stroke(row: Row, reference: str | None) -> str:
    what = _WHAT.get(row["role"], str(row["role"]))
    if row["simulated"]:
        what += ", in simulation"
    gap = sum((a - b) ** 2 for a, b in zip(row["start"], row["goal"], strict=True)) ** 0.5
    shape = "a closed stroke" if row["closed"] else f"from start to goal {gap:.1f} mm"
    text = (
        f"{row['stroke']}: {what}; {shape}, {row['duration']:.1f} s, path {row['length']:.1f} mm."
    )
    parts = [part for part in (_wave(row), _off(row, reference), _ends(row), _lies(row)) if part]
    return " ".join([text, *parts])


def _wave(row: Row) -> str:
    along = row["surface"] or {}
    mean = along.get("wave_height")
    if mean is not None:
        return f"Its waves are {mean:.2f} mm high, measured along the surface."
    mean = row["wave"]["mean"]
    return "" if mean is None else f"Its waves are {mean:.2f} mm high."


def _off(row: Row, reference: str | None) -> str:
    off = row["deviation"]
    if not off or row["stroke"] == reference:
        return ""
    return (
        f"With start and goal laid upon each other it stays within {distance(off['nearest_max'])} "
        "of the demonstrated shape."
    )


def _ends(row: Row) -> str:
    along = row["surface"] or {}
    start, goal = (along.get(f"{end}_error", row[f"{end}_error"]) for end in ("start", "goal"))
    if start is None or goal is None:
        return ""
    if max(start, goal) < SMALL:
        return f"It begins and ends {distance(0.0)} off where it should."
    return f"It begins {distance(start)} and ends {distance(goal)} off where it should."


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
    return text
