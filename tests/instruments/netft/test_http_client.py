"""Whatever is at the other end, a call to a box's pages ends at its deadline."""

import contextlib
import itertools
import socket
import threading
import time

import pytest

from dmpcli.instruments.netft.http_client import Box, NoAnswerError

WAIT = 0.5
ENOUGH = 10.0
"""s: once these calls had no end; no measure of speed."""


@contextlib.contextmanager
def server(answer):
    """Serve one connection: pieces of bytes, each followed by a pause."""
    ended = threading.Event()

    def serve():
        with contextlib.suppress(OSError):
            client, _ = listener.accept()
            listener.close()  # who asks for another page is refused, and does not wait
            with client:
                client.recv(65536)
                for piece, pause in answer:
                    client.sendall(piece)
                    if ended.wait(pause):
                        return

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        ended.set()
    thread.join(ENOUGH)


OK = b"HTTP/1.1 200 OK\r\n"
DRIPS = {
    "a status line": ((bytes([b]), 0.05) for b in itertools.cycle(b"HTTP/1.1 ")),
    "headers": itertools.chain([(OK, 0.0)], ((b"a", 0.05) for _ in itertools.count())),
    "100 Continue": ((b"HTTP/1.1 100 Continue\r\n\r\n", 0.01) for _ in itertools.count()),
    "a body": itertools.chain(
        [(OK + b"Content-Length: 100000\r\n\r\n", 0.0)], ((b"<", 0.05) for _ in itertools.count())
    ),
    "chunks": itertools.chain(
        [(OK + b"Transfer-Encoding: chunked\r\n\r\n", 0.0)],
        ((b"1\r\n<\r\n", 0.05) for _ in itertools.count()),
    ),
    "nothing": [(b"", 60.0)],
}


@pytest.mark.parametrize("what", DRIPS)
def test_a_page_that_drips_has_the_deadline_of_the_whole(what):
    begin = time.monotonic()
    with server(DRIPS[what]) as port, pytest.raises(NoAnswerError, match="timed out"):
        Box("127.0.0.1", port, 1).info(WAIT)
    assert WAIT * 0.9 <= time.monotonic() - begin < ENOUGH


def test_a_calibration_that_drips_has_it_too():
    drip = ((b"\x12", 0.05) for _ in itertools.count())
    with server(drip) as port, pytest.raises(NoAnswerError, match="timed out"):
        Box("127.0.0.1", 1, port).calibration(WAIT)


@pytest.mark.parametrize(
    "answer",
    [
        OK + b"Content-Length: 7\r\n\r\n<a></a>",
        OK + b"Connection: close\r\n\r\n<a></a>",
        b"HTTP/1.0 200 OK\r\n\r\n<a></a>",
        b"HTTP/1.1 100 Continue\r\n\r\n" + OK + b"Content-Length: 7\r\n\r\n<a></a>",
        OK + b"Transfer-Encoding: chunked\r\n\r\n7\r\n<a></a>\r\n0\r\n\r\n",
    ],
)
def test_every_form_of_answer_is_read(answer):
    with server([(answer, 0.0)]) as port, pytest.raises(ValueError, match="gives no cfgcpf"):
        Box("127.0.0.1", port, 1).info(ENOUGH)
