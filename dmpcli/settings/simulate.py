"""The options of ``simulate``."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from dmpcli.settings.model import Option, Settings

Port = Annotated[int, Ge(0), Le(65535)]


@dataclass(frozen=True, kw_only=True)
class SimulateOptions(Settings):
    """Where the lab serves, and what happens in it; port 0 is a free one."""

    sensor_port: Annotated[Port, Option("Sensor box, UDP; 0 is a free one.")] = 49152
    http_port: Annotated[Port, Option("Its pages; 0 is a free one.")] = 8080
    tcp_port: Annotated[Port, Option("Its TCP interface; 0 is a free one.")] = 49151
    robot_port: Annotated[Port, Option("Controller, JSON-RPC; 0 is a free one.")] = 8055
    monitor_port: Annotated[Port, Option("Its monitor; 0 is a free one.")] = 8056
    host: Annotated[
        str,
        Option("Address to serve; any other than loopback opens it to a network.", metavar="HOST"),
    ] = "127.0.0.1"
    fault: Annotated[
        tuple[str, ...],
        Option(
            "What goes wrong: loss, duplicate, reorder, malformed, silence, saturation, estop, "
            "collision, mode, refuse, drop; or what the controller does: underrun, jump, euler, "
            "newline. See docs/simulate.md.",
            metavar="KIND[=VALUE][@T]",
            unset="nothing",
        ),
    ] = ()
    strokes: Annotated[
        int, Ge(0), Option("How many strokes the hand draws before it stays away.")
    ] = 1
    physics: Annotated[
        Literal["springs", "mujoco"],
        Option("Contact by a spring under the tip, or arm and pen in MuJoCo: needs dmpcli[bench]."),
    ] = "springs"
    lookahead: Annotated[
        float, Ge(0), Le(1), Option("Of the arm that the hand has practised with.", "s")
    ] = 0.1
