"""The Python API of what looks at strokes and files: `report`, `inspect` and `wave_heights`."""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.records.file_io import Source
from dmpcli.records.storage import located
from dmpcli.reporting import inspection
from dmpcli.reporting.strokes import labels_of
from dmpcli.settings.layers import resolve
from dmpcli.settings.recording import RecordingOptions
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces.surface import Surface
from dmpcli.workflows import inspect as inspecting
from dmpcli.workflows import report as reporting
from dmpcli.workflows import surface_input, values
from dmpcli.workflows.report import StrokeReport
from dmpcli.workflows.values import TrajectoryBatch


def report(
    *strokes: Any,
    surface: Surface | None = None,
    output: str | Path | None = None,
    names: Sequence[str] | None = None,
    paper: bool = False,
    view: bool = False,
    png: bool = False,
    **said: Any,
) -> StrokeReport:
    """Compare strokes: wave heights, deviation, smoothness, ends, deadlines.

    Parameters
    ----------
    *strokes : Demonstration, Skill, Trajectory, TrajectoryBatch, Run, str or Path
        Values, or the names of their files and folders; the first demonstration is what the others
        are compared with.
    surface : Surface, optional
        What the strokes lie on.
    output : str or Path, optional
        Folder for the page, JSON, CSV and figures.
    names : sequence of str, optional
        What tables call them; by default their files' names, or what they are.
    paper : bool
        The paper's tables beside ours, and its figures instead of ours.
    view : bool
        Also a part that can be turned; extra ``dmpcli[view]``.
    png : bool
        Also the figures as PNG.
    **said
        How recordings of another program are read, as in `read`.

    Raises
    ------
    InputError
        As ``dmpcli report``.
    """
    if not strokes:
        raise InputError("there is no stroke to report; give at least one")
    if names is not None and len(set(names)) != len(strokes):
        raise InputError(f"names: {len(strokes)} strokes need as many different names")
    folder = None if output is None else located(output)
    reporting.check_output(folder)
    layout = resolve(RecordingOptions, said).as_layout()
    on = None if surface is None else surface_input.remembered(surface)
    with contextlib.ExitStack() as stack:
        inputs: list[str | Source] = []
        called: list[str] = []
        for stroke in strokes:
            if isinstance(stroke, TrajectoryBatch):
                folder_of = stack.enter_context(values.folder_of(stroke))
                inputs.append(str(folder_of))
                called.append(str(folder_of) if stroke.folder else _free("batch", called))
            elif isinstance(stroke, str | Path):
                inputs.append(str(stroke))
                called.append(str(stroke))
            else:
                source = values.source_of(stroke)
                inputs.append(source)
                called.append(_free(source.name, called))
        named = names or labels_of(called)
        return reporting.report(inputs, named, layout, on, folder, None, paper, view, png)


def inspect(file: str | Path | Any) -> dict[str, Any]:
    """Say what a file, or a value as it would be written, is.

    Parameters
    ----------
    file : str, Path, Demonstration, Skill, Trajectory or Run
        Of a batch its folder.

    Returns
    -------
    dict
        As ``dmpcli inspect --json`` has it under ``found``: schema, columns, units, ranges,
        provenance.

    Raises
    ------
    InputError
        As ``dmpcli inspect``.
    """
    if isinstance(file, str | Path):
        return inspecting.inspect(str(file))
    return inspection.inspected(values.source_of(file))


def wave_heights(stroke: Trajectory) -> Floats:
    """Heights between consecutive extrema across the start-goal line, mm; none of a line.

    Parameters
    ----------
    stroke : Demonstration, Trajectory or Run
        A demonstration is seen as `fit` sees it.
    """
    if not isinstance(stroke, Trajectory) or isinstance(stroke, TrajectoryBatch):
        raise InputError(
            f"{type(stroke).__name__} is no trajectory; of a batch give one by one, of arrays a "
            "Trajectory(t, position)"
        )
    return values.measured(stroke).wave.heights


def _free(name: str, taken: Sequence[str]) -> str:
    """Return a name that no stroke has yet."""
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name} {number}"
    return free
