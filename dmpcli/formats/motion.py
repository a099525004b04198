"""What leaves in a file of another program: strokes as time, poses, wrench and joints."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InputError
from dmpcli.spatial.output_events import OutputEvent
from dmpcli.spatial.trajectory import Trajectory


@dataclass(frozen=True)
class MotionStroke(Trajectory):
    """One stroke of a motion, in mm, s and base axes as everywhere.

    Attributes
    ----------
    id : str
    wrench : array, shape (T, 6), or None
        On the tool, at the TCP, base axes, N and N·m.
    joints : array, shape (T, J), or None
        rad.
    events : tuple of OutputEvent
        What is switched along it.
    """

    id: str = "1"
    wrench: Floats | None = None
    joints: Floats | None = None
    events: tuple[OutputEvent, ...] = ()


@dataclass(frozen=True)
class Motion:
    """The strokes of one file, in its order.

    Attributes
    ----------
    name : str
        What messages call the file.
    kind : str
        demonstration, trajectory, run or batch.
    strokes : list of MotionStroke
        At least one.
    facts : dict
        What the file says beside them.
    """

    name: str
    kind: str
    strokes: list[MotionStroke]
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def oriented(self) -> bool:
        """Whether every stroke says how the tool is turned."""
        return all(one.rotation is not None for one in self.strokes)

    def turned(self, rotation: Floats) -> "Motion":
        """Return the motion with one orientation, (3, 3), for strokes that say none."""
        strokes = [
            one
            if one.rotation is not None
            else replace(one, rotation=np.broadcast_to(rotation, (len(one), 3, 3)))
            for one in self.strokes
        ]
        return replace(self, strokes=strokes)

    def rotation_needed(self, form: str) -> None:
        """Refuse a motion whose strokes do not all say how the tool is turned.

        Raises
        ------
        InputError
        """
        bare = next((one for one in self.strokes if one.rotation is None), None)
        if bare is not None:
            raise InputError(
                f"{self.name}: stroke {bare.id!r} says no orientation of the tool, which {form} "
                "needs; --orientation RX RY RZ gives one for all of it (3.14159 0 0 points down)"
            )

    def one(self, form: str) -> MotionStroke:
        """Return the only stroke, for a format that holds no more.

        Raises
        ------
        InputError
            There are several.
        """
        if len(self.strokes) > 1:
            raise InputError(
                f"{self.name}: holds {len(self.strokes)} strokes, {form} holds one; choose with "
                "--id NAME, or put {id} into the name of the output for a file of each"
            )
        return self.strokes[0]
