"""How to read recordings of other programs, for the commands that take any.

What the words mean, and whether they are any, `records.layouts` and `records.recordings` say.
"""

import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from dmpcli.errors import InputError
from dmpcli.settings.model import Option, Settings, settings_of

if TYPE_CHECKING:
    from dmpcli.records.layouts import Layout

LENGTHS = ("mm", "cm", "m", "in")
_HEADER = "by its header, else "


@dataclass(frozen=True, kw_only=True)
class RecordingOptions(Settings):
    """Columns, units and forms of a recording; None where the file or its layout tells them."""

    layout: Annotated[
        str | None,
        Option(
            "Columns and units of a known recorder.",
            choices=(
                "ur",
                "tum",
                "ros",
                "euroc",
                "franka",
                "kuka",
                "fanuc",
                "motive",
                "optitrack",
                "vicon",
                "qualisys",
                "trc",
                "kitti",
                "ndi",
                "robomimic",
                "umi",
                "lerobot",
                "dmpcli",
            ),
            unset="by its columns' names",
        ),
    ] = None
    map_: Annotated[
        tuple[str, ...],
        Option(
            "A column of ours and its name there, as t=time; may be repeated.",
            flag="--map",
            metavar="OURS=THEIRS",
        ),
    ] = ()
    columns: Annotated[
        str | None,
        Option("Columns of a table without header, as t,x,y,z.", metavar="NAME,..."),
    ] = None
    body: Annotated[str | None, Option("Which rigid body or topic, where a file has several.")] = (
        None
    )
    length_unit: Annotated[
        str | None, Option("Of its lengths.", choices=LENGTHS, unset=f"{_HEADER}mm")
    ] = None
    time_unit: Annotated[
        str | None, Option("Of its times.", choices=("s", "ms", "us", "ns"), unset=f"{_HEADER}s")
    ] = None
    angle_unit: Annotated[
        str | None, Option("Of its angles.", choices=("rad", "deg"), unset=f"{_HEADER}rad")
    ] = None
    rotation: Annotated[
        str | None,
        Option(
            "What rx ry rz are: euler (X-Y-Z), rpy (fixed x-y-z), rotvec, or an order as scipy "
            "names it (ZYX, zyx, ...); or quaternion, xyzw, wxyz (qx qy qz qw), matrix (r11 ...).",
            metavar="FORM",
            unset="euler",
        ),
    ] = None
    sample_rate: Annotated[
        float | None,
        Option("Count the rows instead of reading time.", "Hz", unset="read time"),
    ] = None
    repeated_stamps: Annotated[
        str | None,
        Option("Rows with the same time.", choices=("error", "first", "mean"), unset="error"),
    ] = None
    drop_duplicates: Annotated[
        bool, Option("Of rows with the same time keep the first, as --repeated-stamps first.")
    ] = False
    episode: Annotated[
        str | None,
        Option("Which recording, where a file holds several.", metavar="NAME"),
    ] = None
    decimal: Annotated[
        str | None,
        Option("Decimal sign.", choices=(".", ","), unset="recognised where it is plain"),
    ] = None

    def as_words(self) -> str:
        """Return the options as they are typed; empty where they say nothing."""
        words: list[str] = []
        for one in settings_of(type(self)):
            value = getattr(self, one.name)
            if value == one.default:
                continue
            for each in value if isinstance(value, tuple) else (value,):
                text = f"{each:g}" if isinstance(each, float) else str(each)
                words += [one.flag] if each is True else [one.flag, shlex.quote(text)]
        return " ".join(words)

    def as_layout(self) -> "Layout | None":
        """Return the layout that the options describe; None where they say nothing.

        Raises
        ------
        InputError
            An option's value is none of those that there are.
        """
        from dmpcli.records import layouts

        known, columns = self.layout, self.columns
        if self.drop_duplicates and self.repeated_stamps not in (None, "first"):
            raise InputError(
                f"--drop-duplicates and --repeated-stamps {self.repeated_stamps}: give one of them"
            )
        said: dict[str, object] = {
            "body": self.body,
            "length": self.length_unit,
            "time": self.time_unit,
            "angle": self.angle_unit,
            "rotation": self.rotation,
            "sample_rate": self.sample_rate,
            "repeated": "first" if self.drop_duplicates else self.repeated_stamps,
            "episode": self.episode,
            "decimal": self.decimal,
        }
        said = {key: value for key, value in said.items() if value is not None}
        if known is None and not self.map_ and columns is None and not said:
            return None
        if known is not None and known not in layouts.LAYOUTS:
            raise InputError(
                f"--layout {known}: no such layout; there are {', '.join(layouts.LAYOUTS)}"
            )
        if columns is not None:
            names = tuple(name.strip() for name in columns.split(","))
            if not all(names) or len(set(names)) < len(names):
                raise InputError(
                    f"--columns {columns}: must be names, parted by commas, none twice"
                )
            said["header"] = names
        base = layouts.LAYOUTS[known] if known else layouts.Layout()
        return layouts.adapted(base, self.map_, said)
