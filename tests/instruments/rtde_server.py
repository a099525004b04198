"""A small RTDE server to run in another process: ur-rtde's constructor keeps Python's lock.

``python -m tests.instruments.rtde_server ADDRESS`` listens on RTDE's own port of a loopback
address, prints ``ready``, and then obeys lines on standard input: ``safety MODE BITS``,
``mode ROBOT_MODE``, ``x METRES``, ``freeze``, ``drop``. It says after each what it did.
"""

import select
import socket
import struct
import sys
import time

PORT = 30004
TYPES = {
    "timestamp": ("DOUBLE", "d", 1),
    "actual_q": ("VECTOR6D", "d", 6),
    "actual_TCP_pose": ("VECTOR6D", "d", 6),
    "robot_mode": ("INT32", "i", 1),
    "safety_mode": ("INT32", "i", 1),
    "robot_status_bits": ("UINT32", "I", 1),
    "safety_status_bits": ("UINT32", "I", 1),
}
STATE = {
    "actual_q": (0.1, -1.2, 1.3, -1.4, 1.5, 0.6),
    "actual_TCP_pose": (-0.4, 0.1, 0.3, 0.0, 3.0, 0.5),
    "robot_mode": (7,),
    "safety_mode": (1,),
    "robot_status_bits": (1,),
    "safety_status_bits": (1,),
}


def message(kind: str, body: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(body), ord(kind)) + body


class Session:
    """One client."""

    def __init__(self, link: socket.socket) -> None:
        self.link, self.buffer, self.streams = link, b"", False
        self.names: list[str] = []

    def take(self, data: bytes) -> None:
        self.buffer += data
        while len(self.buffer) >= 3:
            size, kind = struct.unpack(">HB", self.buffer[:3])
            if len(self.buffer) < size:
                return
            body, self.buffer = self.buffer[3:size], self.buffer[size:]
            self.answer(chr(kind), body)

    def answer(self, kind: str, body: bytes) -> None:
        if kind == "v":
            self.link.sendall(message("v", struct.pack(">4I", 5, 12, 0, 0)))
        elif kind == "O":
            # The list of names may end in a comma.
            self.names = [name for name in body[8:].decode().split(",") if name]
            types = ",".join(TYPES[name][0] for name in self.names)
            self.link.sendall(message("O", b"\x01" + types.encode()))
        elif kind in "VSP":
            self.streams = kind == "S"
            self.link.sendall(message(kind, b"\x01"))

    def sample(self, t: float) -> None:
        if self.streams:
            values = {**STATE, "timestamp": (t,)}
            body = b"".join(
                struct.pack(f">{TYPES[name][2]}{TYPES[name][1]}", *values[name])
                for name in self.names
            )
            self.link.sendall(message("U", b"\x01" + body))


class Robot:
    """The sessions, and what standard input makes of them."""

    def __init__(self, address: str) -> None:
        self.listener = socket.create_server((address, PORT))
        self.sessions: list[Session] = []
        self.frozen = False

    def obey(self, word: str, *values: str) -> None:
        if word == "freeze":
            self.frozen = True
        elif word == "drop":
            for session in self.sessions:
                session.link.close()
            self.sessions.clear()
        elif word == "x":
            STATE["actual_TCP_pose"] = (float(values[0]), *STATE["actual_TCP_pose"][1:])
        elif word == "mode":
            STATE["robot_mode"] = (int(values[0]),)
        elif word == "safety":
            STATE["safety_mode"], STATE["safety_status_bits"] = (int(values[0]),), (int(values[1]),)

    def hear(self, session: Session) -> None:
        try:
            data = session.link.recv(4096)
        except ConnectionResetError:
            data = b""
        if data:
            session.take(data)
        else:
            self.sessions.remove(session)

    def stream(self) -> None:
        for session in [] if self.frozen else list(self.sessions):
            try:
                session.sample(time.monotonic())
            except OSError:
                self.sessions.remove(session)


def serve(address: str) -> None:
    robot = Robot(address)
    print("ready", flush=True)  # noqa: T201
    while True:
        links = {session.link: session for session in robot.sessions}
        heard = select.select([robot.listener, sys.stdin, *links], [], [], 0.004)[0]
        if robot.listener in heard:
            robot.sessions.append(Session(robot.listener.accept()[0]))
        for link in links.keys() & set(heard):
            robot.hear(links[link])
        if sys.stdin in heard:
            words = sys.stdin.readline().split()
            if not words:
                return
            robot.obey(*words)
            print(words[0], flush=True)  # noqa: T201
        robot.stream()


if __name__ == "__main__":
    serve(sys.argv[1])
