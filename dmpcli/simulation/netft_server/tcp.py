"""The simulated box's TCP interface: READFT and READCALINFO.

Source: ATI Axia manual 9620-05-C, chapter 12 (TCP interface).
"""

import contextlib
import socketserver
import struct
import threading
import time

import numpy as np

from dmpcli.instruments.netft import units
from dmpcli.instruments.netft.protocol import MAGIC
from dmpcli.simulation.netft_server.state import BoxState

COMMAND_SIZE = 20
READFT, READCALINFO = 0, 1
_READING = struct.Struct(">HH6h")
_CALIBRATION = struct.Struct(">HBBII6H")
_INT16 = 2**15 - 1


class BoxTcp:
    """Answers on the TCP port until closed.

    Parameters
    ----------
    box : BoxState
    """

    def __init__(self, box: BoxState) -> None:
        class CommandHandler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                with contextlib.suppress(OSError):
                    while True:
                        command = b""
                        while len(command) < COMMAND_SIZE:
                            part = self.request.recv(COMMAND_SIZE - len(command))
                            if not part:
                                return
                            command += part
                        self.request.sendall(answer(box, command))

        self._server = _CommandServer((box.settings.host, box.settings.tcp_port), CommandHandler)
        self.port = int(self._server.server_address[1])
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.05,), name="rdt tcp", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop answering."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _CommandServer(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True
    block_on_close = False


def answer(box: BoxState, command: bytes) -> bytes:
    """Return the reply to one command of 20 bytes; nothing to one that is not known.

    Parameters
    ----------
    box : BoxState
    command : bytes
    """
    scale = box.settings.scale
    most = np.abs(box.settings.limit / scale.per_count)
    factors = np.maximum(np.ceil(most / _INT16), 1).astype(int)
    if command[0] == READCALINFO:
        forces = {name: number for number, name in units.FORCE_NUMBERS.items()}
        torques = {name: number for number, name in units.TORQUE_NUMBERS.items()}
        return _CALIBRATION.pack(
            MAGIC,
            forces[scale.force_unit],
            torques[scale.torque_unit],
            round(scale.counts_per_force),
            round(scale.counts_per_torque),
            *factors,
        )
    if command[0] == READFT:
        counts, status = box.reading(time.monotonic())
        values = np.clip(np.round(counts / factors), -_INT16, _INT16).astype(int)
        return _READING.pack(MAGIC, status >> 16, *values)
    return b""
