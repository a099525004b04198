"""The simulated box's web pages: two to read, two that change a setting.

Only the fields that clients are known to read are there, by the names of the real pages.
"""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from urllib.parse import parse_qsl, urlsplit
from xml.sax.saxutils import escape

from dmpcli.instruments.netft.settings import FILTERS
from dmpcli.simulation.netft_server.settings import INTERNAL_RATE
from dmpcli.simulation.netft_server.state import BoxState

_BIASES = {f"setbias{axis}": axis for axis in range(6)}
_MOST_RECORDS = 40


class Pages:
    """Serves the pages until closed.

    Parameters
    ----------
    box : BoxState
    """

    def __init__(self, box: BoxState) -> None:
        class PageHandler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                status, kind, page = get(box, self.path)
                body = page.encode()
                self.send_response(status)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:  # noqa: A002
                pass

        self._server = _PageServer((box.settings.host, box.settings.http_port), PageHandler)
        self.port = int(self._server.server_address[1])
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.05,), name="rdt pages", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _PageServer(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def server_bind(self) -> None:
        """Bind without looking up the host's name, which can take seconds."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = self.socket.getsockname()

    def handle_error(self, request: object, client_address: object) -> None:
        """A client that goes away is none of the box's business."""


def get(box: BoxState, path: str) -> tuple[int, str, str]:
    """Answer one request.

    Parameters
    ----------
    box : BoxState
    path : str
        With its query.

    Returns
    -------
    tuple
        HTTP status, kind of content, page.
    """
    parts = urlsplit(path)
    if parts.path == "/netftapi2.xml":
        return 200, "text/xml", _page("netft", _settings(box))
    if parts.path == "/netftcalapi.xml":
        return 200, "text/xml", _page("netftCalibration", _calibration(box))
    if parts.path in ("/comm.cgi", "/setting.cgi"):
        taken = [_change(box, parts.path, key, text) for key, text in parse_qsl(parts.query)]
        if taken and all(taken):
            return 200, "text/html", "<html><body>done</body></html>"
        return 400, "text/html", "<html><body>no such setting</body></html>"
    return 404, "text/html", "<html><body>no such page</body></html>"


def _change(box: BoxState, path: str, key: str, text: str) -> bool:
    """Change one setting; False where it is not known, or the value is wrong."""
    try:
        value = int(text)
    except ValueError:
        return False
    if path == "/comm.cgi" and key == "comrdtrate" and 1 <= value <= INTERNAL_RATE:
        box.set_rate(value)
    elif path == "/comm.cgi" and key == "comrdtbsiz" and 1 <= value <= _MOST_RECORDS:
        box.records = value
    elif path == "/comm.cgi" and key == "comrdte" and value in (0, 1):
        box.enabled = bool(value)
    elif path == "/setting.cgi" and key == "setuserfilter" and 0 <= value < len(FILTERS):
        box.low_pass = value
    elif path == "/setting.cgi" and key in _BIASES:
        box.set_bias(_BIASES[key], value)
    else:
        return False
    return True


def _settings(box: BoxState) -> dict[str, str]:
    s = box.settings
    counts, status = box.reading(time.monotonic())
    # A page gives the range in the units that the box is set to.
    most = s.limit / s.scale.per_unit
    return {
        "prodname": s.product,
        "runstat": f"{status:#010x}",
        "runft": ";".join(str(count) for count in counts.tolist()),
        "runrate": str(INTERNAL_RATE),
        "setcfgsel": "0",
        "setuserfilter": str(box.low_pass),
        "setbias": ";".join(str(count) for count in box.bias().tolist()),
        "cfgnam": s.configuration,
        "cfgcalsel": "0",
        "cfgcpf": f"{s.scale.counts_per_force:.12g}",
        "cfgcpt": f"{s.scale.counts_per_torque:.12g}",
        "scfgfu": s.scale.force_unit,
        "scfgtu": s.scale.torque_unit,
        "cfgmr": ";".join(f"{value:.9g}" for value in most.tolist()),
        "comrdte": "Enabled" if box.enabled else "Disabled",
        "comrdtrate": str(box.rate),
        "comrdtbsiz": str(box.records),
    }


def _calibration(box: BoxState) -> dict[str, str]:
    scale = box.settings.scale
    return {
        "calsn": box.settings.serial,
        "calcpf": f"{scale.counts_per_force:.12g}",
        "calcpt": f"{scale.counts_per_torque:.12g}",
        "scalfu": scale.force_unit,
        "scaltu": scale.torque_unit,
    }


def _page(root: str, fields: dict[str, str]) -> str:
    lines = "\n".join(f"<{name}>{escape(text)}</{name}>" for name, text in fields.items())
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<{root}>\n{lines}\n</{root}>\n'
