"""What a process asks of tool and strokes in ``generalize``, and what that needs of the rest."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from dmpcli.errors import InputError, beside, counted
from dmpcli.messages import tell, warn
from dmpcli.spatial import output_events

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dmpcli.dmp.drawn_strokes import DrawnStroke, GeneralizeOptions, OnBorder
    from dmpcli.dmp.skill import Skill
    from dmpcli.records.pairs import PairTable
    from dmpcli.records.storage import Location
    from dmpcli.settings.generalize import GeneralizeSettings
    from dmpcli.settings.options import Given
    from dmpcli.surfaces.border_margin import BorderMargin
    from dmpcli.surfaces.keep_off import Region
    from dmpcli.surfaces.surface import Surface

_REST = "bends and ends ask for less: lower --tool-speed, or raise --tool-acceleration"
SLOW = f"hold --tool-speed on less than half of their paths; {_REST}"
SPLIT = "split at the border; pieces shorter than 5 mm are left out"

_OFF = 1.0
"""How far the points of a line may lie off the surface, mm, unless --snap-tol says more."""


def check(
    settings: "GeneralizeSettings",
    given: "Given",
    surface: "Location | None",
    keep_out: Path | None,
) -> None:
    """Refuse options that say nothing without one another, or say it twice.

    Parameters
    ----------
    settings : GeneralizeSettings
    given : dict
        What the command line itself says of them.
    surface, keep_out : Path (of a surface ObjectPath, too) or None

    Raises
    ------
    InputError
        Names the options.
    """
    output_events.asked(settings.event or ())
    if settings.inclination is not None and given.get("orientation") == "keep":
        raise InputError(
            "--lead and --tilt lean the tool off the surface's normal, with which --orientation "
            "keep does not turn it; leave it out"
        )
    alone = {"--border-margin": settings.border_margin, "--keep-out": keep_out}
    for name, value in alone.items():
        if value is not None and surface is None:
            raise InputError(f"{name}: what is said of a --surface; name one")
    if (settings.copies is None) != (settings.spacing is None):
        raise InputError("--copies and --spacing say together what is to be drawn; give both")
    if settings.copies is not None and settings.copies > 1 and settings.spacing == 0.0:
        raise InputError("--spacing 0: all copies would lie on one another; give a distance")
    if settings.tool_speed is None:
        if settings.tool_acceleration is not None:
            raise InputError("--tool-acceleration: belongs to --tool-speed; leave it out")
        return
    if settings.duration is not None:
        raise InputError("--tool-speed and --duration both say how long a stroke lasts; give one")
    if settings.ease_in or settings.ease_out:
        raise InputError(
            "--tool-speed begins and ends at rest by itself; leave --ease-in and --ease-out out, "
            "and say with --tool-acceleration how soft"
        )


def check_skill(
    settings: "GeneralizeSettings", skill: "Skill", table: "PairTable", keep_out: Path | None
) -> None:
    """Refuse what this skill, or this table of pairs, cannot give.

    Parameters
    ----------
    settings : GeneralizeSettings
    skill : Skill
    table : PairTable
        Whether it asks for tool orientations, or for durations.
    keep_out : Path or None
        File of lines that no stroke crosses, only whether there is one.

    Raises
    ------
    InputError
        Names the option and what is in its way.
    """
    import numpy as np

    if settings.inclination is not None:
        if not skill.oriented:
            raise InputError(
                "--lead and --tilt: the skill was demonstrated without orientation, so that there "
                "is no tool to lean; fit a demonstration that has it"
            )
        asked = (table.pairs.start_rotation, table.pairs.goal_rotation)
        if any(rotation is not None for rotation in asked):
            raise InputError(
                f"{table.name}: asks for tool orientations, and --lead and --tilt say how the tool "
                "leans; leave one of them out"
            )
    if settings.tool_speed is not None and not np.isnan(table.duration).all():
        raise InputError(
            f"{table.name}: column 'duration' and --tool-speed both say how long a stroke lasts; "
            "leave one out"
        )
    if skill.model == "original":
        wanted: dict[str, Any] = {
            "--keep-out": keep_out,
            "--lead and --tilt": settings.inclination,
            "--copies": settings.copies,
            "--border-margin": settings.border_margin,
        }
        for name, value in wanted.items():
            if value is not None:
                raise InputError(f"{name}: the original DMP knows no surface; leave it out")


def copied(table: "PairTable", settings: "GeneralizeSettings") -> "PairTable":
    """Return the table with each pair as often as it is to be drawn; ids ``ID_0``, ``ID_1``, ...

    Raises
    ------
    InputError
        An id of the table looks like that of a copy.
    """
    from dataclasses import replace

    import numpy as np

    from dmpcli.dmp import copies

    count = settings.copies
    if count is None:
        return table
    ids = [f"{name}_{i}" for name in table.ids for i in range(count)]
    if len(set(ids)) < len(ids):
        raise InputError(
            f"{table.name}: column 'id': some names are those that copies of others get, ID_0, "
            "ID_1 and so on; rename them"
        )
    places = table.places
    return replace(
        table,
        ids=ids,
        pairs=copies.copied(table.pairs, count, settings.spacing or 0.0),
        lines=None if table.lines is None else np.repeat(table.lines, count),
        rows=np.add.outer(table.numbers * count, np.arange(count)).ravel(),
        duration=np.repeat(table.duration, count),
        status=[status for status in table.status for _ in range(count)],
        places=None if places is None else replace(places, of=np.repeat(places.of, count)),
    )


def process_style(
    style: "GeneralizeOptions",
    settings: "GeneralizeSettings",
    on_border: "OnBorder",
    surface: "Surface | None",
    keep_out: Path | None,
    inputs: list[dict[str, str]],
) -> "GeneralizeOptions":
    """Return the style with what the process asks for.

    Parameters
    ----------
    style : GeneralizeOptions
    settings : GeneralizeSettings
        Inclination, speed and border margin, mm.
    on_border : {'fail', 'clip', 'skip', 'split'}
        What becomes of a stroke that meets a border.
    surface : Surface or None
        In the base frame.
    keep_out : Path or None
        File of closed lines on the surface, base axes, mm; only with a surface.
    inputs : list of dict
        Of the provenance; the file of lines is added to it.

    Raises
    ------
    InputError
        There is no border to keep off, or a line that is no line on the surface.
    """
    from dataclasses import replace

    from dmpcli.surfaces.keep_off import KeepOff

    if on_border == "split" and keep_out is None and not _is_mesh(surface):
        raise InputError(
            "--on-border split: there is nothing to split at, for only a mesh has a border; leave "
            "it out, or name regions with --keep-out"
        )
    margin = _margin(settings.border_margin, surface)
    regions = () if keep_out is None else _regions(keep_out, surface, settings, inputs)
    return replace(
        style,
        inclination=settings.inclination,
        pace=settings.pace,
        keep_off=KeepOff(margin, regions) if margin is not None or regions else None,
        on_border=on_border,
    )


def _is_mesh(surface: "Surface | None") -> bool:
    from dmpcli.surfaces.mesh import Mesh  # loads scipy

    return isinstance(surface, Mesh)


def _margin(margin: float | None, surface: "Surface | None") -> "BorderMargin | None":
    if margin is None:
        return None
    from dmpcli.surfaces.border_margin import BorderMargin
    from dmpcli.surfaces.mesh import Mesh

    if not isinstance(surface, Mesh):
        raise InputError(
            "--border-margin: planes, cylinders and spheres are endless and have no border; leave "
            "it out, or give lines with --keep-out"
        )
    found = BorderMargin(surface, margin)
    if len(found.edges) == 0:
        raise InputError(
            "--border-margin: the mesh is closed and has no border; leave it out, or give lines "
            "with --keep-out"
        )
    return found


def _regions(
    keep_out: Path,
    surface: "Surface | None",
    settings: "GeneralizeSettings",
    inputs: list[dict[str, str]],
) -> "tuple[Region, ...]":
    from dmpcli.records import file_io, lines
    from dmpcli.surfaces.keep_out import enclosed

    assert surface is not None
    source = file_io.read(keep_out)
    inputs.append({"role": "keep-out", "sha256": source.sha256})
    found = []
    for name, line in lines.read(source):
        hits = surface.closest(line)
        farthest, most = int(hits.distance.argmax()), max(_OFF, settings.snap_tol)
        if hits.distance[farthest] > most:
            off = beside(hits.distance[farthest], most, ".3f")
            raise InputError(
                f"{name}: its point {farthest + 1} lies {off} mm off the surface, more than "
                f"{most:g}; the points are in base axes and mm"
            )
        try:
            found.append(enclosed(surface, hits.position))
        except InputError as error:
            raise InputError(f"{name} {error}") from None
    tell(f"{source.name}: no stroke enters {counted(len(found), 'region')}")
    return tuple(found)


def warn_of_speed(
    strokes: "Sequence[DrawnStroke]", ids: "Sequence[str]", style: "GeneralizeOptions"
) -> None:
    """Warn of strokes that hold the speed that was asked for on a small part of their path only.

    Parameters
    ----------
    strokes : sequence of DrawnStroke
    ids : sequence of str
        Of each; of a single one the message has no need.
    style : GeneralizeOptions
        Without a pace nothing is warned of.
    """
    from dmpcli.batch.settled import is_slow
    from dmpcli.dmp.tool_speed import held

    for name, stroke in zip(ids, strokes, strict=True):
        if style.pace is not None and is_slow(stroke, style):
            share, fastest = held(stroke.position, style.rate, style.pace.speed)
            which = f"stroke {name}" if len(ids) > 1 else "the stroke"
            warn(
                f"{which} goes {style.pace.speed:g} mm/s on {100.0 * share:.0f} % of its path, "
                f"{fastest:.1f} at most; {_REST}"
            )


def pieces(strokes: "Sequence[DrawnStroke]", ids: "Sequence[str]", rate: float, split: bool) -> str:
    """Return in words what several strokes of one file are: copies, pieces, or both.

    Parameters
    ----------
    strokes : sequence of DrawnStroke
        At least one.
    ids : sequence of str
        Of each.
    rate : float
        Hz.
    split : bool
        Whether some are pieces of one that was split, which is told.
    """
    if split:
        tell(SPLIT)
    poses = sum(len(stroke.position) for stroke in strokes)
    shown = ids[0] if len(ids) == 1 else f"{ids[0]} to {ids[-1]}"
    return f"{counted(len(strokes), 'stroke')} ({shown}), {counted(poses, 'pose')} at {rate:g} Hz"
