"""What both ways to move an EC arm share: whom they ask, and how the arm is left."""

from typing import ClassVar

from dmpcli.arrays import Floats
from dmpcli.errors import InstrumentError
from dmpcli.instruments import outputs
from dmpcli.instruments.elite.controller import Controller
from dmpcli.instruments.elite.requests import Params
from dmpcli.instruments.elite.settings import EliteSettings
from dmpcli.instruments.protocols import Clock

_LAST_OUTPUT = 19


def _switched(number: int, on: bool) -> tuple[str, Params]:
    return "setOutput", {"addr": number, "status": int(on)}


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
        self._on: list[int] = []  # outputs

    def output(self, name: str) -> None:
        """Make sure that the controller has an output of this name: DO0 to DO19, its Y0 to Y19.

        Raises
        ------
        InputError
        """
        outputs.number(name, self._controller.name, 0, _LAST_OUTPUT)

    def switch(self, name: str, on: bool) -> None:
        """Switch an output; see `OutputDriver.switch`.

        Raises
        ------
        InstrumentError
            The controller does not do it.
        RefusedError
            It is not in remote mode.
        """
        number = outputs.number(name, self._controller.name, 0, _LAST_OUTPUT)
        if not on:
            self._controller.insist(*_switched(number, on))
            self._on = [other for other in self._on if other != number]
            return
        self._on = [*(other for other in self._on if other != number), number]
        patience = max(self._settings.lookahead, 0.1)
        if not self._controller.requests.yes(*_switched(number, on), patience):
            raise InstrumentError(f"{self._controller.name}: did not switch {name} on")

    def inverse(self, pose: Floats, near: Floats) -> Floats | None:
        """Joint angles of a TCP pose by the controller; see `Controller.inverse`."""
        return self._controller.inverse(pose, near)

    def stop(self) -> None:
        """Stop; what was never begun is not stopped."""
        if self._begun:
            self._controller.halt(*self.STOPS)
            self._begun = False  # only now: what failed is tried again

    def halt(self) -> None:
        """Stop while another call hangs, and switch off what is on."""
        offs = [_switched(number, on=False) for number in self._on]
        self._controller.halt_beside(*self.STOPS, *offs)

    def close(self) -> None:
        """Stop and disconnect."""
        try:
            self.stop()
        finally:
            self._controller.close()
