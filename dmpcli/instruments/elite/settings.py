"""The options of an ``elite://`` URL, and what each is when it is not given."""

from dataclasses import dataclass

from dmpcli.instruments.address import Address
from dmpcli.instruments.driver_protocol import Orientation
from dmpcli.instruments.elite.frames import MATCHING_WORD
from dmpcli.instruments.options import Options

RPC_PORT, MONITOR_PORT = 8055, 8056

EULER: dict[str, Orientation] = {"xyz": "xyz euler", "zyx": "zyx euler"}
"""Which rx, ry, rz the controller means."""


@dataclass(frozen=True)
class EliteSettings:
    """How an EC controller is spoken to.

    Attributes
    ----------
    host : str
    port, monitor_port : int
    mode : str
        ``stream``: transparent transmission; ``file``: the whole plan is sent, then played.
    lookahead : float
        Of the transparent transmission, s.
    smoothness : float
        Of it, 0 to 1.
    responses : bool
        Whether every set-point is acknowledged.
    servo : str
        ``auto``: synchronise and switch the servos on when motion begins; ``manual``: refuse.
    clear_alarm : bool
        Whether an alarm is cleared at the start.
    take_over : bool
        Whether a motion that the controller says is under way, though the arm stands still, is
        ended; a transmission always is.
    tool, coordinate : int
        Tool and coordinate system of the pose that is checked; -1 is the present tool and the base.
    orientation : str
        What the controller's rx, ry, rz are.
    base_turn, flange_turn : float
        rad; see `DriverInfo`.
    tolerance : float
        Of the checks at the start, mm; 0 leaves them out.
    word : int or None
        Matching word of the monitor's frames; None lets any pass.
    radians : bool
        Whether the monitor tells its joint angles in rad instead of degrees.
    patience : float
        For connecting and for a reply, s.
    oldest : float
        Age of the last state beyond which the robot counts as lost, s.
    """

    host: str
    port: int
    monitor_port: int
    mode: str
    lookahead: float
    smoothness: float
    responses: bool
    servo: str
    clear_alarm: bool
    take_over: bool
    tool: int
    coordinate: int
    orientation: Orientation
    base_turn: float
    flange_turn: float
    tolerance: float
    word: int | None
    radians: bool
    patience: float
    oldest: float


def read(address: Address) -> EliteSettings:
    """Read the options of a URL.

    Raises
    ------
    InputError
        One is unknown or out of range.
    """
    options = Options(address)
    settings = EliteSettings(
        host=address.host,
        port=RPC_PORT if address.port is None else address.port,
        monitor_port=options.whole("monitor_port", MONITOR_PORT, 1, 65535),
        mode=options.choice("mode", "stream", "stream", "file"),
        lookahead=options.number("lookahead", 0.1, 0.01, 1.0, "s"),
        smoothness=options.number("smoothness", 0.1, 0.0, 1.0, ""),
        responses=options.flag("responses", True),
        servo=options.choice("servo", "auto", "auto", "manual"),
        clear_alarm=options.flag("clear_alarm", False),
        take_over=options.flag("take_over", False),
        tool=options.whole("tool", -1, -1, 7),
        coordinate=options.whole("coordinate", -1, -1, 7),
        orientation=EULER[options.choice("euler", "xyz", *EULER)],
        base_turn=options.quarter_turn("base_turn"),
        flange_turn=options.quarter_turn("flange_turn"),
        tolerance=options.number("check", 2.0, 0.0, 100.0, "mm, 0 for no check"),
        word=MATCHING_WORD if options.flag("word", True) else None,
        radians=options.choice("monitor_angle", "deg", "deg", "rad") == "rad",
        patience=options.number("patience", 1.0, 0.05, 10.0, "s"),
        oldest=options.number("oldest", 0.1, 0.02, 1.0, "s"),
    )
    options.done()
    return settings
