"""Streaming to an EC controller: transparent transmission of joint angles.

The controller keeps a buffer of ``lookahead / t`` points and begins to move when it is full; one
point leaves it every t. So it is filled with the actual angles first, and from then on every
set-point is reached one look-ahead after it was sent.
"""

import contextlib
import math
from dataclasses import replace

from dmpcli.arrays import Floats, finite
from dmpcli.errors import InputError, InstrumentError
from dmpcli.instruments.driver_protocol import DriverInfo, DriverState
from dmpcli.instruments.elite.arm_driver import ArmDriver
from dmpcli.instruments.elite.settings import EliteSettings
from dmpcli.instruments.protocols import Clock

REFUSED = 0.05
"""s: so long a refusal is waited upon for its reason, before anything is stopped."""

_MILLISECOND = 1e-3

_PUT = "tt_put_servo_joint_to_buf"


class StreamDriver(ArmDriver):
    """A `ServoDriver` that sends one set-point after the other.

    Parameters
    ----------
    settings : EliteSettings
    clock : Clock
    """

    STOPS = (("tt_clear_servo_joint_buf", {"clear": 0}), ("stop", {}))

    def __init__(self, settings: EliteSettings, clock: Clock) -> None:
        super().__init__(settings, clock)
        self._running = False

    def connect(self) -> DriverInfo:
        """Connect; see `Controller.connect`.

        Raises
        ------
        InputError
            The look-ahead is no whole number of ms.
        """
        _milliseconds(
            "lookahead", self._settings.lookahead
        )  # else it would be refused as motion begins
        self._controller.connect()
        declared = self._controller.declaration(self._settings.lookahead)
        shortest, longest = declared.period_range
        # The buffer must hold two set-points or more.
        range_ = shortest, min(longest, self._settings.lookahead / 2.0)
        return replace(declared, queues=True, period_range=range_, period_step=_MILLISECOND)

    def state(self) -> DriverState:
        """Return what the monitor last told."""
        return self._controller.state(powered=self._running)

    def start(self, period: float) -> None:
        """Enter transparent transmission, and fill its buffer with the actual joint angles.

        Raises
        ------
        InputError
            Period or look-ahead is no whole number of ms, or the look-ahead shorter than two of
            the former.
        RefusedError
            The robot must not move.
        InstrumentError
            The controller does not do it.
        """
        s = self._settings
        t, lookahead = _milliseconds("period", period), _milliseconds("lookahead", s.lookahead)
        if lookahead < 2 * t:
            raise InputError(
                f"--robot: lookahead = {s.lookahead:g} s: must be two servo periods or more, "
                f"{2 * period:g} s"
            )
        self._controller.make_ready()
        self._begun = True
        self._controller.requests.deed(
            "transparent_transmission_init",
            {
                "lookahead": lookahead,
                "t": t,
                "smoothness": s.smoothness,
                "response_enable": int(s.responses),
            },
        )
        self._running = True
        here = self._controller.fresh_joints()
        for _ in range(math.ceil(lookahead / t)):
            if not self.send(here):
                raise InstrumentError(
                    f"{self._controller.name}: refuses to be held where it is; see its pendant, "
                    "clear what it shows there, and try again"
                )

    def send(self, target: Floats) -> bool:
        """Send joint angles, shape (6,), degrees; False when they were not taken."""
        if not (self._running and target.shape == (6,) and finite(target)):
            return False
        params = {"targetPos": target.tolist()}
        if self._settings.responses:
            # An answer that comes later than the look-ahead helps nobody.
            patience = max(self._settings.lookahead, 0.1)
            taken = self._controller.requests.yes(_PUT, params, patience)
            if not taken:
                # The state that is asked for next shall tell why; the first frame to come may
                # have been on its way already.
                with contextlib.suppress(InstrumentError):
                    self._controller.fresh_joints(REFUSED / 2.0)
                    self._controller.fresh_joints(REFUSED / 2.0)
            return taken
        self._controller.requests.unanswered(_PUT, params)
        return True

    def stop(self) -> None:
        """Empty the buffer, and stop; what was never begun is not stopped."""
        self._running = False
        super().stop()


def _milliseconds(name: str, seconds: float) -> int:
    whole = round(1e3 * seconds)
    if abs(1e3 * seconds - whole) > 1e-6:
        raise InputError(
            f"--robot: {name} = {seconds:g} s: must be a whole number of ms, as the EC takes it"
        )
    return whole
