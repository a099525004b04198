"""The EC controller's monitor frames: 1024 bytes, big-endian; cut out of a byte stream and checked.

The layout is that of two public decoders, which agree; neither states a unit. So nothing but the
joint angles and the state is used, and the driver compares the angles with those of the JSON-RPC.
"""

import struct
from dataclasses import dataclass

import numpy as np

from dmpcli.arrays import Floats

SIZE = 1024
MATCHING_WORD = 0xEC8056EC
"""What public decoders find in a frame's last four bytes."""

FRAME = np.dtype(
    [
        ("size", ">u4"),
        ("timestamp", ">u8"),  # ms since the epoch
        ("cycle", "u1"),
        ("joints", ">f8", 8),
        ("tcp_base", ">f8", 6),
        ("tcp_user", ">f8", 6),
        ("torque", ">f8", 8),
        ("state", ">i4"),
        ("servo_ready", ">i4"),
        ("motors_synchronised", ">i4"),  # can_motor_run of the decoders
        ("motor_speed", ">i4", 8),  # rpm
        ("mode", ">i4"),
        ("analog_in", ">f8", 3),
        ("analog_out", ">f8", 5),
        ("digital_in", ">u8"),
        ("digital_out", ">u8"),
        ("collision", "u1"),
        ("flange_base", ">f8", 6),
        ("flange_user", ">f8", 6),
        ("estop", "u1"),
        ("tcp_speed", ">f8"),
        ("joint_speed", ">f8", 8),
        ("tcp_acceleration", ">f8"),
        ("joint_acceleration", ">f8", 8),
        ("temperature", ">f8", 6),
        ("joint_torque", ">f8", 6),
        ("external_torque", ">f8", 6),
        ("tcp_force", ">f8", 6),
        ("drag", "u1"),
        ("reserved", "u1", 220),
        ("word", ">u4"),
    ]
)
"""One frame; 1024 bytes without padding."""

# No joint of an EC arm turns further; an angle beyond is no angle in degrees or radians.
_LARGEST_ANGLE = 720.0

ALARMING = (2, 4, 5)
"""States, as getRobotState answers, in which something has stopped the arm."""

_HEAD = SIZE.to_bytes(4, "big")
_FLAGS = ("servo_ready", "motors_synchronised", "collision", "estop")
_CODES = {"u1": "B", "i4": "i", "u4": "I", "u8": "Q", "f8": "d"}


def _reader(*names: str) -> struct.Struct:
    """What unpacks these fields of a frame, in its order: a tenth of the time of a numpy record."""
    code = ">"
    for name in FRAME.names or ():
        field = FRAME[name]
        count = int(np.prod(field.shape, dtype=int))
        code += f"{count}{_CODES[field.base.str[1:]]}" if name in names else f"{field.itemsize}x"
    return struct.Struct(code)


_READ = _reader("size", "timestamp", "joints", "state", "mode", *_FLAGS, "word")


class BadFrameError(Exception):
    """A frame that cannot be believed; the text names the fault."""


@dataclass(frozen=True)
class MonitorReport:
    """What one frame says.

    Attributes
    ----------
    t : float
        When it arrived, s, on the run's clock.
    timestamp : int
        The controller's own, ms.
    joints : array, shape (6,)
        Angles in the monitor's unit.
    state, mode : int
        As getRobotState and getRobotMode answer.
    servo_ready, motors_synchronised, collision, estop : bool
    """

    t: float
    timestamp: int
    joints: Floats
    state: int
    mode: int
    servo_ready: bool
    motors_synchronised: bool
    collision: bool
    estop: bool

    @property
    def alarming(self) -> bool:
        """Whether it shows an emergency stop, a collision or an alarm."""
        return self.estop or self.collision or self.state in ALARMING


def decode(frame: bytes, t: float, word: int | None = MATCHING_WORD) -> MonitorReport:
    """Read one frame.

    Parameters
    ----------
    frame : bytes
        1024 of them.
    t : float
        When it arrived, s.
    word : int or None
        The matching word; None lets any pass.

    Raises
    ------
    BadFrameError
        Its size or matching word is wrong, a joint angle is not a number or out of range, or state
        or mode is unknown.
    """
    if len(frame) != SIZE:
        raise BadFrameError(f"has {len(frame)} bytes, not {SIZE}")
    size, timestamp, *rest = _READ.unpack(frame)
    joints, (state, servo, motors, mode, collision, estop, last) = rest[:6], rest[8:]
    if size != SIZE:
        raise BadFrameError(f"says that it has {size} bytes, not {SIZE}")
    if word is not None and last != word:
        raise BadFrameError(f"ends in {last:#010x}, not in the matching word {word:#010x}")
    if not all(abs(angle) <= _LARGEST_ANGLE for angle in joints):
        raise BadFrameError(f"holds what is no joint angle: {joints}")
    if not (0 <= state <= 5 and 0 <= mode <= 2):
        raise BadFrameError(f"holds an unknown state or mode: {state}, {mode}")
    flags = (servo, motors, collision, estop)
    for flag, value in zip(_FLAGS, flags, strict=True):
        if value not in (0, 1):
            raise BadFrameError(f"holds what is neither yes nor no: {flag} {value}")
    return MonitorReport(t, timestamp, np.array(joints), state, mode, *map(bool, flags))


class FrameBuffer:
    """Cuts frames out of a stream of bytes, and finds the next one after garbage.

    Parameters
    ----------
    word : int or None
        The matching word; None lets any pass.

    Attributes
    ----------
    skipped : int
        Bytes that belonged to no frame.
    lost : bool
        Whether the last thing heard was no frame that could be believed.
    fault : str
        What was wrong when it last got lost; empty where it never did.
    """

    def __init__(self, word: int | None = MATCHING_WORD) -> None:
        self._word = word
        self._pending = b""
        self.skipped = 0
        self.lost = False
        self.fault = ""

    def feed(self, received: bytes, t: float) -> list[MonitorReport]:
        """Take in bytes; return what their whole frames say, oldest first.

        Parameters
        ----------
        received : bytes
        t : float
            When they arrived, s.
        """
        self._pending += received
        reports = []
        while len(self._pending) >= SIZE:
            head = self._pending.find(_HEAD)
            if head != 0:
                # Go on from the next place where a frame could begin; its head may be cut.
                rest = len(self._pending) - len(_HEAD) + 1
                self._skip(head if head > 0 else rest, "does not begin where the last one ended")
                continue
            try:
                reports.append(decode(self._pending[:SIZE], t, self._word))
                self._pending, self.lost = self._pending[SIZE:], False
            except BadFrameError as error:
                self._skip(1, str(error))  # a good one may begin inside it
        return reports

    def _skip(self, count: int, fault: str) -> None:
        self.skipped += count
        self._pending = self._pending[count:]
        if not self.lost:
            self.lost, self.fault = True, fault
