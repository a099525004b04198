"""Demonstrations as the paper's learning takes them: even, trimmed, low-passed, in a chart.

`preprocessing` prepares them for learning by a tolerance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.dmp import smoothing
from dmpcli.dmp.options import PAPER_BASIS, FitOptions
from dmpcli.dmp.preprocessing import Preprocessed
from dmpcli.dmp.skill import TaskFrame
from dmpcli.dmp.smoothing import Signal
from dmpcli.errors import InputError
from dmpcli.spatial import rotations
from dmpcli.spatial.trajectory import Trajectory
from dmpcli.surfaces import plane


@dataclass(frozen=True)
class Prepared:
    """One demonstration, smoothed and in its own chart.

    Attributes
    ----------
    stroke : Trajectory
        Smoothed, trimmed, even, from t = 0.
    signal : Signal
        The skill's six coordinates and derivatives, shape (T, 6).
    frame : TaskFrame
    closed : bool
    removed : float
        RMS of what smoothing took off the positions, mm.
    trimmed : tuple of float
        Idle time cut off before and after, s.
    cutoff : float or None
        Hz; None where nothing was smoothed.
    recorded : array, shape (n, 3)
        The samples that it was made from, before smoothing, mm.
    seen : Preprocessed or None
        What was found in the recording; None of the paper's learning.
    """

    stroke: Trajectory
    signal: Signal
    frame: TaskFrame
    closed: bool
    removed: float
    trimmed: tuple[float, float]
    cutoff: float | None
    recorded: Floats
    seen: Preprocessed | None = None


def prepare(stroke: Trajectory, choices: FitOptions) -> Prepared:
    """Smooth and trim a demonstration, find its chart, and bring it there.

    Parameters
    ----------
    stroke : Trajectory
    choices : FitOptions
        With N.

    Raises
    ------
    InputError
        The stroke does not move.
    """
    even = smoothing.evenly_sampled(stroke)
    basis = choices.basis or PAPER_BASIS
    if plane.extent(even.position) == 0.0:
        raise InputError("the tool does not move; record a stroke")
    rate = (len(even.t) - 1) / even.duration
    cutoff = choices.cutoff or basis / (2.0 * even.duration)
    smooth = smoothing.low_pass(even.position, rate, cutoff)
    part = smoothing.moving_part(even.t, smooth) if choices.trim else slice(0, len(even.t))
    if choices.cutoff is None and part != slice(0, len(even.t)):
        # The stroke is shorter than the recording, so that the basis carries higher frequencies.
        cutoff = basis / (2.0 * float(np.ptp(even.t[part])))
        smooth = smoothing.low_pass(even.position, rate, cutoff)
    t, position = even.t[part] - even.t[part][0], smooth[part]
    rotation = None if even.rotation is None else even.rotation[part]

    axes = plane.stroke_axes(position, None if rotation is None else rotation[0, :, 2])
    # The original model knows no chart: its six coordinates are those of the base frame.
    C = axes if choices.model == "modified" else np.eye(3)
    x = np.zeros((len(t), 6))
    x[:, :3] = (position - position[0]) @ C if choices.model == "modified" else position
    first = None
    if even.rotation is not None and rotation is not None:
        # Over the whole recording, as the positions: a filter that began at the cut would take the
        # first sample for the truth.
        E = C.T @ even.rotation @ rotation[0].T @ C
        angles = smoothing.low_pass(rotations.to_euler_continuous(E), rate, cutoff)
        E = rotations.from_euler(angles[part])
        # R(0) takes in what smoothing did to the first sample, so that E begins with no turn.
        first = C @ E[0] @ C.T @ rotation[0]
        x[:, 3:] = rotations.to_euler_continuous(E @ E[0].T)
    removed = np.sum((position - even.position[part]) ** 2, axis=1)
    return Prepared(
        Trajectory(t, position, rotation),
        smoothing.differentiated(t, x),
        TaskFrame(position[0], position[-1], axes, first),
        plane.is_closed(position),
        float(np.sqrt(np.mean(removed))),
        (float(even.t[part][0]), float(even.t[-1] - even.t[part][-1])),
        cutoff,
        even.position[part],
    )


def check_alike(prepared: Sequence[Prepared]) -> None:
    """Refuse to mix open and closed strokes, or strokes with and without orientation.

    Raises
    ------
    InputError
    """
    first = prepared[0]
    for i, other in enumerate(prepared[1:], start=2):
        if other.closed != first.closed:
            kinds = {True: "closed", False: "open"}
            raise InputError(
                f"demonstration {i} is {kinds[other.closed]}, the first is {kinds[first.closed]}; "
                "fit them apart"
            )
        if (other.frame.rotation is None) != (first.frame.rotation is None):
            raise InputError(
                f"demonstration {i} and the first: only one has an orientation; fit them apart"
            )
