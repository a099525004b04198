"""An EC controller of a few lines, at the level of bytes: it says what a test scripts.

It shares nothing with the drivers: frames are packed by ``struct`` from the documented layout. Only
its inverse kinematics, which is not what is tested with it, is ours.
"""

import contextlib
import json
import socket
import struct
import threading
import time

import numpy as np

from dmpcli.instruments import pose_forms
from dmpcli.kinematics import inverse, models
from tests.instruments.test_servo_adapter import declared

LAYOUT = struct.Struct(">IQB8d6d6d8d3i8ii3d5dQQB6d6dBd8dd8d6d6d6d6dB220xI")
WORD = 0xEC8056EC
HOME = (30.0, -80.0, 100.0, -110.0, -90.0, 20.0)


def frame(
    joints=HOME, *, stamp=1, state=0, servo=1, synced=1, mode=2, collision=0, estop=0, size=1024,
    word=WORD,
):  # fmt: skip
    """One monitor frame, by the documented layout."""
    zero = [0.0] * 8
    return LAYOUT.pack(
        size, stamp, 0, *joints, 0.0, 0.0, *zero[:6], *zero[:6], *zero, state, servo, synced,
        *[0] * 8, mode, *zero, 0, 0, collision, *zero[:6], *zero[:6], estop, 0.0, *zero, 0.0,
        *zero, *[0.0] * 24, 0, word,
    )  # fmt: skip


def reply(result, number, end=b""):
    """A reply as the controller encodes it: JSON within JSON."""
    return json.dumps({"jsonrpc": "2.0", "result": json.dumps(result), "id": number}).encode() + end


def refusal(number, code=-32693, message="Can't operate, robot must be in remote mode."):
    """A reply that says no."""
    error = {"code": code, "message": message}
    return json.dumps({"jsonrpc": "2.0", "error": error, "id": number}).encode()


class Scripted:
    """Both ports on loopback; closed by leaving the context.

    Attributes
    ----------
    answers : dict
        Method → result, or a callable of the parameters that returns one. A result of bytes is
        sent as it is, an exception's class hangs up.
    monitor : dict
        Changes to `frame`.
    asked : list of (method, params)
    """

    def __init__(self, end=b"\n", chop=0):
        self.end, self.chop = end, chop
        self.joints = list(HOME)
        self.monitor = {}
        self.sends_frames = True
        self.asked = []
        self.running = 0
        self.points = []
        self.answers = {
            "getRobotState": 0,
            "getRobotMode": 2,
            "get_estop_status": 0,
            "getServoStatus": True,
            "getMotorStatus": True,
            "get_joint_pos": lambda _: self.joints,
            "get_tcp_pose": lambda _: self.pose,
            "inverseKinematic": lambda p: p["referencePos"],
            "get_transparent_transmission_state": lambda _: self.running,
            "transparent_transmission_init": self._begin,
            "tt_put_servo_joint_to_buf": self._put,
            "tt_clear_servo_joint_buf": self._clear,
            "stop": True,
            "stop_trajectory": True,
            "start_push_pos": True,
            "push_pos": self._push,
            "stop_push_pos": True,
            "check_trajectory": 0,
            "start_trajectory": True,
        }
        self.pose = [0.0] * 6
        self.silent = False
        self._open = True
        self._threads, self._listeners, self._connections = [], [], []

    def _begin(self, params):
        self.running, self.begun = 1, params
        return True

    def _clear(self, params):
        self.running = 0
        return True

    def _put(self, params):
        self.points.append(params["targetPos"])
        return True if self.begun["response_enable"] else None

    def _push(self, params):
        self.points.append(params["pos"])
        return True

    @staticmethod
    def solve(params):
        """The kinematics of an EC66 without a tool."""
        goal = pose_forms.decode(declared(), np.array(params["targetPose"]))
        near = np.radians(params["referencePos"])
        return np.degrees(inverse.nearest(models.model("ec66"), goal, near)).tolist()

    def methods(self):
        return [method for method, _ in self.asked]

    def __enter__(self):
        self.port, self.monitor_port = self._serve(self._talk), self._serve(self._report)
        return self

    def __exit__(self, *_):
        self._open = False
        for each in self._listeners + self._connections:
            each.close()
        for thread in self._threads:
            thread.join(2.0)

    @property
    def query(self):
        """Host, port and options of the URL that reaches it."""
        return f"127.0.0.1:{self.port}?monitor_port={self.monitor_port}"

    def hang_up_next(self, method):
        """Close the connection on the next request for a method, and answer the ones after it."""
        usual = self.answers[method]

        def once(_):
            self.answers[method] = usual
            raise OSError("hangs up")

        self.answers[method] = once

    def hang_up(self):
        """Close every connection; new ones are taken."""
        for each in self._connections:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)

    def _serve(self, deed):
        listener = socket.create_server(("127.0.0.1", 0))
        listener.settimeout(0.05)
        self._listeners.append(listener)
        self._spawn(self._accept, listener, deed)
        return listener.getsockname()[1]

    def _spawn(self, deed, *arguments):
        thread = threading.Thread(target=self._quietly, args=(deed, *arguments), daemon=True)
        self._threads.append(thread)
        thread.start()

    def _quietly(self, deed, *arguments):
        with contextlib.suppress(OSError):  # the other end has hung up
            deed(*arguments)
        if deed != self._accept:
            arguments[0].close()

    def _accept(self, listener, deed):
        while self._open:
            try:
                connection, _ = listener.accept()
            except TimeoutError:
                continue
            connection.settimeout(0.05)
            self._connections.append(connection)
            self._spawn(deed, connection)

    def _talk(self, connection):
        pending = b""
        while self._open:
            try:
                received = connection.recv(4096)
            except TimeoutError:
                continue
            if not received:
                return
            *lines, pending = (pending + received).split(b"\n")
            for line in lines:
                request = json.loads(line)
                self.asked.append((request["method"], request["params"]))
                self._answer(connection, request)

    def _answer(self, connection, request):
        result = self.answers[request["method"]]
        if callable(result) and not isinstance(result, type):
            result = result(request["params"])
        if result is None or result == b"" or self.silent:
            return
        if isinstance(result, type):
            raise OSError("hangs up")
        said = result if isinstance(result, bytes) else reply(result, request["id"], self.end)
        said = said.replace(b"{id}", str(request["id"]).encode())
        for at in range(0, len(said), self.chop or len(said)):
            connection.sendall(said[at : at + (self.chop or len(said))])

    def _report(self, connection):
        while self._open:
            if self.sends_frames:
                stamp = time.monotonic_ns() // 1_000_000
                connection.sendall(frame(self.joints, **{"stamp": stamp} | self.monitor))
            time.sleep(0.004)
