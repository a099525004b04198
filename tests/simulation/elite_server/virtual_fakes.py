"""A virtual lab on a clock that the test moves, and a client that speaks raw bytes."""

import json
import socket
from typing import Any

import numpy as np

from dmpcli.simulation.elite_server.behaviour import Behaviour
from dmpcli.simulation.elite_server.lab import LabParameters, VirtualLab
from dmpcli.simulation.elite_server.motions import Policies
from dmpcli.simulation.mock.parameters import PEN, SensorParameters

START = np.array([-551.030, 131.399, -17.560])
QUIET = SensorParameters(noise=np.zeros(6), drift=np.zeros(6))


class Time:
    """s, moved by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Bench:
    """A lab whose time stands until it is told to pass."""

    def __init__(self, hand=None, lag: float = 0.0, policies: Policies | None = None, **changes):
        self.time = Time()
        changes = {"position": START, "tool": PEN, "sensor": QUIET, "lag": lag} | changes
        habits = Behaviour(policies=policies or Policies())
        self.lab = VirtualLab(LabParameters(**({"habits": habits} | changes)), hand, self.time)
        self.controller, self.arm = self.lab.controller, self.lab.controller.arm

    def call(self, method: str, **params: Any) -> Any:
        return self.lab.call(method, params)

    def wait(self, seconds: float) -> None:
        self.time.now += seconds
        self.lab.call("getRobotState", {})

    def switch_on(self) -> "Bench":
        assert self.call("clearAlarm")
        assert self.call("syncMotorStatus")
        assert self.call("set_servo_status", status=1)
        return self

    def begin(self, lookahead: float = 100, t: float = 20, response: int = 1) -> "Bench":
        self.switch_on()
        assert self.call(
            "transparent_transmission_init",
            lookahead=lookahead,
            t=t,
            smoothness=0,
            response_enable=response,
        )
        return self

    @property
    def degrees(self) -> np.ndarray:
        return np.degrees(self.arm.joints)

    def put(self, degrees: np.ndarray) -> Any:
        return self.call("tt_put_servo_joint_to_buf", targetPos=list(map(float, degrees)))


class Client:
    """JSON-RPC by a bare socket, as the maker's own examples do it."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=5.0)

    def send(self, raw: bytes) -> bytes:
        self.socket.sendall(raw)
        return self.socket.recv(1024)

    def call(self, method: str, params: Any = None) -> Any:
        request = {"method": method, "params": params or {}, "jsonrpc": "2.0", "id": 7}
        reply = json.loads(self.send(json.dumps(request).encode() + b"\n"))
        assert reply["id"] == 7
        return json.loads(reply["result"]) if "result" in reply else reply["error"]

    def close(self) -> None:
        self.socket.close()
