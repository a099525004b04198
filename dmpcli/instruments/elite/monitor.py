"""The EC controller's monitor port: a frame about every 8 ms; the newest one is kept.

What must not be missed is kept too: an emergency stop, a collision or an alarm that a single frame
shows, between two looks of however slow a loop.
"""

import contextlib
import math
import socket
import threading
from collections import deque
from dataclasses import replace

from dmpcli.errors import InstrumentError
from dmpcli.instruments import sockets
from dmpcli.instruments.elite.frames import MATCHING_WORD, SIZE, FrameBuffer, MonitorReport
from dmpcli.instruments.protocols import Clock

# What a frame tells of between one and the next, s, where it cannot be told from the first frames.
_NOMINAL = 0.008
# Of so many frames that interval is taken, and of so many what it is now.
_FIRST, _LAST = 64, 256
# The first in which both clocks agree to this share are believed; a smaller slew is not told apart.
_AGREE, _SLEWS = 0.01, 0.003

# Two clocks may drift apart by this share; a delay that grows more slowly is not seen.
_DRIFT = 5e-4


class Delay:
    """How much later frames arrive than the quickest one did, by the controller's time stamps.

    A connection that lags behind hands out frames as regularly as ever, of an ever older past.

    Attributes
    ----------
    value : float
        Of the last frame, s.
    """

    def __init__(self) -> None:
        self.value = 0.0
        self._recent: deque[tuple[float, float]] = deque(maxlen=_LAST)
        self._interval = 0.0
        self._least, self._t, self._stamp = math.inf, 0.0, -math.inf

    def undone(self, report: MonitorReport) -> float:
        """Return when a frame would have arrived without its delay, s.

        Parameters
        ----------
        report : MonitorReport
            Later than all before.
        """
        stamp = 1e-3 * report.timestamp
        offset = report.t - stamp
        if stamp < self._stamp:
            self._least = offset  # the controller's clock was set
        else:
            self._least = min(offset, self._least + _DRIFT * (report.t - self._t))
        self._t, self._stamp = report.t, stamp
        self._recent.append((report.t, stamp))
        if self._interval == 0.0 and len(self._recent) == _FIRST:
            here, there = self._steps()
            self._interval = here if abs(there - here) <= _AGREE * here else _NOMINAL
        self.value = offset - self._least
        return report.t - self.value

    @property
    def slew(self) -> float | None:
        """By which share the controller's clock runs slow; None where the connection lags instead.

        Either lets its time stamps fall behind. A clock that is slow writes stamps that lie closer
        than the frames are apart; a connection that lags hands out frames further apart than they
        were made.
        """
        if len(self._recent) < 3:
            return None
        # A delay that has come at once is no slew: that grows evenly.
        ends = self._recent[0], self._recent[len(self._recent) // 2], self._recent[-1]
        behind = [t - stamp for t, stamp in ends]
        if min(behind[1] - behind[0], behind[2] - behind[1]) < 0.25 * (behind[2] - behind[0]):
            return None
        here, there = self._steps()
        made = self._interval or _NOMINAL
        slow = 1.0 - there / here if here > 0.0 else 0.0
        return slow if abs(there - made) > abs(here - made) and slow >= _SLEWS else None

    def _steps(self) -> tuple[float, float]:
        """Mean time between two frames by our clock and by the controller's, s."""
        (t0, stamp0), (t1, stamp1) = self._recent[0], self._recent[-1]
        count = len(self._recent) - 1
        return (t1 - t0) / count, (stamp1 - stamp0) / count


class Monitor:
    """Listens on the monitor port in a thread of its own.

    Parameters
    ----------
    host : str
    port : int
    patience : float
        For connecting and for a frame that is waited for, s.
    clock : Clock
    word : int or None
        The frames' matching word; None lets any pass.
    oldest : float
        Age of the newest report beyond which it is no state, s.
    """

    def __init__(
        self,
        host: str,
        port: int,
        patience: float,
        clock: Clock,
        word: int | None = MATCHING_WORD,
        oldest: float = 0.1,
    ) -> None:
        self._host, self._port, self._patience = host, port, patience
        self._what = f"robot {host}:{port} (monitor)"
        self._clock, self._oldest = clock, oldest
        self._frames = FrameBuffer(word)
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None
        self._closing = False
        self._gone = ""
        self._news = threading.Condition()
        self._newest: MonitorReport | None = None
        self._arrived = 0.0  # when the newest one did, by our clock
        self._latched: MonitorReport | None = None
        self._delay = Delay()

    def open(self) -> None:
        """Connect, and wait for the first frame.

        Raises
        ------
        InstrumentError
        """
        self._socket = sockets.connect(self._host, self._port, self._patience, self._what)
        self._socket.settimeout(0.2)
        self._thread = threading.Thread(target=self._listen, args=(self._socket,), daemon=True)
        self._thread.start()
        with self._news:
            self._news.wait_for(lambda: self._newest or self._gone, self._patience)
        try:
            self.newest()
        except InstrumentError:
            self.close()
            raise

    def newest(self, after: float | None = None, patience: float | None = None) -> MonitorReport:
        """Return the newest report.

        Parameters
        ----------
        after : float, optional
            Wait for one that is of later than this, s.
        patience : float, optional
            How long, s; that of the monitor by default.

        Raises
        ------
        InstrumentError
            There is none, it is too old, or no other can come.
        """
        with self._news:
            if after is not None:
                self._news.wait_for(
                    lambda: self._gone or (self._newest is not None and self._newest.t > after),
                    self._patience if patience is None else patience,
                )
            report, gone, delay = self._newest, self._gone, self._delay.value
            arrived, slew = self._arrived, self._delay.slew
        why = gone or ("silent" if delay <= self._oldest else f"its frames come {delay:.2f} s late")
        if self._frames.lost:
            why += f"; a frame {self._frames.fault}"
        if report is None:
            raise InstrumentError(f"{self._what}: sends no state ({why}); check the port")
        age = self._clock.now() - report.t
        waited_in_vain = after is not None and report.t <= after
        if gone or waited_in_vain or not age <= self._oldest:
            if not gone and slew is not None and self._clock.now() - arrived <= self._oldest:
                raise InstrumentError(
                    f"{self._what}: its clock runs {100.0 * slew:.3g} % slow against this "
                    f"computer's, and its time stamps have fallen {delay:.2f} s behind, while its "
                    "frames come as ever; mend its clock, or let it be set while nothing moves"
                )
            raise InstrumentError(
                f"{self._what}: no new state for {age:.2f} s ({why}); check cable and power"
            )
        return report

    @property
    def latched(self) -> MonitorReport | None:
        """The first report of an emergency stop, a collision or an alarm, since it was opened.

        It stays, whatever later frames say: nobody may go on as if it had not been.
        """
        with self._news:
            return self._latched

    def forget(self) -> None:
        """Let go of the latched report, once its cause was cleared on our own demand."""
        with self._news:
            self._latched = None

    def close(self) -> None:
        """Disconnect; may be called twice."""
        self._closing = True
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            if self._thread is not None:
                self._thread.join(1.0)
            self._socket.close()
        self._socket = self._thread = None

    def _listen(self, connection: socket.socket) -> None:
        gone = "closed"
        while not self._closing:
            try:
                received = connection.recv(8 * SIZE)
            except TimeoutError:
                continue
            except OSError as error:
                gone = sockets.words(error)
                break
            if not received:
                gone = "the controller closed the connection"
                break
            for report in self._frames.feed(received, self._clock.now()):
                self._take(report)
        with self._news:
            self._gone = gone
            self._news.notify_all()

    def _take(self, report: MonitorReport) -> None:
        with self._news:
            if self._latched is None and report.alarming:
                self._latched = report
            # A controller that repeats itself is no news, however often it does so.
            if self._newest is None or report.timestamp != self._newest.timestamp:
                self._arrived = report.t
                self._newest = replace(report, t=self._delay.undone(report))
                self._news.notify_all()
