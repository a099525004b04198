"""TUM trajectories: ``t x y z qx qy qz qw`` a line, s and m, Hamilton quaternion, scalar last.

Format: cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats.
"""

import numpy as np

from dmpcli.formats import text
from dmpcli.formats.motion import Motion
from dmpcli.spatial.rotations import to_quaternion

_HEAD = "# timestamp tx ty tz qx qy qz qw\n"


def encode(motion: Motion) -> bytes:
    """Return the one stroke of a motion as text.

    Raises
    ------
    InputError
        It holds several strokes, or one without orientation.
    """
    motion.rotation_needed("TUM")
    one = motion.one("TUM")
    assert one.rotation is not None
    values = np.column_stack([one.t, one.position / 1000.0, to_quaternion(one.rotation)])
    # Seventeen digits: a double comes back as it was.
    return (_HEAD + "\n".join(text.rows(values, "%.17g" + " %.17g" * 7)) + "\n").encode()
