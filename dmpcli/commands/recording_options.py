"""Options that say how to read recordings of other programs, for the commands that take any."""

from typing import TYPE_CHECKING, Annotated

import typer

from dmpcli.errors import InputError

if TYPE_CHECKING:
    from dmpcli.primitives.smoothing import Stroke
    from dmpcli.records.layouts import Layout
    from dmpcli.records.recordings import Recording
    from dmpcli.records.streams import Source

KNOWN = "ur, tum, ros, euroc, franka, kuka, fanuc or motive"

LayoutName = Annotated[
    str | None,
    typer.Option(
        "--layout", metavar="NAME", help=f"Columns and units of a known recorder: {KNOWN}."
    ),
]
Map = Annotated[
    list[str] | None,
    typer.Option("--map", help="OURS=THEIRS, as t=time or x=tool_x; may be repeated."),
]
Columns = Annotated[
    str | None,
    typer.Option(metavar="NAME,...", help="Columns of a table without header, as t,x,y,z."),
]
Body = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Which rigid body or topic, where a file has several."),
]
LengthUnit = Annotated[str | None, typer.Option(help="mm, cm, m or in.")]
TimeUnit = Annotated[str | None, typer.Option(help="s, ms, us or ns.")]
AngleUnit = Annotated[str | None, typer.Option(help="rad or deg.")]
Rotation = Annotated[
    str | None,
    typer.Option(
        metavar="FORM",
        help="What rx ry rz are: euler (X-Y-Z), rpy (fixed x-y-z), rotvec, or an order as scipy "
        "names it (ZYX, zyx, ...); or quaternion, xyzw, wxyz (qx qy qz qw), matrix (r11 ...).",
    ),
]
SampleRate = Annotated[
    float | None, typer.Option(metavar="HZ", help="Count the rows instead of reading time.")
]
Repeated = Annotated[
    str | None,
    typer.Option(
        "--repeated-stamps", help="Rows with the same time: error (default), first or mean."
    ),
]
Decimal = Annotated[
    str | None, typer.Option(help="Decimal sign: . or , (recognised where it is plain).")
]


def layout_of(
    known: str | None,
    mapping: list[str] | None,
    columns: str | None,
    **given: str | float | None,
) -> "Layout | None":
    """Return the layout that the options describe; None where they say nothing.

    Parameters
    ----------
    known : str or None
        A layout's name.
    mapping : list of str or None
        OURS=THEIRS each.
    columns : str or None
        Names of all columns, parted by commas.
    **given
        Attributes of `Layout`: units, rotation, and so on; None where nothing was said.

    Raises
    ------
    InputError
        An option's value is none of those that there are.
    """
    from dmpcli.records import layouts

    said: dict[str, object] = {key: value for key, value in given.items() if value is not None}
    if known is None and not mapping and columns is None and not said:
        return None
    if known is not None and known not in layouts.LAYOUTS:
        raise InputError(
            f"--layout {known}: no such layout; there are {', '.join(layouts.LAYOUTS)}"
        )
    if columns is not None:
        names = tuple(name.strip() for name in columns.split(","))
        if not all(names) or len(set(names)) < len(names):
            raise InputError(f"--columns {columns}: must be names, parted by commas, none twice")
        said["header"] = names
    base = layouts.LAYOUTS[known] if known else layouts.Layout()
    return layouts.adapted(base, mapping or [], said)


def recording(source: "Source", layout: "Layout | None") -> "Stroke":
    """Read a recording, and say how it was read and what is doubtful about it."""
    from dmpcli.records import recordings

    found = recordings.read(source, layout)
    announce(source.name, found, layout)
    return found.stroke


def announce(name: str, found: "Recording", layout: "Layout | None") -> None:
    """Say how a recording was read and what is doubtful about it."""
    from dmpcli.messages import tell, warn

    if found.ours and layout is not None:
        tell(f"{name}: is dmpcli's own and tells its columns and units; options were not used")
    for remark in found.told:
        tell(f"{name}: {remark}")
    for doubt in found.doubts:
        warn(f"{name}: {doubt}")
