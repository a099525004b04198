"""`export`: strokes in, a file of another program out."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dmpcli.errors import InputError, counted
from dmpcli.formats import registry
from dmpcli.formats.motion import Motion
from dmpcli.formats.registry import FileFormat
from dmpcli.formats.toolpath import ProgramOptions
from dmpcli.kinematics import models
from dmpcli.messages import tell, warn
from dmpcli.records import file_io, tool
from dmpcli.settings.export import ExportOptions
from dmpcli.spatial.rotations import from_euler
from dmpcli.workflows import motions

ID = "{id}"
"""In the name of an output: for a file of each stroke."""

NAME = "dmpcli_stroke"
"""Of a program that goes to standard output."""


def check(output: str | Path, options: ExportOptions, given: dict[str, Any]) -> FileFormat:
    """Refuse an output that could not be written, and options that say nothing of its format.

    Parameters
    ----------
    output : str or Path
        Its suffix tells the format, where `options` names none; with `ID` in its name it is written
        per stroke, and is not tried here.
    options : ExportOptions
    given : dict
        Of the options, those that were named, by field name: a default says nothing.

    Raises
    ------
    InputError
        The format is not known, an option is not of it, or the place cannot be written to.
    """
    chosen = registry.format_of(output, options.format)
    of_programs = ("thin", "blend", "lift", "travel_speed", "acceleration", "lines")
    alone = [name for name in of_programs if name in given and not chosen.program]
    if chosen.word != "gcode":
        alone += ["tilt"] if "tilt" in given else []
    if chosen.word != "lerobot":
        alone += ["task"] if "task" in given else []
    if chosen.word != "joints":
        alone += ["robot_model"] if "robot_model" in given else []
    if not (chosen.program or chosen.word == "joints") and "tool" in given:
        alone.append("tool")
    if alone:
        flag = f"--{alone[0].replace('_', '-')}"
        raise InputError(f"{flag}: says nothing of {chosen.word}; leave it out")
    if chosen.folder:
        file_io.check_folder(output)
    elif ID not in Path(output).name:
        file_io.check_writable(output)
    return chosen


def export(motion: Motion, output: str | Path, chosen: FileFormat, options: ExportOptions) -> None:
    """Write the strokes of a motion.

    Parameters
    ----------
    motion : Motion
    output : str or Path
        With ``{id}`` in its name a file of each stroke.
    chosen : FileFormat
    options : ExportOptions

    Raises
    ------
    InputError, RefusedError
        The format cannot hold them, or an arm cannot follow them.
    """
    prepared = _prepared(motion, chosen, options)
    names = dict.fromkeys(event.output for one in prepared.strokes for event in one.events)
    if names and not chosen.outputs:
        warn(
            f"{motion.name}: switches {', '.join(names)} on its way, of which {chosen.word} holds "
            "nothing; urscript, krl and rapid do"
        )
    name = Path(output).name
    if ID in name and not chosen.folder:
        for one in prepared.strokes:
            safe = "".join(c if c.isalnum() or c in "-_.+" else "_" for c in one.id)
            file = Path(output).with_name(name.replace(ID, safe))
            _write(replace(prepared, strokes=[one]), file, chosen, options)
    else:
        _write(prepared, output, chosen, options)
    samples = sum(len(one) for one in prepared.strokes)
    tell(
        f"{file_io.shown(output, output=True)}: {chosen.word}, "
        f"{counted(len(prepared.strokes), 'stroke')}, {counted(samples, 'sample')}"
    )


def _prepared(motion: Motion, chosen: FileFormat, options: ExportOptions) -> Motion:
    motion = motions.chosen(motion, options.id)
    if options.orientation is not None:
        if motion.oriented:
            raise InputError(
                f"--orientation: {motion.name} says how the tool is turned; leave it out"
            )
        motion = motion.turned(from_euler(np.array(options.orientation)))
    rate = options.rate
    if chosen.word == "lerobot":
        rate = float(_frames_per_second(motion, options))
    if rate is not None:
        motion = motions.evenly(motion, rate)
    if chosen.word == "joints":
        motion = _in_joints(motion, options)
    return motion


def _in_joints(motion: Motion, options: ExportOptions) -> Motion:
    """Return the motion with joint angles: those of the file, else by kinematics.

    Raises
    ------
    InputError, RefusedError
        Of no arm, of another one than the file's, or of one that cannot follow.
    """
    model, said = options.robot_model, motion.facts.get("joints")
    if all(one.joints is not None for one in motion.strokes):
        arm = said.get("arm") if isinstance(said, dict) else None
        if model is not None and arm is not None and model != arm:
            raise InputError(f"--robot-model {model}: {motion.name} holds the joints of an {arm}")
        if options.tool is not None:
            raise InputError(f"--tool: {motion.name} holds the joints themselves; leave it out")
        measured = not isinstance(said, dict) or said.get("measured", True)
        how = "as its controller told them" if measured else "by kinematics, no robot told them"
        tell(f"{motion.name}: joint angles of the arm on its way, {how}")
        return motion
    if model is None:
        raise InputError(
            f"--format joints: {motion.name} holds no joint angles; of which arm are they to be? "
            "Name it, as in --robot-model ec66"
        )
    from dmpcli.formats.joint_table import with_joints

    held = None if options.tool is None else tool.geometry(file_io.read(options.tool))
    return with_joints(motion, models.model(model), held)


def _write(motion: Motion, output: str | Path, chosen: FileFormat, options: ExportOptions) -> None:
    if chosen.folder:
        _folder(motion, Path(output), chosen, options)
        return
    stem = NAME if str(output) == file_io.DASH else Path(output).name.split(".")[0]
    file_io.write(output, encoded(motion, chosen, options, stem))


def encoded(motion: Motion, chosen: FileFormat, options: ExportOptions, name: str) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    motion : Motion
    chosen : FileFormat
        No folder.
    options : ExportOptions
    name : str
        Of a program.
    """
    from dmpcli.formats import (
        csv_table,
        gcode,
        joint_table,
        krl,
        mcap_file,
        polylines,
        rapid,
        tum,
        urscript,
    )

    if chosen.program:
        program = program_options(options)
        if chosen.word == "gcode":
            return gcode.encode(motion, program)
        writers = {"urscript": urscript.encode, "krl": krl.encode, "rapid": rapid.encode}
        return writers[chosen.word](motion, program, name)
    tables: dict[str, Callable[[Motion], bytes]] = {
        "csv": csv_table.encode,
        "tum": tum.encode,
        "joints": joint_table.encode,
        "ply": polylines.encode_ply,
        "obj": polylines.encode_obj,
        "mcap": mcap_file.encode,
    }
    return tables[chosen.word](motion)


