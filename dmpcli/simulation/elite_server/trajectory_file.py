"""The simulated EC66's time-stamped trajectory: pushed point by point, checked, then run."""

from collections.abc import Callable

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.simulation.elite_server.parameters import BAD_PARAMS, Params, RpcError

OK, WRONG_LENGTH, WRONG_FORMAT, WRONG_TIMES = 0, -1, -2, -3
"""What check_trajectory answers."""


class TrajectoryFile:
    """Points of one trajectory.

    Attributes
    ----------
    last : array, shape (6,), or None
        Joint angles of the point pushed last, or those that the file is near to at first, rad.
    """

    def __init__(self) -> None:
        self._clear()

    def _clear(self) -> None:
        self._length = 0
        self._pushing = self._poses = False
        self._whole = True
        self._times: list[float] = []
        self._joints: list[Floats] = []
        self.last: Floats | None = None

    @property
    def times(self) -> Floats:
        """Time stamps, s, shape (n,)."""
        return np.array(self._times)

    @property
    def joints(self) -> Floats:
        """Joint angles, rad, shape (n, 6)."""
        return np.array(self._joints)

    def begin(self, params: Params) -> bool:
        """Begin anew (``start_push_pos``); False while one is being pushed."""
        # The maker's spelling.
        length = int(params.number("path_lenth", 2, 1e6))
        poses = params.choice("pos_type", (0, 1), 0) == 1
        if self._pushing:
            return False
        near = params.joints("ref_joint_pos") if params.has("ref_joint_pos") else None
        self._clear()
        self._length, self._poses, self._pushing, self.last = length, poses, True, near
        return True

    def push(self, params: Params, joints_of_pose: Callable[[str], Floats]) -> bool:
        """Add a point (``push_pos``); a damaged one spoils the file, as its check will tell."""
        if not self._pushing:
            return False
        try:
            time = params.number("timestamp", 0.0, 1e6)
            joints = joints_of_pose("pos") if self._poses else params.joints("pos")
        except RpcError as error:
            if error.code != BAD_PARAMS:
                raise
            self._whole = False
            return False
        self._times.append(time)
        self._joints.append(joints)
        self.last = joints
        return True

    def end(self, _: Params) -> bool:
        """End the pushing (``stop_push_pos``); False when none was begun."""
        was, self._pushing = self._pushing, False
        return was

    def check(self, _: Params) -> int:
        """Judge the file (``check_trajectory``)."""
        return self.verdict()

    def flush(self, _: Params) -> bool:
        """Forget the file (``flush_trajectory``)."""
        self._clear()
        return True

    def verdict(self) -> int:
        """0, or what is wrong with it."""
        if not self._whole:
            return WRONG_FORMAT
        if self._pushing or len(self._times) != self._length or not self._times:
            return WRONG_LENGTH
        rising = bool(np.all(np.diff(self.times) > 0.0))
        return OK if rising and self._times[0] == 0.0 else WRONG_TIMES
