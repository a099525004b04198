"""Look at pages as a person would: ``pages.py FOLDER PAGE...``.

Each page is opened in headless Chromium at the widths of a phone and of a desk, and photographed
once it has drawn; a message of an error, a request to anywhere, or a page wider than its window is
a failure. Chromium is spoken to through a pipe; nothing but the standard library is needed.
"""

import base64
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

WIDTHS = (390, 1400)
HEIGHT = 900
PATIENCE = 120.0
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--disable-default-apps", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--remote-debugging-pipe", "--hide-scrollbars", "--mute-audio"),
]


class Browser:
    """A headless Chromium of its own, with an empty profile."""

    def __init__(self, program: str) -> None:
        self.profile = tempfile.mkdtemp(prefix="pages-")
        to_read, self.out = os.pipe()
        self.into, to_write = os.pipe()
        # Chromium reads from number 3 and writes to number 4.
        fixed = f'exec "$0" "$@" 3<&{to_read} 4>&{to_write}'
        words = [program, *FLAGS, f"--user-data-dir={self.profile}", "about:blank"]
        self.process = subprocess.Popen(
            ["bash", "-c", fixed, *words],
            pass_fds=(to_read, to_write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(to_read)
        os.close(to_write)
        self.number, self.waiting, self.events = 0, b"", list[dict[str, Any]]()

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        """End the browser and all that it started."""
        os.close(self.out)
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        os.close(self.into)
        shutil.rmtree(self.profile, ignore_errors=True)

    def call(self, method: str, session: str | None = None, **parameters: Any) -> dict[str, Any]:
        """Ask for something and wait for the answer; events meanwhile are kept."""
        self.number += 1
        asked = {"id": self.number, "method": method, "params": parameters}
        if session:
            asked["sessionId"] = session
        os.write(self.out, json.dumps(asked).encode() + b"\0")
        end = time.monotonic() + PATIENCE
        while True:
            told = self._message(end)
            if told.get("id") == self.number:
                if "error" in told:
                    raise RuntimeError(f"{method}: {told['error']['message']}")
                return dict(told["result"])
            if "method" in told:
                self.events.append(told)

    def _message(self, end: float) -> dict[str, Any]:
        while b"\0" not in self.waiting:
            left = end - time.monotonic()
            if left <= 0.0 or not select.select([self.into], [], [], left)[0]:
                raise RuntimeError("Chromium does not answer")
            piece = os.read(self.into, 1 << 20)
            if not piece:
                raise RuntimeError("Chromium has ended")
            self.waiting += piece
        first, _, self.waiting = self.waiting.partition(b"\0")
        return dict(json.loads(first))


def look(browser: Browser, page: Path, width: int, picture: Path) -> list[str]:
    """Open a page at a width, photograph it and return what is wrong with it."""
    target = browser.call("Target.createTarget", url="about:blank")["targetId"]
    session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def call(method: str, **parameters: Any) -> dict[str, Any]:
        return browser.call(method, session, **parameters)

    def value(expression: str) -> Any:
        told = call("Runtime.evaluate", expression=expression, returnByValue=True)
        return told["result"].get("value")

    for domain in ("Page", "Runtime", "Log", "Network"):
        call(f"{domain}.enable")
    phone = width < 600
    metrics = {"width": width, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": phone}
    call("Emulation.setDeviceMetricsOverride", **metrics)
    browser.events.clear()
    call("Page.navigate", url=page.resolve().as_uri())
    scripted = "data-drawn" in page.read_text() or "dataset.drawn" in page.read_text()
    done = "document.readyState === 'complete'"
    if scripted:
        done += " && document.body.dataset.drawn === 'yes'"
    end = time.monotonic() + PATIENCE
    while not value(done):
        if time.monotonic() > end:
            value("0")  # so that what was told meanwhile is read
            return [f"{page.name} at {width}: not drawn after {PATIENCE:g} s", *wrong(browser)]
        time.sleep(0.1)
    value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    time.sleep(0.3)
    found = [f"{page.name} at {width}: {line}" for line in wrong(browser)]
    wide = int(value("document.documentElement.scrollWidth"))
    if wide > width:
        found.append(f"{page.name} at {width}: is {wide} wide")
    if scripted:
        found += [f"{page.name} at {width}: {line}" for line in empty(value)]
    shot = call("Page.captureScreenshot", format="png", captureBeyondViewport=not scripted)
    picture.write_bytes(base64.b64decode(shot["data"]))
    browser.call("Target.closeTarget", targetId=target)
    return found


def wrong(browser: Browser) -> list[str]:
    """What the browser told of the page since it was opened: errors, and requests elsewhere."""
    found = []
    for told in browser.events:
        method, said = told["method"], told["params"]
        if method == "Runtime.exceptionThrown":
            found.append(f"exception: {said['exceptionDetails'].get('text')}")
        elif method == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning"):
            words = " ".join(str(arg.get("value", "")) for arg in said["args"])
            found.append(f"console {said['type']}: {words}")
        elif method == "Log.entryAdded" and said["entry"]["level"] == "error":
            found.append(f"log: {said['entry']['text']}")
        elif method == "Network.requestWillBeSent":
            url = said["request"]["url"]
            if not url.startswith(("file:", "data:", "blob:", "about:")):
                found.append(f"asks for {url}")
    return found


def empty(value: Any) -> list[str]:
    """Tell whether a page that is drawn on has nothing on it."""
    size = value(
        "(() => { const c = document.querySelector('canvas');"
        " return c ? [c.width, c.height] : null; })()"
    )
    return [] if size and min(size) > 100 else [f"its canvas is {size}"]


def main(folder: Path, pages: list[Path]) -> None:
    """Look at all pages at all widths."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        raise SystemExit("pages: chromium is not installed; Debian: apt-get install chromium")
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    with Browser(program) as browser:
        for page in pages:
            for width in WIDTHS:
                picture = folder / f"{page.parent.name}-{page.stem}-{width}.png"
                found += look(browser, page, width, picture)
                print(f"pages: {picture}")
    if found:
        raise SystemExit("\n".join(found))
    print(f"pages: {len(pages)} pages at {' and '.join(map(str, WIDTHS))}: nothing is wrong")


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(word) for word in sys.argv[2:]])
