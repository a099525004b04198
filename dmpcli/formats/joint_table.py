"""CSV of joint angles along a stroke, by the inverse kinematics of an arm; rad."""

from dataclasses import replace

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import RefusedError
from dmpcli.formats.csv_table import table
from dmpcli.formats.motion import Motion
from dmpcli.kinematics.models import Arm
from dmpcli.kinematics.path import follow
from dmpcli.spatial.pose import Pose
from dmpcli.spatial.wrench import Tool


def with_joints(motion: Motion, arm: Arm, tool: Tool | None, start: Floats | None = None) -> Motion:
    """Return the motion with the joint angles of an arm that follows it.

    Strokes that hold joints keep them. The next stroke begins in the posture of the last one.

    Parameters
    ----------
    motion : Motion
    arm : Arm
    tool : Tool, optional
        Without one the TCP is the flange.
    start : array, shape (6,), optional
        Joint angles near to which the first stroke begins, rad.

    Raises
    ------
    InputError
        A stroke says no orientation.
    RefusedError
        A stroke is out of reach, beyond a joint's limit or speed.
    """
    motion.rotation_needed("joint angles")
    strokes = []
    for one in motion.strokes:
        if one.joints is None:
            assert one.rotation is not None
            flange = Pose(one.position, np.asarray(one.rotation))
            if tool is not None:
                flange = tool.flange(flange)
            period = float(np.median(np.diff(one.t)))
            found = follow(arm, flange.position[None], flange.rotation[None], period, start)
            where = f"{motion.name}: stroke {one.id!r}"
            for peak, what in (
                (found.missing, "is out of reach"),
                (found.angle, "turns a joint beyond its limit"),
                (found.speed, "turns a joint faster than it can"),
            ):
                if not peak.passed[0]:
                    at, joint = int(peak.sample[0]), int(peak.joint[0]) + 1
                    which = "" if what == "is out of reach" else f", joint {joint}"
                    raise RefusedError(
                        f"{where}: {arm.name} {what} at {one.t[at]:.3f} s{which}; move the stroke, "
                        "draw it more slowly, or name the tool with --tool"
                    )
            one = replace(one, joints=found.joints[0])
        strokes.append(one)
        start = np.asarray(one.joints)[-1]
    return replace(motion, strokes=strokes)


def encode(motion: Motion) -> bytes:
    """Return a table ``t [s], q1 [rad], ...``; with ``id`` where there are several strokes."""
    columns: dict[str, object] = {}
    if len(motion.strokes) > 1:
        columns["id"] = [one.id for one in motion.strokes for _ in range(len(one))]
    columns["t [s]"] = np.concatenate([one.t for one in motion.strokes])
    joints = np.concatenate([np.asarray(one.joints) for one in motion.strokes])
    columns |= {f"q{i + 1} [rad]": joints[:, i] for i in range(joints.shape[1])}
    return table(columns)
