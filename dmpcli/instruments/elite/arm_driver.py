"""What both ways to move an EC arm share: whom they ask, and how the arm is left."""

from typing import ClassVar

from dmpcli.arrays import Floats
from dmpcli.instruments.elite.controller import Controller
from dmpcli.instruments.elite.requests import Params
from dmpcli.instruments.elite.settings import EliteSettings
from dmpcli.instruments.protocols import Clock


class ArmDriver:
    """The part of a `ServoDriver` that does not depend on how set-points travel.

    Parameters
    ----------
    settings : EliteSettings
    clock : Clock

    Attributes
    ----------
    STOPS : tuple
        Methods that end the motion, with their parameters, in order.
    """

    STOPS: ClassVar[tuple[tuple[str, Params], ...]]

    def __init__(self, settings: EliteSettings, clock: Clock) -> None:
        self._settings = settings
        self._controller = Controller(settings, clock)
        self._begun = False

    def inverse(self, pose: Floats, near: Floats) -> Floats | None:
        """Joint angles of a TCP pose by the controller; see `Controller.inverse`."""
        return self._controller.inverse(pose, near)

    def stop(self) -> None:
        """Stop; what was never begun is not stopped."""
        if self._begun:
            self._controller.halt(*self.STOPS)
            self._begun = False  # only now: what failed is tried again

    def halt(self) -> None:
        """Stop while another call hangs."""
        self._controller.halt_beside(*self.STOPS)

    def close(self) -> None:
        """Stop and disconnect."""
        try:
            self.stop()
        finally:
            self._controller.close()