def _folder(motion: Motion, output: Path, chosen: FileFormat, options: ExportOptions) -> None:
    if chosen.word == "ros2":
        from dmpcli.formats import ros_bag

        ros_bag.write(motion, output)
        return
    from dmpcli.formats import lerobot_dataset

    task = options.task or f"{motion.kind} of dmpcli"
    lerobot_dataset.write(motion, output, _frames_per_second(motion, options), task)


def _frames_per_second(motion: Motion, options: ExportOptions) -> int:
    """Return the rate of a dataset's grid: as said, else the file's own, a whole number of Hz."""
    rate = options.rate
    if rate is None:
        rate = 1.0 / float(np.median(np.concatenate([np.diff(one.t) for one in motion.strokes])))
    whole = max(1, round(rate))
    if options.rate is not None and whole != options.rate:
        raise InputError(f"--rate {rate:g}: LeRobot's rate is a whole number of Hz")
    return whole


def program_options(options: ExportOptions) -> ProgramOptions:
    """Return how a program shall move."""
    held, payload = None, False
    if options.tool is not None:
        source = file_io.read(options.tool)
        try:
            held, payload = tool.decode(source), True
        except InputError:
            held = tool.geometry(source)
    return ProgramOptions(
        options.thin,
        options.blend,
        options.lift,
        options.travel_speed,
        options.acceleration,
        options.lines,
        float(np.radians(options.tilt)),
        held,
        payload,
    )
