"""`inspect`: what a file is, and of a batch's folder its table."""

import shlex

import numpy as np

from dmpcli.errors import InputError
from dmpcli.messages import tell
from dmpcli.records import file_io, learned_skill, mesh
from dmpcli.records.layouts import Layout
from dmpcli.records.storage import Location, located
from dmpcli.reporting import inspection
from dmpcli.reporting.stroke_measures import Row


def inspect(
    file: str, layout: Layout | None = None, options: str = "", skill: Location | None = None
) -> Row:
    """Describe a file, and tell what will take its time.

    Parameters
    ----------
    file : str
        Or the folder of a batch, or ``-``.
    layout : Layout, optional
        How a recording of another program is read.
    options : str
        That say it, as they are typed.
    skill : Path or ObjectPath, optional
        What is to be drawn on the mesh that the file is.

    Raises
    ------
    InputError
        As `inspection.inspected`.
    """
    if file != file_io.DASH and (table := located(file) / file_io.TABLE).is_file():
        file = str(table)
    source = file_io.read(file)
    waiting = mesh.waiting(source)
    if waiting is not None:
        tell(waiting)
    found = inspection.inspected(source, layout, options)
    if skill is not None:
        found["told"] = _rooms(file, found, skill)
    return found


def _rooms(file: str, found: Row, skill: Location) -> list[str]:
    """Say where on a mesh a skill is drawn."""
    from dmpcli.workflows import room_for, surface_input

    if "vertices" not in found.get("content", {}):
        raise InputError(f"--for: {file} is no mesh, so that nothing is drawn on it; leave it out")
    learned = learned_skill.read(file_io.read(skill))
    read = surface_input.read(located(file), None, None)
    rooms = room_for.rooms_for(read, learned)
    if rooms:
        line = f"dmpcli generalize {shlex.quote(str(skill))} -o stroke.parquet"
        line += f" --surface {shlex.quote(file)} {rooms[0].words()}"
        told = [f"room for {skill}: {one.words()}  {mesh.what(one.patch)}" for one in rooms]
        return [*told, f"  {line} --ease-in 0.5 --ease-out 0.5"]
    room = room_for.footprint(learned)
    along, across = np.ptp(room.path, axis=0)
    return [
        f"room for {skill}: on none of its smooth patches ({along:.0f} mm along, {across:.0f} mm "
        "across), nor for a quarter of its size; over rounded edges it may be drawn all the same"
    ]
