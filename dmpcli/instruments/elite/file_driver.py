"""The other way to move an EC arm: a whole plan with time stamps is sent first, then played.

Nothing depends on our timing once it plays; nothing can be corrected either. So there is no force
coupling and no deceleration along the path: a stop is the controller's own.
"""

from collections.abc import Callable

import numpy as np

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError
from dmpcli.instruments.driver_protocol import DriverInfo, DriverState
from dmpcli.instruments.elite.arm_driver import ArmDriver

START_DELAY = 0.2
"""How long after the start the arm may take to begin, s; what it takes is not known."""

_VERDICTS = {-1: "their number is wrong", -2: "their form is wrong", -3: "their times are wrong"}


class FileDriver(ArmDriver):
    """A `ServoDriver` and `PlanDriver`: it takes whole plans, and no set-points.

    Parameters
    ----------
    settings : Settings
    clock : Clock
    """

    STOPS = (("stop_trajectory", {}), ("stop", {}))

    def connect(self) -> DriverInfo:
        """Connect; see `Controller.connect`."""
        self._controller.connect()
        return self._controller.declaration(START_DELAY)

    def state(self) -> DriverState:
        """Return what the monitor last told; of a robot that plays only while it can be stopped."""
        if self._begun:
            self._controller.poll()
        return self._controller.state(powered=self._begun)

    def upload(
        self, targets: Floats, period: float, meanwhile: Callable[[], None] = lambda: None
    ) -> None:
        """Send every set-point with its time, and let the controller check them.

        Parameters
        ----------
        targets : array, shape (n, 6)
            Joint angles, degrees.
        period : float
            s.
        meanwhile : callable
            Called before each point; what it raises ends the upload.

        Raises
        ------
        RefusedError
            The controller is not in remote mode.
        InstrumentError
            It does not take them.
        """
        if targets.ndim != 2 or targets.shape[1] != 6 or not np.isfinite(targets).all():
            raise ValueError("joint angles of shape (n, 6) are needed, and finite ones")
        ask = self._controller.requests
        self._controller.take_over()  # before anything is sent that ending it might flush
        ask.deed(
            "start_push_pos",
            {
                "path_lenth": len(targets),  # the maker's spelling
                "pos_type": 0,
                "ref_joint_pos": targets[0].tolist(),
                "ref_frame": [0.0] * 6,
                "ret_flag": 1,
            },
        )
        for number, target in enumerate(targets):
            meanwhile()
            point = {"timestamp": round(number * period, 9), "pos": target.tolist()}
            ask.deed("push_pos", point)
        ask.deed("stop_push_pos")
        verdict = ask.whole("check_trajectory", -3, 0)
        if verdict != 0:
            raise InstrumentError(
                f"{self._controller.name}: refuses the {len(targets)} points: {_VERDICTS[verdict]}"
            )

    def start(self, period: float) -> None:  # noqa: ARG002
        """Make the robot ready to play.

        Raises
        ------
        RefusedError
            The robot must not move.
        """
        self._controller.make_ready()

    def play(self) -> None:
        """Begin to move."""
        self._begun = True
        self._controller.requests.deed("start_trajectory", {"speed_percent": 100})

    def send(self, target: Floats) -> bool:  # noqa: ARG002
        """Take no set-point."""
        return False
